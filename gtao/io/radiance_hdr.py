"""Radiance pictures (.hdr, .pic): four bytes per pixel with a common exponent, flat or run-length encoded.

Reference:
    G. Ward, "Real Pixels", Graphics Gems II, 1991; and the file format description of the Radiance software.
"""

import os
import re
from pathlib import Path

import numpy as np

from gtao.errors import ImageError

from .images import MAX_PIXELS

__all__ = ["MAGICS", "read_radiance_hdr"]

#: What a picture begins with.
MAGICS = (b"#?RADIANCE", b"#?RGBE")
#: Longest header that is looked through, in bytes.
MAX_HEADER = 2**16
#: Widths that the run-length encoding by components can hold.
SHORTEST_RUN_ROW, LONGEST_RUN_ROW = 8, 0x7FFF
#: A mantissa m with the exponent e stands for m · 2^(e - 136); e = 0 is black.
EXPONENT_BIAS = 136

_RESOLUTION = re.compile(rb"([+-])([XY]) +(\d+) +([+-])([XY]) +(\d+) *")


def read_radiance_hdr(path: str | os.PathLike) -> np.ndarray:
    """The picture as (H, W, 3) float32, linear RGB; row 0 at the top, column 0 at the left.

    All eight orders of rows and columns that the resolution line can state are turned into this one. Values are
    divided by the EXPOSURE and COLORCORR lines of the header, as the format asks, so that the radiance before these
    adjustments comes back; PRIMARIES, GAMMA and others are not looked at.

    Raises:
        ImageError: the file is missing, no Radiance picture, holds XYZ, is damaged, cut short, or too large.
    """
    path = Path(path)
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise ImageError(f"cannot read {path}: there is no such file; check the path") from None
    except (OSError, ValueError) as cause:
        reason = getattr(cause, "strerror", None) or str(cause)
        raise ImageError(f"cannot read {path}: {reason.lower()}; check the path and its permissions") from None
    if not data.startswith(MAGICS):
        raise ImageError(f"cannot read {path}: it is not a Radiance picture; export the image as HDR or EXR")
    scale, resolution, position = _header(path, data)
    major_sign, major, n_rows, minor_sign, minor, n_columns = resolution.groups()
    n_rows, n_columns = int(n_rows), int(n_columns)
    if major == minor or n_rows * n_columns == 0:
        raise ImageError(f"cannot read {path}: its resolution is {_text(resolution[0])}; export the image again")
    if n_rows * n_columns > MAX_PIXELS:
        raise ImageError(
            f"cannot read {path}: it is {n_columns}x{n_rows}, more than {MAX_PIXELS} pixels; the file is damaged, or"
            " make the image smaller"
        )
    rows = []
    for row in range(n_rows):
        pixels, position = _scanline(path, data, position, n_columns, f"row {row} of {n_rows}")
        rows.append(pixels)
    rgbe = np.stack(rows)
    image = rgbe[..., :3] * np.exp2(rgbe[..., 3:].astype(np.float64) - EXPONENT_BIAS) * (rgbe[..., 3:] > 0)
    image = image / scale
    # Rows of the file follow the axis that is named first; -Y runs from the top down, +X from the left to the right.
    signs = {major: major_sign, minor: minor_sign}
    if major == b"X":
        image = image.transpose(1, 0, 2)
    if signs[b"Y"] == b"+":
        image = image[::-1]
    if signs[b"X"] == b"-":
        image = image[:, ::-1]
    if not np.isfinite(image).all() or image.max() > np.finfo(np.float32).max:
        raise ImageError(f"cannot read {path}: values beyond single precision (EXPOSURE {scale}); export it again")
    return np.ascontiguousarray(image, dtype=np.float32)


def _text(data: bytes) -> str:
    return repr(data.decode("ascii", "replace").strip())


def _header(path: Path, data: bytes) -> tuple[np.ndarray, re.Match[bytes], int]:
    """What values are divided by, the resolution line, and where the pixels begin."""
    scale, position, blank = np.ones(3), 0, False
    while position < min(len(data), MAX_HEADER):
        end = data.find(b"\n", position)
        if end < 0:
            break
        line, position = data[position:end].rstrip(b"\r"), end + 1
        if blank:
            found = _RESOLUTION.fullmatch(line)
            if found is None:
                raise ImageError(
                    f"cannot read {path}: its resolution line is {_text(line[:40])}, not like '-Y 512 +X 1024';"
                    " export the image again"
                )
            return scale, found, position
        key, _, value = line.partition(b"=")
        if not line:
            blank = True
        elif key == b"FORMAT" and value.strip() != b"32-bit_rle_rgbe":
            raise ImageError(f"cannot read {path}: its FORMAT is {_text(value)}; convert it to 32-bit_rle_rgbe")
        elif key in (b"EXPOSURE", b"COLORCORR"):
            scale = scale * _factors(path, line, value)
    raise ImageError(f"cannot read {path}: its header is damaged or cut short; export the image again")


def _factors(path: Path, line: bytes, value: bytes) -> np.ndarray:
    try:
        factors = np.array([float(word) for word in value.split()])
    except ValueError:
        factors = np.zeros(0)
    if factors.size not in (1, 3) or not (np.isfinite(factors).all() and (factors > 0).all()):
        raise ImageError(f"cannot read {path}: its header says {_text(line)}; export the image again")
    return factors


def _cut_short(path: Path, where: str) -> ImageError:
    return ImageError(f"cannot read {path}: damaged or cut short ({where}); export the image again")


def _scanline(path: Path, data: bytes, position: int, width: int, where: str) -> tuple[np.ndarray, int]:
    """(width, 4) bytes of one scan line, and where the next begins."""
    start = data[position : position + 4]
    by_components = SHORTEST_RUN_ROW <= width <= LONGEST_RUN_ROW and start[:2] == b"\x02\x02" and start[2] < 128
    if not by_components:
        return _old_scanline(path, data, position, width, where)
    if len(start) < 4 or (start[2] << 8 | start[3]) != width:
        raise _cut_short(path, where)
    position, out = position + 4, bytearray()
    for component in range(1, 5):
        while len(out) < component * width:
            if position + 1 >= len(data):
                raise _cut_short(path, where)
            count = data[position]
            if count > 128:
                out += data[position + 1 : position + 2] * (count - 128)
                position += 2
            else:
                out += data[position + 1 : position + 1 + count]
                position += 1 + count
        if len(out) > component * width:
            raise _cut_short(path, where)
    return np.frombuffer(bytes(out), np.uint8).reshape(4, width).T, position


def _old_scanline(path: Path, data: bytes, position: int, width: int, where: str) -> tuple[np.ndarray, int]:
    """A scan line of whole pixels, in which (1, 1, 1, n) repeats the last one n times, or 256ᵏ n after k such."""
    flat = np.frombuffer(data[position : position + 4 * width], np.uint8)
    if flat.size == 4 * width and not (flat.reshape(-1, 4)[:, :3] == 1).all(axis=1).any():
        return flat.reshape(-1, 4), position + 4 * width
    out, shift = bytearray(), 0
    while len(out) < 4 * width:
        pixel = data[position : position + 4]
        position += 4
        if len(pixel) < 4:
            raise _cut_short(path, where)
        if pixel[:3] != b"\x01\x01\x01":
            out += pixel
            shift = 0
            continue
        count = pixel[3] << shift
        shift += 8
        if not out or shift > 24 or len(out) + 4 * count > 4 * width:
            raise _cut_short(path, where)
        out += out[-4:] * count
    return np.frombuffer(bytes(out), np.uint8).reshape(-1, 4), position
