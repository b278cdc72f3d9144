"""The ways to store visibility and directions in few bits: what each number of a texel holds."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gtao.errors import ShapeError

from .directions import Directions
from .octahedral import angle_bound, octahedral_quantize, octahedral_restore

__all__ = ["PACKINGS", "Packing", "sh_scales"]

Texels = np.ndarray


@dataclass(frozen=True)
class Packing:
    """A way to store visibility and directions.

    Attributes:
        name: what :func:`pack` and the command line call it.
        channels: what each number of a texel holds; of half floats the channels of the file.
        dtype: type of the numbers: unsigned 8 or 16 bit, or half float.
        needs: the field of an estimate that it stores beside visibility.
        about: one line for people.
        angle_bound: the largest angle in radians between a direction and what comes back; None where that depends on
            the data, as it does for half floats.
        encode: function of an estimate; a (H, W, C) array of ``dtype``.
        decode: function of such an array and of the weighting.
    """

    name: str
    channels: tuple[str, ...]
    dtype: type[np.generic]
    needs: str
    about: str
    angle_bound: float | None
    encode: Callable[[Directions], Texels]
    decode: Callable[[Texels, str], Directions]

    @property
    def bits(self) -> int:
        """Size of a texel."""
        return 8 * np.dtype(self.dtype).itemsize * len(self.channels)


def _unit_range(values: np.ndarray, top: int) -> np.ndarray:
    """Integers from 0 to ``top`` for values in [0, 1], beyond which they are clamped; halves round up."""
    return np.floor(np.clip(np.asarray(values, dtype=np.float64), 0, 1) * top + 0.5)


def _texels(dtype: type[np.generic], *planes: np.ndarray) -> Texels:
    return np.stack(planes, axis=-1).astype(dtype)


def _encode_rgba8(d: Directions) -> Texels:
    b = np.asarray(d.bent_normal, dtype=np.float64)
    return _texels(np.uint8, *np.moveaxis(_unit_range(b * 0.5 + 0.5, 255), -1, 0), _unit_range(d.visibility, 255))


def _decode_rgba8(t: Texels, weighting: str) -> Directions:
    b = t[..., :3] / 255 * 2 - 1
    bent = b / np.linalg.norm(b, axis=-1, keepdims=True)
    return Directions(visibility=t[..., 3] / 255, bent_normal=bent, weighting=weighting)


def _encode_octahedral(dtype: type[np.generic], n_bits: int) -> Callable[[Directions], Texels]:
    def encode(d: Directions) -> Texels:
        x, y = np.moveaxis(octahedral_quantize(np.asarray(d.bent_normal), n_bits), -1, 0)
        return _texels(dtype, x, y, _unit_range(d.visibility, np.iinfo(dtype).max))

    return encode


def _decode_octahedral(dtype: type[np.generic], n_bits: int) -> Callable[[Texels, str], Directions]:
    def decode(t: Texels, weighting: str) -> Directions:
        bent = octahedral_restore(t[..., :2], n_bits)
        return Directions(visibility=t[..., 2] / np.iinfo(dtype).max, bent_normal=bent, weighting=weighting)

    return decode


def _encode_octahedral12(d: Directions) -> Texels:
    x, y = np.moveaxis(octahedral_quantize(np.asarray(d.bent_normal), 12), -1, 0)
    return _texels(np.uint8, x >> 4, ((x & 15) << 4) | (y >> 8), y & 255, _unit_range(d.visibility, 255))


def _decode_octahedral12(t: Texels, weighting: str) -> Directions:
    r, g, b, a = np.moveaxis(t.astype(np.uint32), -1, 0)
    grid = np.stack([(r << 4) | (g >> 4), ((g & 15) << 8) | b], axis=-1)
    return Directions(visibility=a / 255, bent_normal=octahedral_restore(grid, 12), weighting=weighting)


def _encode_moments8(d: Directions) -> Texels:
    """The mean direction by direction and by length relative to visibility, which is between 0 and 1.

    Relative to the visibility that is stored, whose rounding and clamping the length then makes up for.
    """
    mean, visibility = np.asarray(d.mean_direction, dtype=np.float64), _unit_range(d.visibility, 255)
    length = np.linalg.norm(mean, axis=-1)
    # Where nothing is visible, or on the background, any direction does: the length says that there is none.
    direction = np.where(length[..., None] > 0, mean, (0.0, 0.0, 1.0))
    x, y = np.moveaxis(octahedral_quantize(direction, 8), -1, 0)
    ratio = np.where(visibility > 0, 255 * length / np.maximum(visibility, 1), 0)
    return _texels(np.uint8, x, y, _unit_range(ratio, 255), visibility)


def _decode_moments8(t: Texels, weighting: str) -> Directions:
    bent, visibility = octahedral_restore(t[..., :2], 8), t[..., 3] / 255
    mean = bent * (t[..., 2] / 255 * visibility)[..., None]
    return Directions(visibility=visibility, bent_normal=bent, mean_direction=mean, weighting=weighting)


def _half(values: Any) -> Texels:
    values = np.asarray(values, dtype=np.float64)
    top = float(np.finfo(np.float16).max)
    if not (np.abs(values) <= top).all():
        raise ShapeError(f"half floats hold numbers up to {top:g}, got {np.abs(values).max():g}; is this an estimate?")
    return values.astype(np.float16)


def _from_moments(visibility: np.ndarray, mean: np.ndarray, weighting: str, **more: Any) -> Directions:
    length = np.linalg.norm(mean, axis=-1, keepdims=True)
    # No direction is left on the background; there an estimate looks back to the viewer.
    bent = np.where(length > 0, mean / np.where(length > 0, length, 1), [0.0, 0.0, 1.0])
    return Directions(visibility=visibility, bent_normal=bent, mean_direction=mean, weighting=weighting, **more)


def _encode_zh16(d: Directions) -> Texels:
    return np.concatenate([_half(d.mean_direction), _half(d.visibility)[..., None]], axis=-1)


def _decode_zh16(t: Texels, weighting: str) -> Directions:
    return _from_moments(t[..., 3].astype(np.float64), t[..., :3].astype(np.float64), weighting)


def _encode_sh16(d: Directions) -> Texels:
    return _half(d.visibility_sh)


def sh_scales(weighting: str) -> tuple[float, float]:
    """What turns the coefficient of band 0 into visibility, and those of band 1 into the mean direction."""
    measure = math.pi if weighting == "cosine" else 2 * math.pi
    return 2 * math.sqrt(math.pi) / measure, math.sqrt(4 * math.pi / 3) / measure


def _decode_sh16(t: Texels, weighting: str) -> Directions:
    sh = t.astype(np.float64)
    zeroth, first = sh_scales(weighting)
    return _from_moments(sh[..., 0] * zeroth, sh[..., [3, 1, 2]] * first, weighting, visibility_sh=sh)


PACKINGS: dict[str, Packing] = {
    p.name: p
    for p in (
        Packing(
            "rgba8",
            ("bent x", "bent y", "bent z", "visibility"),
            np.uint8,
            "bent_normal",
            "bent normal from [-1, 1] to [0, 1] in RGB, visibility in A, as XeGTAO",
            math.asin(math.sqrt(3) / 255),
            _encode_rgba8,
            _decode_rgba8,
        ),
        Packing(
            "octahedral8",
            ("octahedral x", "octahedral y", "visibility"),
            np.uint8,
            "bent_normal",
            "octahedral bent normal in RG, visibility in B",
            angle_bound(8),
            _encode_octahedral(np.uint8, 8),
            _decode_octahedral(np.uint8, 8),
        ),
        Packing(
            "octahedral12",
            ("octahedral x, high bits", "x, low bits, and y, high bits", "octahedral y, low bits", "visibility"),
            np.uint8,
            "bent_normal",
            "octahedral bent normal of 2 x 12 bits in RGB, visibility in A",
            angle_bound(12),
            _encode_octahedral12,
            _decode_octahedral12,
        ),
        Packing(
            "octahedral16",
            ("octahedral x", "octahedral y", "visibility"),
            np.uint16,
            "bent_normal",
            "octahedral bent normal in RG, visibility in B, of 16 bits each",
            angle_bound(16),
            _encode_octahedral(np.uint16, 16),
            _decode_octahedral(np.uint16, 16),
        ),
        Packing(
            "moments8",
            ("octahedral x", "octahedral y", "length of the mean direction / visibility", "visibility"),
            np.uint8,
            "mean_direction",
            "octahedral mean direction in RG, its length relative to visibility in B, visibility in A",
            angle_bound(8),
            _encode_moments8,
            _decode_moments8,
        ),
        Packing(
            "zh16",
            tuple("RGBA"),
            np.float16,
            "mean_direction",
            "mean direction in RGB, visibility in A, half floats",
            None,
            _encode_zh16,
            _decode_zh16,
        ),
        Packing(
            "sh16",
            tuple(f"visibility_sh.{i:02d}" for i in range(9)),
            np.float16,
            "visibility_sh",
            "nine coefficients of the visible hemisphere, half floats; all 0 on the background",
            None,
            _encode_sh16,
            _decode_sh16,
        ),
    )
}
