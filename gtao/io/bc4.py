"""BC4: one channel of a texture in 4 bits a texel, encoded as well as the format allows."""

from typing import Any

import numpy as np

from gtao.errors import ShapeError

from .bc4_search import best_ends

__all__ = ["decode_bc4", "encode_bc4"]

_BITS = np.uint64(3) * np.arange(16, dtype=np.uint64)
#: Codes 2 … 7 of a block whose first byte is the greater, and 2 … 5 of the others: the share of the second byte.
_SEVENTHS = np.arange(1, 7) / 7
_FIFTHS = np.arange(1, 5) / 5


def _palettes(ends: np.ndarray) -> np.ndarray:
    """(N, 8) levels in [0, 1] that the codes of a block stand for."""
    first, second = (ends / 255.0).T[..., None]
    eight = np.concatenate([first, second, first + (second - first) * _SEVENTHS], axis=-1)
    fixed = np.broadcast_to((0.0, 1.0), (len(ends), 2))
    six = np.concatenate([first, second, first + (second - first) * _FIFTHS, fixed], axis=-1)
    return np.where(first > second, eight, six)


def _blocks_of(image: np.ndarray) -> np.ndarray:
    """(…, H, W) -> (…, H/4, W/4, 16), rows of a block one after the other."""
    *outer, height, width = image.shape
    tiles = image.reshape(*outer, height // 4, 4, width // 4, 4)
    return np.moveaxis(tiles, -3, -2).reshape(*outer, height // 4, width // 4, 16)


def _image_of(blocks: np.ndarray) -> np.ndarray:
    *outer, rows, columns, _ = blocks.shape
    tiles = np.moveaxis(blocks.reshape(*outer, rows, columns, 4, 4), -2, -3)
    return tiles.reshape(*outer, 4 * rows, 4 * columns)


def encode_bc4(image: Any) -> np.ndarray:
    """Blocks of BC4_UNORM with the least squared error that any two end points and any codes have.

    All 65536 pairs of end points are considered, those of six levels with 0 and 1 too; what cannot be the best is
    left out by a bound. The error is that of the numbers given, not of their 8-bit rounding.

    Args:
        image: (…, H, W) numbers in [0, 1]; H and W are multiples of 4.

    Returns:
        (…, H/4, W/4, 8) uint8: the bytes of each block, in the order of the file.

    Raises:
        ShapeError: a size is no multiple of 4, or a number is not in [0, 1].
    """
    image = np.asarray(image, dtype=np.float64)
    if image.ndim < 2 or image.size == 0 or image.shape[-1] % 4 or image.shape[-2] % 4:
        raise ShapeError(f"BC4 has blocks of 4x4 texels; make height and width multiples of 4, got {image.shape}")
    if not ((image >= 0) & (image <= 1)).all():
        raise ShapeError("BC4_UNORM holds numbers from 0 to 1, got others or NaN; scale or clamp them first")
    blocks = _blocks_of(image)
    texels = blocks.reshape(-1, 16)
    ends = best_ends(texels)
    codes = np.zeros(len(texels), np.uint64)
    palettes = _palettes(ends)
    for bit, column in zip(_BITS, texels.T, strict=True):
        codes |= np.abs(palettes - column[:, None]).argmin(axis=1).astype(np.uint64) << bit
    coded = codes.astype("<u8").view(np.uint8).reshape(-1, 8)[:, :6]
    return np.concatenate([ends, coded], axis=1).reshape(*blocks.shape[:-1], 8)


def decode_bc4(blocks: Any) -> np.ndarray:
    """Texels of BC4_UNORM as Direct3D defines them: bytes are divided by 255 and interpolated without rounding.

    Many decoders on the processor return bytes: they interpolate the end points as integers, and most drop the rest,
    so that they lie up to one 255th below this. Graphics hardware does not.

    Args:
        blocks: (…, H/4, W/4, 8) uint8.

    Returns:
        (…, H, W) float32 in [0, 1].

    Raises:
        ShapeError: the array has the wrong shape or type.
    """
    blocks = np.asarray(blocks)
    if blocks.ndim < 3 or blocks.shape[-1] != 8 or blocks.dtype != np.uint8:
        raise ShapeError(f"BC4 blocks must be (…, H/4, W/4, 8) bytes, got {blocks.shape} of {blocks.dtype}")
    flat = blocks.reshape(-1, 8)
    words = np.zeros((len(flat), 8), np.uint8)
    words[:, :6] = flat[:, 2:]
    codes = (words.view("<u8") >> _BITS & np.uint64(7)).astype(np.intp)
    texels = np.take_along_axis(_palettes(flat[:, :2]).astype(np.float32), codes, axis=1)
    return _image_of(texels.reshape(*blocks.shape[:-1], 16))
