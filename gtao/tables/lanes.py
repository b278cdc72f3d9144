"""Between NumPy and the kernels: double precision, detached."""

from typing import Any

import drjit as dr
import numpy as np

from gtao import backend

__all__ = ["lanes", "numbers"]


def lanes(*arrays: Any) -> tuple[Any, ...]:
    """Flat float64 arrays of the backend in use, one per argument.

    Raises:
        BackendError: there is no usable backend.
    """
    Float = dr.float64_array_t(backend.default_float())
    return tuple(dr.opaque(Float(np.ascontiguousarray(a, np.float64).ravel())) for a in arrays)


def numbers(x: Any, *, like: np.ndarray) -> np.ndarray:
    """A lane, or a number, as a float64 NumPy array of the shape of another."""
    flat = np.asarray(x, np.float64) if isinstance(x, (int, float)) else x.numpy()
    return np.array(np.broadcast_to(flat, like.size)).reshape(like.shape)
