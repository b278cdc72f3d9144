"""Animations in which objects move before a still camera."""

import numpy as np

from gtao.render.scenes.buildings import GROUND
from gtao.render.scenes.compose import Perspective, compose
from gtao.render.scenes.mesh import Reflectance, mesh
from gtao.render.scenes.surface import (
    Surface,
    box,
    copies,
    cylinder,
    merge,
    move,
    relief,
    revolve,
    rotation,
    sphere,
    torus,
)
from gtao.render.sequence_poses import rigid

from .registry import animation

__all__ = ["passing_object", "thin_bars", "waves"]


def _yard() -> Surface:
    """A floor before a wall, with things that stand on it and one kerb."""
    post = revolve([(0.13, -0.1), (0.1, 0.1), (0.07, 0.6), (0.11, 0.7), (0.03, 0.8)], 20)
    posts = copies(post, np.array([(x, 1.35, 0.0) for x in np.arange(-2.4, 2.5, 0.8)]), np.tile(np.eye(3), (7, 1, 1)))
    return merge(
        GROUND,
        box((-8, 1.8, -0.5), (8, 2.2, 3)),
        box((-8, 1.6, -0.5), (8, 2.2, 0.12)),
        posts,
        move(box((-0.35, -0.35, 0), (0.35, 0.35, 0.7)), (-1.5, 0.75, -0.01), rotation((0, 0, 1), 0.4)),
        move(box((-0.22, -0.22, 0), (0.22, 0.22, 0.44)), (-1.4, 0.8, 0.68), rotation((0, 0, 1), -0.2)),
        move(cylinder(0.3, -0.1, 0.75), (1.55, 0.85, 0)),
        move(sphere(32, 20), (0.35, 0.85, 0.3), 0.3 * np.eye(3)),
        move(torus(0.3, 0.09), (0.95, -1.15, 0.08)),
        move(box((-0.3, -0.16, 0), (0.3, 0.16, 0.2)), (-1.0, -1.2, -0.01), rotation((0, 0, 1), -0.5)),
    )


#: Radius of the wheels, in scene units.
WHEEL = 0.24


def _wheel() -> Surface:
    """Wheel with five spokes about the y axis, in the origin."""
    hub = merge(torus(WHEEL - 0.06, 0.06, 40, 12), cylinder(0.07, -0.06, 0.06, 16))
    spoke = box((0, -0.025, -0.03), (WHEEL - 0.05, 0.025, 0.03))
    phi = 2 * np.pi * np.arange(5) / 5
    spokes = copies(spoke, np.zeros((5, 3)), rotation(np.tile((0.0, 0, 1), (5, 1)), phi))
    return move(merge(hub, spokes), linear=rotation((1, 0, 0), np.pi / 2))


@animation(radius=0.6, n_frames=60, static_camera=True)
def passing_object(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5) -> dict:
    """Cart on rolling wheels that passes over a still floor, before a still camera."""
    scene = compose(_yard(), [Perspective((0.3, -4.6, 2.5), (0.05, 0.2, 0.4), 38)], width, height, reflectance)
    body = merge(
        box((-0.62, -0.36, 0.2), (0.62, 0.36, 0.4)),
        box((-0.62, -0.36, 0.38), (-0.54, 0.36, 0.72)),
        box((0.54, -0.36, 0.38), (0.62, 0.36, 0.72)),
        move(box((-0.2, -0.2, 0), (0.2, 0.2, 0.34)), (-0.2, 0.02, 0.39), rotation((0, 0, 1), 0.3)),
        move(sphere(32, 20), (0.27, -0.05, 0.57), 0.19 * np.eye(3)),
    )
    start, step = -2.1, 0.07
    way = {"body": lambda frame: rigid((start + step * frame, 0, 0))}
    scene["body"] = mesh(move(body, (0, -0.15, 0)), reflectance)

    def rolling(centre: tuple[float, float, float]):
        return lambda frame: rigid(
            (start + step * frame, 0, 0), axis=(0, 1, 0), angle=step * frame / WHEEL, about=centre
        )

    for name, x, y in (
        ("front_left", 0.4, 0.3),
        ("front_right", 0.4, -0.6),
        ("rear_left", -0.4, 0.3),
        ("rear_right", -0.4, -0.6),
    ):
        centre = (x, y, WHEEL)
        scene[name] = mesh(move(_wheel(), centre), reflectance)
        way[name] = rolling(centre)
    return {"scene": scene, "movers": way}


#: Width of the bars: 1.1 pixels at 128 pixels of height, 2.2 at 256, and a little more where they show a side.
BAR = 0.018


@animation(radius=0.4, n_frames=60, static_camera=True)
def thin_bars(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5) -> dict:
    """Bars that slide and spokes that turn before a wall, 1 to 3 pixels wide at 128 to 256 pixels of height."""
    pilasters = [box((x, 0.02, -0.5), (x + 0.22, 1, 4)) for x in (-1.05, 0.3, 1.4)]
    wall = merge(
        GROUND,
        box((-6, 0.12, -0.5), (6, 1, 4)),
        *pilasters,
        box((-0.7, 0.0, 0.55), (0.15, 0.5, 0.63)),
        box((-0.7, 0.0, 1.25), (0.15, 0.5, 1.33)),
        move(sphere(32, 20), (-0.35, 0.12, 0.77), 0.14 * np.eye(3)),
        move(sphere(32, 20), (-0.05, 0.14, 1.47), 0.13 * np.eye(3)),
        move(cylinder(0.12, -0.1, 0.4), (-0.3, 0.08, 1.3)),
        move(box((-0.25, -0.05, -0.1), (0.25, 0.2, 0.3)), (-0.3, 0.03, 0)),
    )
    scene = compose(wall, [Perspective((0.1, -4.2, 1.1), (0.0, 0.2, 0.95), 30)], width, height, reflectance)
    bar = box((-BAR / 2, -BAR / 2, -0.1), (BAR / 2, BAR / 2, 1.9))
    n = 14
    x = -0.5 - 0.17 * np.arange(n)
    places = np.stack([x, np.full(n, -0.1), np.zeros(n)], -1)
    rail = box((x[-1] - 0.1, -0.115, 1.7), (x[0] + 0.1, -0.085, 1.73))
    scene["grille"] = mesh(merge(copies(bar, places, np.tile(np.eye(3), (n, 1, 1))), rail), reflectance)
    spoke = box((0.1, -BAR / 2, -BAR / 2), (0.62, BAR / 2, BAR / 2))
    phi = 2 * np.pi * np.arange(9) / 9
    turned = rotation(np.tile((0.0, 1, 0), (9, 1)), phi)
    rim = move(torus(0.62, BAR / 2, 64, 8), linear=rotation((1, 0, 0), np.pi / 2))
    hub = move(cylinder(0.1, -0.04, 0.04), linear=rotation((1, 0, 0), np.pi / 2))
    centre = (0.65, -0.03, 0.95)
    scene["wheel"] = mesh(move(merge(copies(spoke, np.zeros((9, 3)), turned), rim, hub), centre), reflectance)
    return {
        "scene": scene,
        "movers": {
            "grille": lambda frame: rigid((0.025 * frame, 0, 0)),
            "wheel": lambda frame: rigid(axis=(0, 1, 0), angle=0.03 * frame, about=centre),
        },
    }


@animation(radius=0.6, n_frames=48, static_camera=True)
def waves(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5) -> dict:
    """Cloth that waves beneath still bars: a mesh that deforms."""
    u, v = np.meshgrid(np.linspace(-2.2, 2.2, 90), np.linspace(-1.8, 1.8, 60), indexing="ij")

    def cloth(frame: int) -> Surface:
        turn = 2 * np.pi * frame / 48
        z = 0.3 * np.sin(4.3 * u + 0.9 * v - turn) + 0.14 * np.sin(2.3 * v - 2.7 * u + 2 * turn)
        points = np.stack([u + 0.35 * z, v - 0.1 * z, z], axis=-1)
        return relief(points, -0.8)

    bars = [
        move(cylinder(0.12, -1.6, 1.6), (x, 0, 0.42), rotation((1, 0, 0.2 * x), np.pi / 2)) for x in (-1.2, 0.0, 1.2)
    ]
    still = merge(box((-12, -12, -1), (12, 12, -0.7)), *bars)
    scene = compose(still, [Perspective((1.6, -3.4, 3.0), (0.05, 0.0, 0.0), 40)], width, height, reflectance)
    scene["cloth"] = mesh(cloth(0), reflectance)
    return {"scene": scene, "deforming": {"cloth": lambda frame: cloth(frame).vertices}}
