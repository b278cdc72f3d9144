"""What the functions of this room accept: directions, coefficients, matrices, orders; refused in words otherwise."""

import math
import numbers
from typing import Any

import numpy as np

from gtao.errors import ConfigError, ShapeError

__all__ = ["as_coefficients", "as_colour", "as_directions", "as_order", "as_orthogonal", "as_positive", "order_of"]

#: Matrices of single precision, written with six digits, are still rotations; those of double precision are left alone.
ORTHOGONAL_TOLERANCE = 1e-4
ORTHOGONAL_ROUNDING = 1e-14


def as_order(order: Any) -> int:
    """A band index, 0 or more."""
    if isinstance(order, bool) or not isinstance(order, numbers.Integral) or order < 0:
        raise ConfigError(f"order must be an integer of at least 0, the highest band, got {order!r}")
    return int(order)


def as_positive(name: str, value: Any) -> float:
    """A finite positive number."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real) or not (math.isfinite(value) and value > 0):
        raise ConfigError(f"{name} must be a finite positive number, got {value!r}")
    return float(value)


def as_colour(name: str, value: Any) -> np.ndarray:
    """Three finite non-negative numbers, from three or from one."""
    colour = np.asarray(value, dtype=np.float64)
    if colour.shape not in ((), (1,), (3,)) or not (np.isfinite(colour).all() and (colour >= 0).all()):
        raise ConfigError(f"{name} must be one or three finite numbers that are not negative, got {value!r}")
    return np.array(np.broadcast_to(colour, (3,)))


def as_directions(name: str, directions: Any) -> np.ndarray:
    """(…, 3) unit vectors, from vectors of any length but 0."""
    d = np.asarray(directions, dtype=np.float64)
    if d.ndim == 0 or d.shape[-1] != 3:
        raise ShapeError(f"{name} must be (…, 3), got shape {d.shape}")
    if not np.isfinite(d).all():
        raise ShapeError(f"{name} must be finite: {int((~np.isfinite(d)).any(-1).sum())} of them are not")
    largest = np.abs(d).max(axis=-1, keepdims=True)  # squares of tiny or huge vectors leave the range of floats
    if not (largest > 0).all():
        raise ShapeError(f"{name} must not be zero vectors: {int((largest == 0).sum())} of them are")
    d = d / largest
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def order_of(n: int) -> int:
    """The order of ``n`` = (order + 1)² coefficients.

    Raises:
        ShapeError: ``n`` is no square.
    """
    order = math.isqrt(max(n, 0)) - 1
    if n < 1 or (order + 1) ** 2 != n:
        raise ShapeError(f"spherical harmonics have (order + 1)² coefficients: 1, 4, 9, 16, 25, …; got {n}")
    return order


def as_coefficients(sh: Any) -> tuple[np.ndarray, int]:
    """(n,) or (n, C) finite coefficients in double precision, and their order."""
    c = np.asarray(sh, dtype=np.float64)
    if c.ndim not in (1, 2):
        raise ShapeError(f"coefficients must be (n,) or (n, C), got shape {c.shape}")
    order = order_of(c.shape[0])
    if not np.isfinite(c).all():
        raise ShapeError(f"coefficients must be finite: {int((~np.isfinite(c)).sum())} of {c.size} are not")
    return c, order


def as_orthogonal(name: str, matrix: Any) -> np.ndarray:
    """The orthogonal 3x3 matrix nearest to one that is orthogonal up to rounding; the upper left part of a 4x4."""
    m = np.asarray(matrix, dtype=np.float64)
    if m.shape not in ((3, 3), (4, 4)):
        raise ShapeError(f"{name} must be a 3x3 or 4x4 matrix, got shape {m.shape}")
    m = m[:3, :3]
    error = np.abs(m @ m.T - np.eye(3)).max() if np.isfinite(m).all() else math.inf
    if not error <= ORTHOGONAL_TOLERANCE:
        raise ConfigError(
            f"{name} must be a rotation or a reflection: M Mᵀ differs from the identity by {error:.3g}; remove its"
            " scale and shear"
        )
    if error <= ORTHOGONAL_ROUNDING:
        return m.copy()
    u, _, v = np.linalg.svd(m)
    return u @ v
