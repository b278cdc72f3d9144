"""PNG bytes for notebooks, with nothing but the standard library and Dr.Jit."""

import struct
import zlib
from typing import Any

import drjit as dr

__all__ = ["grey_png"]


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def grey_png(image: Any) -> bytes:
    """8-bit PNG of an (H, W) tensor in [0, 1]: values outside are clipped, NaN is black.

    Display encoding is the sRGB curve, so that 0.5 looks half open next to a rendered image.
    """
    height, width = image.shape
    v = image.array
    v = dr.select(v > 0, dr.select(v < 1, v, 1), 0)
    v = dr.select(v <= 0.0031308, 12.92 * v, 1.055 * dr.power(v, 1 / 2.4) - 0.055)
    grey = bytes(int(x) for x in dr.uint32_array_t(type(v))(dr.fma(v, 255, 0.5)))
    rows = b"".join(b"\0" + grey[i * width : (i + 1) * width] for i in range(height))
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", header) + _chunk(b"IDAT", zlib.compress(rows)) + _chunk(b"IEND", b"")
