"""Surfaces that touch face to face, and how to keep them apart.

Where the bottom of a box lies on the ground, a ray meets two faces at the same distance, and a tracer reports one of
them. Surfaces with coplanar faces on top of each other therefore get different colours, and a ray is traced through
one colour at a time.
"""

import numpy as np

from .surfaces import Faces, Surfaces, cells

__all__ = ["colours"]

#: Cell size of directions, and of plane distances relative to the size of the scene; two faces of one plane differ by
#: float32 rounding, a thousandth of it.
PLANE_CELL = 2.0**-12
#: Boxes are widened by this share of the size of the scene.
MARGIN = 2.0**-18


def colours(faces: Faces, surfaces: Surfaces) -> np.ndarray:
    """(S,) colour of each surface: 0, or the smallest that no surface in face-to-face contact with it has."""
    a, b = _contacts(faces, surfaces.of_face)
    colour = np.zeros(len(surfaces.closed), int)
    if not len(a):
        return colour
    neighbours: dict[int, set[int]] = {}
    for i, j in zip(a.tolist(), b.tolist(), strict=True):
        neighbours.setdefault(i, set()).add(j)
        neighbours.setdefault(j, set()).add(i)
    # The one with most contacts first: it is the ground that all others stand on.
    for i in sorted(neighbours, key=lambda i: (-len(neighbours[i]), i)):
        colour[i] = -1
    for i in sorted(neighbours, key=lambda i: (-len(neighbours[i]), i)):
        taken = {int(colour[j]) for j in neighbours[i]}
        colour[i] = next(c for c in range(len(taken) + 1) if c not in taken)
    return colour


def _contacts(faces: Faces, of_face: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of surfaces with faces in one plane whose bounding boxes overlap there."""
    flat = np.flatnonzero((faces.normal != 0).any(1))
    low, high, surface = faces.low[flat], faces.high[flat], of_face[flat]
    if not len(flat):
        return flat, flat
    centre, size = (low.min(0) + high.max(0)) / 2, np.ptp(np.stack([low.min(0), high.max(0)]), axis=0).max()
    normal = faces.normal[flat]
    # One sign for both sides of a plane: that of the largest component.
    largest = np.abs(normal).argmax(1)
    normal = normal * np.sign(np.take_along_axis(normal, largest[:, None], 1))
    distance = ((faces.point[flat] - centre) * normal).sum(1) / size
    plane = cells(np.round(np.column_stack([normal, distance]) / PLANE_CELL))

    # One box for each surface in each plane.
    order = np.lexsort((surface, plane))
    plane, surface = plane[order], surface[order]
    start = np.flatnonzero(np.r_[True, (np.diff(plane) != 0) | (np.diff(surface) != 0)])
    margin = MARGIN * size
    low = np.minimum.reduceat(low[order], start) - margin
    high = np.maximum.reduceat(high[order], start) + margin
    plane, surface = plane[start], surface[start]
    shared = np.bincount(plane)[plane] > 1
    plane, surface, low, high = plane[shared], surface[shared], low[shared], high[shared]
    return _overlaps(plane, surface, low, high)


def _overlaps(
    plane: np.ndarray, surface: np.ndarray, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Sweep along x, all planes side by side."""
    order = np.lexsort((low[:, 0], plane))
    plane, surface, low, high = plane[order], surface[order], low[order], high[order]
    n = len(plane)
    stride = 2 * np.ptp(np.concatenate([low[:, 0], high[:, 0]])) if n else 0.0
    last = np.searchsorted(low[:, 0] + stride * plane, high[:, 0] + stride * plane, side="right")
    count = last - np.arange(n) - 1
    i = np.repeat(np.arange(n), count)
    j = np.arange(len(i)) - np.repeat(np.cumsum(count) - count, count) + i + 1
    touch = ((low[i] <= high[j]) & (low[j] <= high[i])).all(1)
    return surface[i[touch]], surface[j[touch]]
