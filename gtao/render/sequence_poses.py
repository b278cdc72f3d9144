"""Rigid matrices to write camera paths and the ways of objects with."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from gtao.camera.pose import pose_of
from gtao.errors import ConfigError

from .scenes.surface import rotation

__all__ = ["inverse", "look_at", "matrix_of", "rigid"]

Point = Sequence[float]


def matrix_of(name: str, value: Any) -> np.ndarray:
    """The rigid 4x4 float64 matrix that ``value`` is, up to what its numbers were rounded by.

    Raises:
        ShapeError: it is none; see :func:`gtao.camera.pose.pose_of`.
    """
    result = np.array(pose_of(name, value))
    u, _, v = np.linalg.svd(result[:3, :3])
    result[:3, :3] = u @ v
    return result


def inverse(matrix: np.ndarray) -> np.ndarray:
    """Inverse of a rigid matrix."""
    result = np.eye(4)
    result[:3, :3] = matrix[:3, :3].T
    result[:3, 3] = -matrix[:3, :3].T @ matrix[:3, 3]
    return result


def _vector(name: str, value: Any) -> np.ndarray:
    try:
        result = np.asarray(value, float)
    except (TypeError, ValueError):
        result = np.array(np.nan)
    if result.shape != (3,) or not np.isfinite(result).all():
        raise ConfigError(f"{name} must be three finite numbers, got {value!r}")
    return result


def look_at(origin: Point, target: Point, up: Point = (0, 0, 1)) -> np.ndarray:
    """Pose of a camera in ``origin`` that looks at ``target``: 4x4 matrix from view frame to world, float64.

    ``up``, in world space like the two points, points upwards in the image.

    Raises:
        ConfigError: a value is not three finite numbers, the points coincide, or the camera looks along ``up``.
    """
    eye, above = _vector("origin", origin), _vector("up", up)
    back = eye - _vector("target", target)
    right = np.cross(above, back)
    if np.linalg.norm(right) <= 1e-9 * np.linalg.norm(above) * np.linalg.norm(back):
        raise ConfigError(f"no view from {origin} to {target} has {up} above; move a point or turn up")
    right, back = right / np.linalg.norm(right), back / np.linalg.norm(back)
    result = np.eye(4)
    result[:3] = np.stack([right, np.cross(back, right), back, eye], axis=1)
    return result


def rigid(offset: Point = (0, 0, 0), *, axis: Point = (0, 0, 1), angle: float = 0.0, about: Point = (0, 0, 0)):
    """Turn by ``angle`` radians about the line through ``about`` along ``axis``, then move by ``offset``.

    Returns:
        4x4 float64 matrix from world to world.

    Raises:
        ConfigError: a vector is not three finite numbers, the axis has no length, or the angle is not finite.
    """
    moved, along, pivot = _vector("offset", offset), _vector("axis", axis), _vector("about", about)
    if not along.any() or not np.isfinite(angle):
        raise ConfigError(f"a turn needs an axis with a length and a finite angle, got {axis} and {angle}")
    result = np.eye(4)
    result[:3, :3] = rotation(along, angle)
    result[:3, 3] = pivot - result[:3, :3] @ pivot + moved
    return result
