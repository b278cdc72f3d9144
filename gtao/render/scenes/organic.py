"""Procedural scenes with curved and irregular surfaces."""

import numpy as np

from .compose import Perspective, compose
from .mesh import Reflectance
from .registry import scene
from .surface import (
    Surface,
    box,
    copies,
    cylinder,
    generator,
    merge,
    move,
    relief,
    revolve,
    rotation,
    sphere,
    torus,
    tube,
)


def _bump(directions: np.ndarray, centre, width) -> np.ndarray:
    """Bell of height 1 about ``centre`` on the unit sphere; ``width`` is a radius, or one for each axis."""
    centre = np.asarray(centre, float)
    offset = (directions - centre / np.linalg.norm(centre)) / np.asarray(width, float)
    return np.exp(-np.sum(offset**2, axis=-1))


def _skull() -> Surface:
    """Unit sphere displaced into a head that faces -y."""
    ball = sphere(160, 110)
    d = ball.vertices / np.linalg.norm(ball.vertices, axis=-1, keepdims=True)
    r = np.ones(len(d))
    for side in (-1, 1):
        r -= 0.26 * _bump(d, (0.36 * side, -0.92, 0.12), (0.2, 0.3, 0.14))
        r += 0.09 * _bump(d, (0.34 * side, -0.9, 0.34), (0.28, 0.4, 0.09))
        r += 0.06 * _bump(d, (0.52 * side, -0.85, -0.2), 0.25)
        r -= 0.06 * _bump(d, (0.13 * side, -0.95, -0.27), 0.05)
        r -= 0.06 * _bump(d, (0.95 * side, -0.3, 0.1), 0.3)
    for t in np.linspace(0, 1, 9):
        r += (0.03 + 0.06 * t) * _bump(d, (0, -1, 0.16 - 0.38 * t), (0.07 + 0.06 * t, 0.2, 0.07))
    r += 0.10 * _bump(d, (0, -0.85, -0.44), (0.26, 0.3, 0.12))
    r -= 0.12 * _bump(d, (0, -0.85, -0.45), (0.24, 0.4, 0.025))
    r -= 0.07 * _bump(d, (0, -0.8, -0.58), (0.3, 0.3, 0.06))
    r += 0.14 * _bump(d, (0, -0.75, -0.75), (0.22, 0.25, 0.15))
    # Hair: ridges from the brow to the nape, below which the displacement fades.
    hairy = 0.5 + 0.5 * np.tanh((d[:, 2] + 0.75 * d[:, 1] - 0.28) / 0.06)
    r += hairy * (0.08 + 0.075 * np.cos(18 * np.arctan2(d[:, 0], d[:, 2] + 0.3)))
    return Surface(d * r[:, None] * (0.76, 0.92, 1.08), ball.faces)


@scene(
    kind="procedural",
    radius=0.4,
    solid=True,
    views=("three-quarter from the front", "from below, at the neck and the eye sockets"),
)
def head(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5) -> dict:
    """Head-like blob: sockets with eyes, nose, mouth, ears, neck, collar and shoulders."""
    parts = [_skull(), cylinder(0.42, -1.7, -0.4, 48)]
    for side in (-1, 1):
        parts.append(move(sphere(32, 18), (0.25 * side, -0.585, 0.11), 0.13 * np.eye(3)))
        turn = rotation((0, 0, 1), -0.45 * side) @ rotation((0, 1, 0), np.pi / 2)
        ear = np.diag([1.25, 1, 1])
        parts.append(move(torus(0.17, 0.055, 40, 12), (0.76 * side, 0.06, 0.05), turn @ ear))
        parts.append(move(sphere(24, 12), (0.7 * side, 0.02, 0.02), turn @ np.diag([0.2, 0.14, 0.06])))
        parts.append(move(sphere(48, 24), (1.0 * side, 0.1, -2.15), np.diag([0.75, 0.6, 0.55])))
    parts.append(move(sphere(64, 32), (0, 0.08, -2.2), np.diag([1.3, 0.75, 0.75])))
    collar = [(0.55, -1.75), (0.78, -1.75), (0.72, -1.25), (0.66, -1.2), (0.6, -1.25)]
    parts.append(move(revolve(collar, 64, closed=True), (0, 0.06, 0)))
    views = [
        Perspective((2.0, -3.7, 1.3), (0.05, 0, -0.42), 38),
        Perspective((-0.9, -2.4, -1.1), (0.0, -0.2, -0.38), 50),
    ]
    return compose(merge(*parts), views, width, height, reflectance)


@scene(
    kind="procedural",
    radius=0.5,
    solid=True,
    views=("across the folds", "along the folds"),
)
def cloth(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5) -> dict:
    """Folded cloth: a height field sheared until its folds hang over."""
    u, v = np.meshgrid(np.linspace(-2.2, 2.2, 190), np.linspace(-2.2, 2.2, 150), indexing="ij")
    phase = 5.2 * u + 0.8 * np.sin(1.3 * v + 0.4) + 0.4 * np.sin(2.7 * v - 0.8 * u)
    fade = np.exp(-((np.hypot(u + 0.5, 0.85 * v) / 1.8) ** 6))
    crest = 0.5 + 0.5 * np.cos(phase)
    z = fade * (0.95 * crest**1.2 + 0.12 * crest * np.sin(3.7 * v + 2 * u))
    z += 0.02 * np.sin(7 * u + 3 * np.sin(2 * v)) + 0.012 * np.sin(11 * v)
    # A shear is one to one: the folds hang over without meeting themselves.
    points = np.stack([u + 0.8 * z, v + 0.2 * z, z], axis=-1)
    parts = merge(relief(points, -0.3), box((-8, -8, -1), (8, 8, -0.1)))
    views = [Perspective((3.0, -2.6, 2.8), (0.1, 0.1, 0.2), 36), Perspective((1.0, -2.9, 1.9), (0.1, 0, 0.2), 44)]
    return compose(parts, views, width, height, reflectance)


@scene(
    kind="procedural",
    radius=0.6,
    solid=True,
    views=("from the side, above", "close, into the gaps"),
)
def pile(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5, seed: int = 3) -> dict:
    """Heap of 110 spheres on a plane."""
    rng = generator(seed)
    n, n_tries = 110, 400
    radius = rng.uniform(0.16, 0.42, n)
    centre = np.zeros((n, 3))
    for i in range(n):
        # Drop the ball at many places and keep the one where it comes to rest lowest and nearest to the middle.
        places = rng.uniform(-1.7, 1.7, (n_tries, 2))
        apart = np.linalg.norm(places[:, None] - centre[:i, :2], axis=-1)
        gap = (radius[:i] + radius[i]) ** 2 - apart**2
        rest = np.where(gap > 0, centre[:i, 2] + np.sqrt(np.maximum(gap, 0)), 0).max(axis=1, initial=radius[i])
        best = np.argmin(rest + 0.7 * np.linalg.norm(places, axis=-1))
        centre[i] = (*places[best], rest[best])
    balls = copies(sphere(20, 12), centre, radius[:, None, None] * np.eye(3))
    views = [Perspective((3.2, -4.0, 3.4), (0, 0, 0.6), 33), Perspective((-2.2, -3.4, 1.6), (0, 0, 0.6), 46)]
    return compose(merge(balls, box((-12, -12, -1), (12, 12, 0))), views, width, height, reflectance)


@scene(
    kind="procedural",
    radius=0.6,
    solid=False,
    views=("the whole tree", "from below, into the crown"),
)
def foliage(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5, seed: int = 5) -> dict:
    """Tree: trunk and boughs with 2600 single-sided cards for leaves."""
    rng = generator(seed)
    n, boughs = 2600, 14
    t = np.linspace(0, 1, 12)
    trunk = tube(np.stack([0.1 * np.sin(2 * t), 0.08 * np.sin(5 * t), -0.2 + 2.3 * t], -1), 0.17 - 0.1 * t, 14)
    parts = [box((-10, -10, -1), (10, 10, 0)), trunk]
    tips = []
    for azimuth, low in zip(2.4 * np.arange(boughs), np.linspace(0.7, 1.9, boughs), strict=True):
        out = rng.uniform(0.7, 1.1) * (1.25 - 0.35 * low)
        heading = np.array([np.cos(azimuth), np.sin(azimuth), 0])
        path = np.outer(out * t, heading) + np.outer(low + 0.55 * t**1.5, (0, 0, 1))
        parts.append(tube(path, 0.055 - 0.04 * t, 8))
        tips.append(path[3:])
    anchors = np.concatenate(tips)
    centre = anchors[rng.integers(len(anchors), size=n)] + rng.normal(0, 0.17, (n, 3))
    turn = rotation(rng.normal(size=(n, 3)), rng.uniform(0, np.pi, n))
    card = Surface(
        np.array([(-0.5, -0.3, 0), (0.5, -0.3, 0), (0.5, 0.3, 0), (-0.5, 0.3, 0)]), np.array([(0, 1, 2), (0, 2, 3)])
    )
    parts.append(copies(card, centre, turn * rng.uniform(0.14, 0.26, (n, 1, 1))))
    views = [Perspective((2.6, -3.4, 2.2), (0, 0, 1.4), 37), Perspective((1.4, -2.3, 1.5), (0, 0, 1.5), 52)]
    return compose(merge(*parts), views, width, height, reflectance)


@scene(
    kind="procedural",
    radius=1.0,
    solid=True,
    views=("from the air", "down a valley"),
)
def terrain(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5, seed: int = 7) -> dict:
    """Fractal height field with ridges and steep valleys."""
    rng = generator(seed)
    n, half = 160, 4.0
    x, y = np.meshgrid(np.linspace(-half, half, n), np.linspace(-half, half, n), indexing="ij")
    z = np.zeros((n, n))
    for octave in range(5):
        frequency = 0.8 * 1.9**octave
        waves = np.zeros((n, n))
        for _ in range(5):
            heading, phase = rng.uniform(0, 2 * np.pi, 2)
            waves += np.sin(frequency * (x * np.cos(heading) + y * np.sin(heading)) + phase) / 1.6
        # Ridges where the waves cross zero; finer ones only on the heights, as where water carves rock.
        z += (1 - np.abs(waves)) * 0.5**octave * (1 if octave == 0 else 0.5 + 0.5 * np.tanh(2 * z))
    points = np.stack([x, y, 1.1 * z], axis=-1)
    views = [Perspective((3.5, -5.0, 5.5), (0, -0.2, 0.3), 46), Perspective((0.0, -3.9, 2.6), (0.2, -0.5, 0.3), 55)]
    return compose(relief(points, -6.0), views, width, height, reflectance)
