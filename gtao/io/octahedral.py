"""The octahedral map: unit vectors on a square, and on a grid of integers there."""

import math

import numpy as np

__all__ = [
    "angle_bound",
    "levels",
    "octahedral_decode",
    "octahedral_encode",
    "octahedral_quantize",
    "octahedral_restore",
]


def octahedral_encode(directions: np.ndarray) -> np.ndarray:
    """(…, 2) points of the square [-1, 1]² of (…, 3) directions: theory, eq. (109).

    Directions need not be unit, but not zero. +z is the centre, -z all four corners.
    """
    d = np.asarray(directions, dtype=np.float64)
    p = d / np.abs(d).sum(axis=-1, keepdims=True)
    folded = (1 - np.abs(p[..., 1::-1])) * np.where(p[..., :2] >= 0, 1.0, -1.0)
    return np.where(p[..., 2:] >= 0, p[..., :2], folded)


def octahedral_decode(points: np.ndarray) -> np.ndarray:
    """(…, 3) unit vectors of (…, 2) points of the square [-1, 1]²."""
    p = np.asarray(points, dtype=np.float64)
    z = 1 - np.abs(p).sum(axis=-1)
    xy = p - np.maximum(-z, 0)[..., None] * np.where(p >= 0, 1.0, -1.0)
    d = np.concatenate([xy, z[..., None]], axis=-1)
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def levels(n_bits: int) -> int:
    """Steps from the centre of the square to its edge: integers run from 0 to twice that, one code stays unused.

    An odd number of codes puts the centre, the edges and the folds on the grid, so that the six axes are exact.
    """
    return 2 ** (n_bits - 1) - 1


def octahedral_quantize(directions: np.ndarray, n_bits: int) -> np.ndarray:
    """(…, 2) integers from 0 to ``2 levels(n_bits)``: of the four grid points around a direction the nearest in angle.

    Rounding each coordinate would do for the square; on the sphere its worst case is half as wrong again (theory, eq.
    (110)).
    """
    d = np.asarray(directions, dtype=np.float64)
    steps = levels(n_bits)
    low = np.clip(np.floor((octahedral_encode(d) + 1) * steps), 0, 2 * steps - 1)
    corners = [low + np.array([i, j]) for i in (0, 1) for j in (0, 1)]
    # The squared distance resolves angles that the cosine does not: 1 - cos of the 16-bit error is 1e-9.
    unit = d / np.linalg.norm(d, axis=-1, keepdims=True)
    distances = [((octahedral_restore(c, n_bits) - unit) ** 2).sum(axis=-1) for c in corners]
    nearest = np.argmin(distances, axis=0)
    return np.choose(nearest[..., None], corners).astype(np.uint32)


def octahedral_restore(integers: np.ndarray, n_bits: int) -> np.ndarray:
    """(…, 3) unit vectors of (…, 2) integers."""
    return octahedral_decode(np.asarray(integers, dtype=np.float64) / levels(n_bits) - 1)


def angle_bound(n_bits: int) -> float:
    """Largest angle in radians between a direction and its quantised one: theory, eq. (110)."""
    return math.sqrt(2) / levels(n_bits)
