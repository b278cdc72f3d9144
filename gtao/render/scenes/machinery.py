"""Procedural scene of machine parts."""

import numpy as np

from .compose import Perspective, compose
from .mesh import Reflectance
from .registry import scene
from .surface import Surface, box, copies, cylinder, merge, move, revolve, rotation, torus, tube

BEND_STEPS = 8


def _pipe(corners, radius: float, bend: float) -> Surface:
    """Pipe along a polyline whose corners are rounded with Bezier arcs that start ``bend`` before them."""
    corners = np.asarray(corners, float)
    path = [corners[:1]]
    t = np.linspace(0, 1, BEND_STEPS)[:, None]
    for before, at, after in zip(corners[:-2], corners[1:-1], corners[2:], strict=True):
        start = at + bend * (before - at) / np.linalg.norm(before - at)
        end = at + bend * (after - at) / np.linalg.norm(after - at)
        path.append((1 - t) ** 2 * start + 2 * t * (1 - t) * at + t**2 * end)
    path.append(corners[-1:])
    return tube(np.concatenate(path), radius, 20)


def _ring_of(part: Surface, radius: float, n: int, height: float) -> Surface:
    """``n`` copies of a part, each turned with its place on a circle about z."""
    phi = 2 * np.pi * np.arange(n) / n
    turn = rotation(np.tile((0.0, 0, 1), (n, 1)), phi)
    return copies(part, np.stack([radius * np.cos(phi), radius * np.sin(phi), np.full(n, height)], -1), turn)


def _row(part: Surface, start, step, n: int) -> Surface:
    """``n`` copies of a part, ``step`` apart."""
    offsets = np.asarray(start, float) + np.arange(n)[:, None] * np.asarray(step, float)
    return copies(part, offsets, np.broadcast_to(np.eye(3), (n, 3, 3)))


def _gear(radius: float, thickness: float, teeth: int) -> Surface:
    inner = 0.3 * radius
    rim = revolve([(inner, 0), (radius, 0), (radius, thickness), (inner, thickness)], 48, closed=True)
    tooth = box((-0.12, -1.1 * radius / teeth, 0), (0.1, 1.1 * radius / teeth, thickness))
    return merge(rim, _ring_of(tooth, radius, teeth, 0.0))


@scene(
    kind="procedural",
    radius=0.5,
    solid=True,
    views=("three-quarter, above", "low, between the pipes"),
)
def machinery(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5) -> dict:
    """Machine-like clutter: tank with flanges and bolts, finned motor, gears, pipes with bends, crates."""
    upright_to_x = rotation((0, 1, 0), np.pi / 2)
    bolt = cylinder(0.035, -0.05, 0.06, 6)
    flange = merge(cylinder(0.72, 0, 0.1, 48), _ring_of(bolt, 0.64, 14, 0.1))
    tank = merge(cylinder(0.55, -0.1, 1.3, 48), move(flange, (0, 0, 0.35)), move(flange, (0, 0, 1.2)))
    tank = merge(tank, revolve([(0.5, 1.3), (0.42, 1.45), (0.25, 1.54), (0.05, 1.57)], 48), torus(0.62, 0.06))
    fin = revolve([(0.3, 0), (0.5, 0), (0.5, 0.03), (0.3, 0.03)], 40, closed=True)
    motor = merge(cylinder(0.36, 0, 1.3, 40), _row(fin, (0, 0, 0.12), (0, 0, 0.095), 12), cylinder(0.12, -0.4, 1.5))
    gears = merge(_gear(0.5, 0.14, 18), move(_gear(0.28, 0.14, 10), (0.0, 0.83, 0), rotation((0, 0, 1), 0.3)))
    spoke = box((-0.3, -0.03, -0.03), (0, 0.03, 0.03))
    parts = [
        box((-12, -12, -1), (12, 12, 0)),
        box((-2.1, -1.6, -0.5), (2.1, 1.6, 0.12)),
        move(tank, (-1.1, 0.6, 0.12)),
        move(motor, (0.25, -0.75, 0.72), upright_to_x),
        box((0.45, -1.1, 0), (1.4, -0.4, 0.4)),
        move(gears, (-0.15, -0.75, 0.72), upright_to_x @ rotation((0, 0, 1), 0.2)),
        _pipe([(-1.1, 0.6, 1.5), (-1.1, 0.6, 2.1), (0.6, 0.6, 2.1), (0.6, 0.6, -0.1)], 0.14, 0.35),
        _pipe([(-0.7, 0.3, 0.9), (0.1, 0.3, 0.9), (0.1, 1.1, 0.9), (1.5, 1.1, 0.9), (1.5, 1.1, -0.1)], 0.1, 0.25),
        _pipe([(-1.6, 1.2, 0.3), (1.9, 1.2, 0.3), (1.9, -1.3, 0.3), (1.9, -1.3, 0.9)], 0.08, 0.2),
        _pipe([(-0.8, 0.4, 0.62), (1.0, 0.4, 0.62), (1.0, -0.5, 0.62)], 0.07, 0.2),
        move(merge(torus(0.3, 0.05), _ring_of(spoke, 0.3, 5, 0.0)), (0.6, 0.6, 1.25)),
        move(box((-0.4, -0.3, 0), (0.4, 0.3, 0.55)), (-1.3, -0.85, 0.1), rotation((0, 0, 1), 0.3)),
        move(box((-0.25, -0.2, 0), (0.25, 0.2, 0.35)), (-1.25, -0.85, 0.6), rotation((0, 0, 1), -0.3)),
        _row(box((-0.02, -0.35, 0.1), (0.02, 0.35, 0.5)), (1.2, 0.7, 0), (0.09, 0, 0), 8),
    ]
    views = [Perspective((2.5, -3.4, 2.8), (0.0, 0.0, 0.7), 42), Perspective((2.3, -1.9, 1.5), (-0.1, 0.3, 0.6), 50)]
    return compose(merge(*parts), views, width, height, reflectance)
