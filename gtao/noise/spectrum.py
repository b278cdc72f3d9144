"""Where in the plane of frequencies the noise lies: what a filter in the image takes away, and what it leaves."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from gtao.errors import ConfigError, ShapeError

from .sequences import values

__all__ = ["Spectrum", "spectrum"]


@dataclass(frozen=True, kw_only=True)
class Spectrum:
    """Power of a tile by frequency; uncorrelated noise has the power 1 everywhere.

    Attributes:
        power: (size, size), the frequency 0 in the middle, at [size // 2, size // 2], where the power is 0.
        frequency: (n,) cycles per pixel, the middles of rings of the width 1 / size.
        radial: (n,) mean power in each ring.
    """

    power: np.ndarray
    frequency: np.ndarray
    radial: np.ndarray


def spectrum(
    noise: Any, size: int = 64, frames: int = 1, *, seed: int = 0, channel: int = 0, harmonic: int | None = None
) -> Spectrum:
    """The mean periodogram of a pattern's tiles, over frames.

    Args:
        noise: name of a pattern of :class:`gtao.GTAO`, or an array of values (frames, size, size, 2) or (size, size).
        size, frames, seed: of :func:`gtao.noise.values` where a pattern is named.
        channel: 0 for the rotation, 1 for the offset.
        harmonic: None for the spectrum of the values v themselves; k for that of exp(2πi k v), which takes both ends of
            [0, 1) for the same, as slices do: it is that of the k-th Fourier term of whatever the values are put into,
            and does not change when all values are moved by the same number.

    Raises:
        ConfigError: there is no such pattern, a number is out of range, or all values are the same.
        ShapeError: the array is no square tile.
    """
    if channel not in (0, 1) or (harmonic is not None and harmonic < 1):
        raise ConfigError(f"channel must be 0 or 1 and harmonic None or at least 1, got {channel!r} and {harmonic!r}")
    tiles = values(noise, size, frames, seed) if isinstance(noise, str) else np.asarray(noise, dtype=np.float64)
    tiles = tiles[None] if tiles.ndim == 2 else tiles[..., channel]
    if tiles.ndim != 3 or tiles.shape[1] != tiles.shape[2]:
        raise ShapeError(f"noise must be (frames, size, size, 2) or (size, size), got {np.shape(noise)}")
    if harmonic is not None:
        tiles = np.exp(2j * np.pi * harmonic * tiles)
    deviation = tiles - tiles.mean(axis=(1, 2), keepdims=True)
    variance = np.mean(np.abs(deviation) ** 2)
    if not variance > 1e-12:
        raise ConfigError("all values are the same, which has no spectrum")
    n = tiles.shape[1]
    power = np.mean(np.abs(np.fft.fft2(deviation)) ** 2, axis=0) / (n * n * variance)
    axis = np.fft.fftfreq(n) * n
    ring = np.rint(np.hypot(*np.meshgrid(axis, axis))).astype(int)
    total, count = np.bincount(ring.ravel(), power.ravel()), np.bincount(ring.ravel())
    # Beyond half the sampling frequency rings are cut by the corners of the square, and thin.
    rings = np.arange(1, n // 2 + 1)
    return Spectrum(power=np.fft.fftshift(power), frequency=rings / n, radial=total[rings] / count[rings])
