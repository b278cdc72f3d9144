"""The numbers of the noise patterns, from the kernels themselves."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from gtao import backend
from gtao.errors import ConfigError
from gtao.estimators.noise_inputs import noise_inputs
from gtao.kernels import noise

__all__ = ["sequence_values", "values"]


def sequence_values(pattern: str, x: Any, y: Any, frame: Any, seed: int = 0) -> np.ndarray:
    """Rotation and offset of a pattern at pixels and frames.

    Args:
        pattern: a name of :class:`gtao.GTAO`'s ``noise``.
        x, y: columns and rows of pixels, non-negative integers that broadcast against each other.
        frame: a frame's number, or an array of them, non-negative.
        seed: of the patterns that have one, 0 to 2³² - 1.

    Returns:
        Numbers in [0, 1), float64, of the shape of the frames, then of the pixels, then 2: the rotation as a fraction
        of the angle between slices, the offset as one of a step.

    Raises:
        ConfigError: there is no such pattern, or a number is no integer or out of range.
    """
    if pattern not in noise.PATTERNS:
        raise ConfigError(f"pattern must be one of {', '.join(noise.PATTERNS)}, got {pattern!r}")
    x, y = np.broadcast_arrays(_naturals("x", x), _naturals("y", y))
    frames, (seed,) = _naturals("frame", frame), _naturals("seed", [seed])
    types = backend.types_of(backend.default_float())
    lanes = [types.UInt(np.ascontiguousarray(axis.ravel(), dtype=np.uint32)) for axis in (x, y)]
    result = np.empty((frames.size, x.size, 2))
    for row, number in zip(result, frames.ravel(), strict=True):
        terms = noise.frame_terms(pattern, int(number), int(seed))
        inputs = noise_inputs(pattern, terms, types.UInt)
        s = SimpleNamespace(frame_rotation=terms.frame_rotation, frame_offset=terms.frame_offset, **inputs)
        row[:] = np.stack([np.array(v) for v in noise.pattern(pattern, *lanes, s, types.Float)], axis=-1)
    return result.reshape(*frames.shape, *x.shape, 2)


def values(pattern: str, size: int = 64, frames: int = 1, seed: int = 0) -> np.ndarray:
    """A tile of a pattern over its first frames: (frames, size, size, 2), otherwise as :func:`sequence_values`.

    Raises:
        ConfigError: there is no such pattern, or a number is no integer or out of range.
    """
    y, x = np.mgrid[:size, :size]
    return sequence_values(pattern, x, y, np.arange(frames), seed)


def _naturals(name: str, numbers: Any) -> np.ndarray:
    found = np.asarray(numbers)
    if found.size == 0 or found.dtype.kind not in "iu" or found.min() < 0 or found.max() >= 2**32:
        raise ConfigError(f"{name} must be integers from 0 to 2**32 - 1, at least one, got {numbers!r}")
    return found
