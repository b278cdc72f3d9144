"""Where a camera stands: rigid maps from its view frame to the world, in plain double precision."""

import math
from collections.abc import Sequence
from typing import Any

from gtao.errors import ShapeError

__all__ = ["Pose", "pose_of", "previous_from_view"]

#: Rows of a 4x4 matrix.
Pose = tuple[tuple[float, ...], ...]

#: Renderers keep transforms in single precision: products of a few rotations stay within this of orthogonal.
ORTHOGONALITY = 1e-4


def pose_of(name: str, value: Any) -> Pose:
    """The rigid 4x4 matrix that ``value`` is: an array (NumPy, PyTorch …) or nested sequences of numbers.

    Raises:
        ShapeError: it has another shape, is not finite, scales, shears or mirrors.
    """
    if hasattr(value, "tolist"):
        value = value.tolist()
    try:
        rows = tuple(tuple(float(v) for v in row) for row in value)
    except (TypeError, ValueError):
        raise ShapeError(f"{name} must be a 4x4 matrix of numbers, got {type(value).__name__}") from None
    shape = (len(rows), *{len(row) for row in rows})
    if shape != (4, 4):
        raise ShapeError(f"{name} must be a 4x4 matrix, got {shape[0]} rows of {sorted(shape[1:])} numbers")
    if not all(math.isfinite(v) for row in rows for v in row):
        raise ShapeError(f"{name} holds numbers that are not finite")
    if rows[3] != (0, 0, 0, 1):
        raise ShapeError(f"{name} must be rigid, with the last row 0 0 0 1, got {rows[3]}; is it transposed?")
    x, y, z = ([row[i] for row in rows[:3]] for i in range(3))
    off = max(abs(_dot(a, b) - (a is b)) for a in (x, y, z) for b in (x, y, z))
    if off > ORTHOGONALITY:
        raise ShapeError(f"{name} must only turn and move, but scales or shears: its axes are {off:.1e} off")
    if _dot([x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]], z) < 0:
        raise ShapeError(f"{name} mirrors; the view frame is right-handed: +x right, +y up, the camera looks along -z")
    return rows


def previous_from_view(previous: Pose, now: Pose) -> Pose:
    """The map from the view frame of one pose to that of another; 3 rows of rotation and translation."""
    rotation = [[_dot(_column(previous, i), _column(now, j)) for j in range(3)] for i in range(3)]
    moved = [a - b for a, b in zip(_column(now, 3), _column(previous, 3), strict=True)]
    return tuple((*row, _dot(_column(previous, i), moved)) for i, row in enumerate(rotation))


def _column(pose: Pose, j: int) -> list[float]:
    return [row[j] for row in pose[:3]]


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))
