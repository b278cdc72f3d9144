"""Animations in which nothing moves but the camera, if that."""

import numpy as np

from gtao.errors import ConfigError
from gtao.render.scenes.buildings import GROUND
from gtao.render.scenes.compose import Perspective, compose
from gtao.render.scenes.machinery import machinery
from gtao.render.scenes.mesh import Reflectance
from gtao.render.scenes.surface import (
    Surface,
    box,
    copies,
    cylinder,
    generator,
    merge,
    move,
    revolve,
    rotation,
    sphere,
    torus,
)
from gtao.render.sequence_poses import look_at

from .registry import animation

__all__ = ["cut", "fast_rotation", "orbit", "still"]


@animation(radius=0.5, n_frames=48, static_camera=True, static_scene=True)
def still(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5) -> dict:
    """Still camera before still machine parts."""
    return {"scene": machinery(width, height, reflectance=reflectance)}


def _still_life() -> Surface:
    """A tiled floor with boxes, balls, a stack of rings and a bowl, to be seen from all sides."""
    rng = generator(5)
    n = 9
    grid = (np.arange(n) - (n - 1) / 2) * 0.62
    x, y = (a.ravel() for a in np.meshgrid(grid, grid, indexing="ij"))
    tiles = copies(
        box((-0.29, -0.29, -0.2), (0.29, 0.29, 0)),
        np.stack([x, y, rng.uniform(0, 0.07, n * n)], -1),
        np.broadcast_to(np.eye(3), (n * n, 3, 3)),
    )
    turn = [rotation((0, 0, 1), angle) for angle in (0.3, -0.5, 0.9)]
    bowl = [(0.2, 0.05), (0.46, 0.2), (0.6, 0.5), (0.54, 0.5), (0.4, 0.24), (0.14, 0.12)]
    return merge(
        box((-20, -20, -1), (20, 20, -0.06)),
        tiles,
        move(box((-0.35, -0.35, 0), (0.35, 0.35, 1.5)), (-0.55, 0.6, 0), turn[0]),
        move(box((-0.45, -0.3, 0), (0.45, 0.3, 0.5)), (0.75, 0.75, 0), turn[1]),
        move(box((-0.25, -0.25, 0), (0.25, 0.25, 0.4)), (0.7, 0.7, 0.5), turn[2]),
        *(move(torus(0.42 - 0.07 * i, 0.11), (-0.9, -0.75, 0.17 + 0.2 * i)) for i in range(4)),
        move(revolve(bowl, 48, closed=True), (0.45, -0.75, 0.03)),
        move(sphere(32, 16), (0.42, -0.8, 0.42), 0.26 * np.eye(3)),
        move(sphere(32, 16), (1.35, -0.2, 0.3), 0.25 * np.eye(3)),
        move(cylinder(0.13, -0.1, 1.1), (0.05, 0.05, 0)),
        move(cylinder(0.13, -0.1, 0.8), (-0.3, -0.15, 0)),
        move(cylinder(0.13, -0.1, 1.4), (0.05, 0.4, 0)),
    )


@animation(radius=0.5, n_frames=72, static_scene=True)
def orbit(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5) -> dict:
    """Camera in an orbit about boxes, balls and rings on a tiled floor, half a degree per frame."""
    target = (0.0, 0.0, 0.4)

    def camera(frame: int) -> np.ndarray:
        angle = -1.0 + np.radians(0.5) * frame
        return look_at((4.2 * np.cos(angle), 4.2 * np.sin(angle), 2.6), target)

    view = Perspective((4.2 * np.cos(-1.0), 4.2 * np.sin(-1.0), 2.6), target, 38)
    return {"scene": compose(_still_life(), [view], width, height, reflectance), "camera": camera}


def _court() -> Surface:
    """A court all around the origin: columns before a wall with niches, crates and drums between them."""
    rng = generator(8)
    n = 14
    phi = 2 * np.pi * (np.arange(n) + 0.5) / n
    turn = rotation(np.tile((0.0, 0, 1), (n, 1)), phi)

    def ring(part: Surface, radius: float, rows=slice(None), lift: float = 0.0) -> Surface:
        place = np.stack([radius * np.cos(phi), radius * np.sin(phi), np.full(n, lift)], -1)
        return copies(part, place[rows], turn[rows])

    shaft = [(0.34, -0.1), (0.34, 0.14), (0.25, 0.2), (0.2, 2.3), (0.3, 2.5), (0.3, 2.8)]
    wide = 2 * 4.9 * np.tan(np.pi / n)
    parts = [
        GROUND,
        ring(revolve(shaft, 20), 3.6),
        ring(box((0, -wide / 2 - 0.3, -0.2), (0.8, wide / 2 + 0.3, 3.6)), 4.7),
        ring(box((-0.25, -0.3, -0.2), (0.3, 0.3, 3.0)), 4.7, slice(0, None, 2)),
        ring(box((-0.2, -0.6, 1.0), (0.3, 0.6, 1.15)), 4.7, slice(1, None, 2)),
        ring(box((-0.2, -0.6, 1.7), (0.3, 0.6, 1.85)), 4.7, slice(1, None, 2)),
        ring(box((-0.5, -wide / 2 - 0.3, 2.7), (1.6, wide / 2 + 0.3, 3.0)), 3.6),
    ]
    for _ in range(34):
        angle, r, size = rng.uniform(0, 2 * np.pi), rng.uniform(2.5, 4.4), rng.uniform(0.16, 0.42)
        place = (r * np.cos(angle), r * np.sin(angle), 0.0)
        kind = rng.integers(3)
        if kind == 0:
            height = size * rng.uniform(0.8, 2.0)
            crate = box((-size, -size, -0.1), (size, size, height))
            parts.append(move(crate, place, rotation((0, 0, 1), rng.uniform(0, 3))))
        elif kind == 1:
            parts.append(move(cylinder(size, -0.1, 2.2 * size), place))
        else:
            parts.append(move(sphere(), (*place[:2], size), size * np.eye(3)))
    return merge(*parts)


@animation(radius=0.7, n_frames=60, static_scene=True)
def fast_rotation(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5) -> dict:
    """Camera that turns about itself in a court, 3 degrees per frame."""

    def camera(frame: int) -> np.ndarray:
        angle = np.radians(3) * frame
        return look_at((0.3, 0.2, 1.5), (0.3 + np.cos(angle), 0.2 + np.sin(angle), 1.38))

    view = Perspective((0.3, 0.2, 1.5), (1.3, 0.2, 1.38), 58)
    return {"scene": compose(_court(), [view], width, height, reflectance), "camera": camera}


@animation(radius=0.5, n_frames=48, static_scene=True, cut=24)
def cut(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5, n_frames: int = 48) -> dict:
    """Camera that stands still before machine parts, jumps to the other side at half time, and stands still again."""
    if isinstance(n_frames, bool) or not isinstance(n_frames, int) or n_frames < 2:
        raise ConfigError(f"a cut needs a frame before it and one after it: at least 2 frames, got {n_frames!r}")
    first = n_frames // 2
    poses = [look_at((2.5, -3.4, 2.8), (0.0, 0.0, 0.7)), look_at((-2.3, 2.6, 0.9), (0.1, 0.2, 0.65))]
    scene = machinery(width, height, reflectance=reflectance)
    return {"scene": scene, "camera": lambda frame: poses[frame >= first], "n_frames": n_frames, "cut": first}
