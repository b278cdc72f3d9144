"""DDS: textures of two and three dimensions with one or two channels, as engines load them."""

import os
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gtao.errors import ConfigError, ImageError, ShapeError

from .atomic import atomic_path

__all__ = ["DDS_FORMATS", "DdsFormat", "read_dds", "write_dds"]

_MAGIC = b"DDS "
#: Magic, the 124 bytes of the header, and the 20 bytes that a format by number needs.
_HEADER = struct.Struct("<4s 7I 44x 8I 5I 5I")
_HEADER_SIZE, _PIXEL_FORMAT_SIZE = 124, 32
_CAPS, _HEIGHT, _WIDTH, _PITCH = 0x1, 0x2, 0x4, 0x8
_PIXEL_FORMAT, _MIPMAPS, _LINEAR_SIZE, _DEPTH = 0x1000, 0x20000, 0x80000, 0x800000
_FOUR_CC, _DX10 = 0x4, int.from_bytes(b"DX10", "little")
_TEXTURE, _COMPLEX, _VOLUME = 0x1000, 0x8, 0x200000
_TEXTURE_2D, _TEXTURE_3D = 3, 4
#: What Direct3D 11 and 12 allow, along a side of a plane and of a volume.
_LARGEST_2D, _LARGEST_3D = 16384, 2048


@dataclass(frozen=True)
class DdsFormat:
    """A format of texels.

    Attributes:
        name: as Direct3D calls it, without DXGI_FORMAT.
        number: of DXGI_FORMAT.
        n_channels: 1 or 2.
        dtype: of the numbers; of compressed formats the bytes of the blocks.
        block: texels along the side of what is stored together: 1, or 4 in the compressed formats.
    """

    name: str
    number: int
    n_channels: int
    dtype: str
    block: int = 1

    @property
    def n_stored(self) -> int:
        """Numbers of a texel, or bytes of a block."""
        return self.n_channels * (8 if self.block == 4 else 1)


#: Name -> format.
DDS_FORMATS: dict[str, DdsFormat] = {
    f.name: f
    for f in (
        DdsFormat("R8_UNORM", 61, 1, "<u1"),
        DdsFormat("R8G8_UNORM", 49, 2, "<u1"),
        DdsFormat("R16_UNORM", 56, 1, "<u2"),
        DdsFormat("R16G16_UNORM", 35, 2, "<u2"),
        DdsFormat("R16_FLOAT", 54, 1, "<f2"),
        DdsFormat("R16G16_FLOAT", 34, 2, "<f2"),
        DdsFormat("R32_FLOAT", 41, 1, "<f4"),
        DdsFormat("R32G32_FLOAT", 16, 2, "<f4"),
        DdsFormat("BC4_UNORM", 80, 1, "<u1", 4),
        DdsFormat("BC5_UNORM", 83, 2, "<u1", 4),
    )
}


def _format(name: str) -> DdsFormat:
    if name not in DDS_FORMATS:
        raise ConfigError(f"DDS format must be one of {', '.join(DDS_FORMATS)}, got {name!r}")
    return DDS_FORMATS[name]


def _header(f: DdsFormat, width: int, height: int, depth: int | None, row: int) -> bytes:
    flags = _CAPS | _HEIGHT | _WIDTH | _PIXEL_FORMAT | _MIPMAPS | (_LINEAR_SIZE if f.block == 4 else _PITCH)
    volume = depth is not None
    flags |= _DEPTH if volume else 0
    # Bytes of a row of texels; of blocks, those of a slice.
    pitch = row * (height // 4) if f.block == 4 else row
    sizes = (flags, height, width, pitch, depth or 0, 1)
    pixels = (_PIXEL_FORMAT_SIZE, _FOUR_CC, _DX10, 0, 0, 0, 0, 0)
    # Some readers take a volume only if it is called complex, which the format asks of those with mipmaps.
    caps = (_TEXTURE | _COMPLEX, _VOLUME, 0, 0, 0) if volume else (_TEXTURE, 0, 0, 0, 0)
    tail = (f.number, _TEXTURE_3D if volume else _TEXTURE_2D, 0, 1, 0)
    return _HEADER.pack(_MAGIC, _HEADER_SIZE, *sizes, *pixels, *caps, *tail)


def write_dds(path: str | os.PathLike, texels: Any, format: str) -> None:
    """Write a texture without mipmaps, header DX10, whole or not at all.

    Args:
        path: the file; its folder is made.
        texels: (H, W, C) or, of a volume, (D, H, W, C) numbers of the format's type; of the compressed formats
            (H/4, W/4, 8 C) or (D, H/4, W/4, 8 C) bytes of blocks, the channels of a block one after the other.
        format: a key of :data:`DDS_FORMATS`.

    Raises:
        ConfigError: there is no such format.
        ShapeError: the texels have another shape or type than the format asks for, or more of them than Direct3D
            allows: 16384 along a side of a plane, 2048 of a volume.
        ImageError: the file cannot be written.
    """
    f = _format(format)
    texels = np.asarray(texels)
    if texels.ndim not in (3, 4) or texels.size == 0 or texels.shape[-1] != f.n_stored:
        raise ShapeError(f"{format} needs (H, W, {f.n_stored}) or (D, H, W, {f.n_stored}), got {texels.shape}")
    if texels.dtype != np.dtype(f.dtype):
        raise ShapeError(f"{format} needs {np.dtype(f.dtype)}, got {texels.dtype}")
    depth = texels.shape[0] if texels.ndim == 4 else None
    height, width = (f.block * n for n in texels.shape[-3:-1])
    largest = _LARGEST_2D if depth is None else _LARGEST_3D
    if max(width, height, depth or 0) > largest:
        size = "x".join(map(str, (width, height) if depth is None else (width, height, depth)))
        raise ShapeError(f"Direct3D allows {largest} texels along a side, got {size}; make it smaller")
    stored = np.ascontiguousarray(texels, dtype=f.dtype)
    with atomic_path(path) as partial, partial.open("wb") as file:
        file.write(_header(f, width, height, depth, stored[..., 0, :, :].nbytes // max(1, depth or 1)))
        file.write(stored.tobytes())


def _checked(path: Path, data: bytes) -> tuple[DdsFormat, tuple[int, ...]]:
    """Format and (depth,) height and width; ValueError says what is wrong."""
    if data[:4] != _MAGIC:
        raise ValueError("it is not a DDS file")
    if len(data) < _HEADER.size:
        raise ValueError("it is cut short")
    (_, size, _, height, width, _, depth, mipmaps, pixel_size, flags, four_cc, *rest) = _HEADER.unpack_from(data)
    caps2 = rest[6]
    number, dimension, misc, n_textures, _ = rest[-5:]
    if size != _HEADER_SIZE or pixel_size != _PIXEL_FORMAT_SIZE:
        raise ValueError("its header is damaged")
    if not flags & _FOUR_CC or four_cc != _DX10:
        raise ValueError("its format is given in the old way, without a DX10 header; save it with one")
    found = next((f for f in DDS_FORMATS.values() if f.number == number), None)
    if found is None:
        raise ValueError(f"its format, DXGI_FORMAT {number}, is none of {', '.join(DDS_FORMATS)}")
    if mipmaps > 1 or n_textures != 1 or misc:
        raise ValueError("it has mipmaps or several textures; save one level of one texture")
    volume = dimension == _TEXTURE_3D
    if dimension not in (_TEXTURE_2D, _TEXTURE_3D) or volume != bool(caps2 & _VOLUME):
        raise ValueError("its header contradicts itself about the number of dimensions")
    shape = (depth, height, width) if volume else (height, width)
    if min(shape) < 1 or max(shape) > (_LARGEST_3D if volume else _LARGEST_2D) or height % found.block:
        raise ValueError(f"its size is impossible: {'x'.join(map(str, shape[::-1]))}")
    if width % found.block:
        raise ValueError(f"its width of {width} is no multiple of the block's")
    return found, shape


def read_dds(path: str | os.PathLike) -> tuple[np.ndarray, str]:
    """Texels, or blocks, and the format, as :func:`write_dds` takes them; files of others too.

    Raises:
        ImageError: the file is missing, cut short or no DDS file; its format is none of :data:`DDS_FORMATS`; it has
            mipmaps, or is an array or a cube.
    """
    path = Path(path)
    try:
        data = path.read_bytes()
    except (OSError, ValueError) as cause:
        reason = getattr(cause, "strerror", None) or str(cause)
        raise ImageError(f"cannot read {path}: {reason.lower()}; check the path and its permissions") from None
    try:
        f, (*depth, height, width) = _checked(path, data)
        shape = (*depth, height // f.block, width // f.block, f.n_stored)
        n_bytes = int(np.prod(shape)) * np.dtype(f.dtype).itemsize
        if len(data) - _HEADER.size != n_bytes:
            raise ValueError(
                f"it holds {len(data) - _HEADER.size} bytes of texels, not {n_bytes}; it is cut or altered"
            )
    except ValueError as cause:
        raise ImageError(f"cannot read {path}: {cause}") from None
    return np.frombuffer(data, f.dtype, offset=_HEADER.size).reshape(shape).copy(), f.name
