"""PNG images of unsigned integers: 8 bits by Pillow, and 16 bits per channel, which Pillow cannot hold in colour."""

import os
import struct
import zlib
from pathlib import Path

import numpy as np
from PIL import Image, PngImagePlugin

from gtao.errors import ImageError

from .atomic import atomic_path
from .images import MAX_PIXELS

__all__ = ["read_png", "write_png"]

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_HEADER = struct.Struct(">IIBBBBB")
#: Channels -> colour type.
_COLOUR_TYPES = {3: 2, 4: 6}
#: Each byte minus that of the pixel to the left: the one filter that is written here, since it is undone by a sum.
_SUB = 1


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _write_16(path: Path, texels: np.ndarray, text: dict[str, str]) -> None:
    height, width, n_channels = texels.shape
    pixels = texels.astype(">u2").view(np.uint8).reshape(height, width, 2 * n_channels)
    rows = np.empty((height, 1 + pixels[0].size), np.uint8)
    rows[:, 0] = _SUB
    rows[:, 1:] = np.diff(pixels, axis=1, prepend=np.zeros_like(pixels[:, :1])).reshape(height, -1)
    header = _HEADER.pack(width, height, 16, _COLOUR_TYPES[n_channels], 0, 0, 0)
    notes = [_chunk(b"tEXt", key.encode("latin-1") + b"\0" + value.encode("latin-1")) for key, value in text.items()]
    body = [_chunk(b"IHDR", header), *notes, _chunk(b"IDAT", zlib.compress(rows.tobytes())), _chunk(b"IEND", b"")]
    path.write_bytes(_SIGNATURE + b"".join(body))


def write_png(path: str | os.PathLike, texels: np.ndarray, text: dict[str, str]) -> None:
    """Write integers as they are, whole or not at all: no colour space, no premultiplied alpha.

    Args:
        path: the file; its folder is made.
        texels: (H, W, 3) or (H, W, 4) array, uint8 or uint16.
        text: notes to store, of ASCII.

    Raises:
        ImageError: the file cannot be written.
    """
    with atomic_path(path) as partial:
        if texels.dtype == np.uint16:
            _write_16(partial, texels, text)
            return
        notes = PngImagePlugin.PngInfo()
        for key, value in text.items():
            notes.add_text(key, value)
        Image.fromarray(texels).save(partial, format="PNG", pnginfo=notes)


def _chunks(data: bytes) -> dict[bytes, list[bytes]]:
    """The content of all chunks by kind; ValueError when they are damaged."""
    found: dict[bytes, list[bytes]] = {}
    at = len(_SIGNATURE)
    while b"IEND" not in found:
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        content = data[at + 8 : at + 8 + length]
        if data[at + 8 + length : at + 12 + length] != struct.pack(">I", zlib.crc32(kind + content)):
            raise ValueError("a check sum is wrong")
        found.setdefault(kind, []).append(content)
        at += 12 + length
    return found


def _read_16(data: bytes) -> tuple[np.ndarray, dict[str, str]]:
    chunks = _chunks(data)
    width, height, _, colour_type, _, _, interlaced = _HEADER.unpack(chunks[b"IHDR"][0])
    n_channels = next((n for n, kind in _COLOUR_TYPES.items() if kind == colour_type), None)
    if n_channels is None or interlaced:
        raise ValueError("it is interlaced or has no colour")
    row = 1 + 2 * n_channels * width
    if width * height > MAX_PIXELS:
        raise ValueError(f"it has more than {MAX_PIXELS} pixels")
    unpacked = zlib.decompressobj().decompress(b"".join(chunks[b"IDAT"]), row * height)
    rows = np.frombuffer(unpacked, np.uint8).reshape(height, row)
    if (rows[:, 0] != _SUB).any():
        raise ValueError("another program has saved it; pack again")
    pixels = np.cumsum(rows[:, 1:].reshape(height, width, -1), axis=1, dtype=np.uint8)
    notes = (note.partition(b"\0") for note in chunks.get(b"tEXt", []))
    text = {key.decode("latin-1"): value.decode("latin-1") for key, _, value in notes}
    return np.ascontiguousarray(pixels).view(">u2").astype(np.uint16), text


def _read_8(path: Path) -> tuple[np.ndarray, dict[str, str]]:
    with Image.open(path, formats=["PNG"]) as image:
        if image.mode not in ("RGB", "RGBA"):
            raise ValueError("it is not RGB or RGBA")
        texels = np.asarray(image)
        return texels, {k: v for k, v in image.info.items() if isinstance(v, str)}


def read_png(path: str | os.PathLike) -> tuple[np.ndarray, dict[str, str]]:
    """(H, W, C) uint8 or uint16 texels, and the notes. Files of 16 bits have to be ours.

    Raises:
        ImageError: the file is missing, damaged, or no such image.
    """
    path = Path(path)
    try:
        data = path.read_bytes()
    except (OSError, ValueError) as cause:
        reason = getattr(cause, "strerror", None) or str(cause)
        raise ImageError(f"cannot read {path}: {reason.lower()}; check the path and its permissions") from None
    depth_at = len(_SIGNATURE) + 16
    if data[:8] != _SIGNATURE or len(data) <= depth_at:
        raise ImageError(f"cannot read {path}: it is not a PNG image; pack an estimate again")
    try:
        return _read_16(data) if data[depth_at] == 16 else _read_8(path)
    # Pillow reports damage through several exception types; so do zlib and struct.
    except Exception as cause:
        reason = (str(cause) or type(cause).__name__).splitlines()[0]
        raise ImageError(f"cannot read {path}: {reason}; pack the estimate again") from None
