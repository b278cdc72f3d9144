"""OpenEXR images as named two-dimensional arrays: any flat file in, float32 files with a manifest out."""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR

from gtao.errors import ConfigError, ImageError

from ._openexr import captured_notices, check_readable, open_exr, reason_of
from .atomic import atomic_path
from .jsontext import canonical_json

__all__ = ["MANIFEST", "MAX_PIXELS", "MAX_SAMPLES", "read_channels", "write_channels"]

#: Header attribute that holds our JSON manifest.
MANIFEST = "gtao"
#: Most pixels of one channel (16384 x 16384) and most values of all channels (8 GiB of floats) that are read;
#: a damaged header can ask for terabytes.
MAX_PIXELS = 2**28
MAX_SAMPLES = 2**31

Window = tuple[int, int, int, int]


def _window(header: Mapping[str, Any], name: str) -> Window:
    """``(x0, y0, width, height)`` of a window, whose corners are inclusive in the file."""
    low, high = header[name]
    x0, y0, x1, y1 = int(low[0]), int(low[1]), int(high[0]), int(high[1])
    return x0, y0, x1 - x0 + 1, y1 - y0 + 1


def _check_part(path: Path, header: Mapping[str, Any]) -> int:
    """Refuse what cannot be read as flat, full-resolution channels; the number of values otherwise."""
    if header.get("type") in (OpenEXR.deepscanline, OpenEXR.deeptile):
        raise ImageError(f"cannot read {path}: it holds deep data; flatten the image before")
    if not header["channels"]:
        raise ImageError(f"cannot read {path}: it holds no channels; export the image again")
    for channel in header["channels"]:
        if (channel.xSampling, channel.ySampling) != (1, 1):
            raise ImageError(
                f"cannot read {path}: channel {channel.name} is subsampled"
                f" ({channel.xSampling}x{channel.ySampling}); export all channels at full resolution"
            )
    n_pixels = 0
    for name in ("dataWindow", "displayWindow"):
        _, _, width, height = _window(header, name)
        if width < 1 or height < 1:
            raise ImageError(f"cannot read {path}: damaged header (empty {name}); export the image again")
        if width * height > MAX_PIXELS:
            raise ImageError(
                f"cannot read {path}: its {name} is {width}x{height}, more than {MAX_PIXELS} pixels;"
                " the file is damaged, or crop the image"
            )
        n_pixels = max(n_pixels, width * height)
    return n_pixels * len(header["channels"])


def _union(windows: list[Window]) -> Window:
    x0, y0 = min(w[0] for w in windows), min(w[1] for w in windows)
    x1, y1 = max(w[0] + w[2] for w in windows), max(w[1] + w[3] for w in windows)
    return x0, y0, x1 - x0, y1 - y0


def _place(pixels: np.ndarray, data: Window, frame: Window) -> np.ndarray:
    """The part of ``pixels`` (of window ``data``) inside ``frame``; zero where there is none."""
    if data == frame:
        return np.ascontiguousarray(pixels)
    out = np.zeros((frame[3], frame[2]), pixels.dtype)
    x0, y0 = max(data[0], frame[0]), max(data[1], frame[1])
    x1, y1 = min(data[0] + data[2], frame[0] + frame[2]), min(data[1] + data[3], frame[1] + frame[3])
    if x0 < x1 and y0 < y1:
        source = pixels[y0 - data[1] : y1 - data[1], x0 - data[0] : x1 - data[0]]
        out[y0 - frame[1] : y1 - frame[1], x0 - frame[0] : x1 - frame[0]] = source
    return out


def _manifest(path: Path, attributes: Mapping[str, Any]) -> dict[str, Any] | None:
    text = attributes.get(MANIFEST)
    if text is None:
        return None
    try:
        manifest = json.loads(text)
    except (TypeError, ValueError):
        manifest = None
    if not isinstance(manifest, dict):
        raise ImageError(f"cannot read {path}: its header attribute {MANIFEST!r} is not a JSON object; write it again")
    return manifest


def _full_name(part: str, channel: str, n_parts: int, taken: Mapping[str, Any]) -> str:
    if n_parts == 1 or not part or (channel.startswith(f"{part}.") and channel not in taken):
        return channel
    return f"{part}.{channel}"


def read_channels(path: str | os.PathLike, *, window: str = "display") -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Read every channel of an EXR image: scan lines or tiles (level 0), half, float or uint, any parts.

    In a file of several parts a channel is called ``part.channel``, unless its name begins so already.

    Args:
        path: the file.
        window: which pixels make the image. "display": the display window, which is what the camera saw; data
            outside it are cut away, and pixels without data are 0. "data": the window that holds data, with
            all overscan.

    Returns:
        ``(channels, metadata)``. Channels are (H, W) arrays of the stored type with the stored values, also
        NaN and infinities. Metadata: ``width``, ``height``; ``display_window`` and
        ``data_window`` as ``(x0, y0, width, height)``; ``attributes``, the strings and numbers of the first
        header; ``manifest``, the JSON object of the attribute ``gtao`` or None.

    Raises:
        ImageError: the file is missing, no EXR image, damaged or cut short, deep, subsampled, or too large;
            the windows do not overlap; its manifest is not JSON.
        ConfigError: ``window`` is unknown.
    """
    if window not in ("display", "data"):
        raise ConfigError(f"window must be 'display' or 'data', got {window!r}")
    path = Path(path)
    check_readable(path)
    headers = [part.header for part in open_exr(path, header_only=True).parts]
    if sum(_check_part(path, header) for header in headers) > MAX_SAMPLES:
        raise ImageError(f"cannot read {path}: more than {MAX_SAMPLES} values; export fewer channels or crop")
    display = _window(headers[0], "displayWindow")
    data = _union([_window(header, "dataWindow") for header in headers])
    frame = display if window == "display" else data
    if frame[2] * frame[3] > MAX_PIXELS:
        raise ImageError(f"cannot read {path}: its parts span {frame[2]}x{frame[3]} pixels; crop the image")
    apart = data[0] >= frame[0] + frame[2] or data[1] >= frame[1] + frame[3]
    if apart or data[0] + data[2] <= frame[0] or data[1] + data[3] <= frame[1]:
        raise ImageError(f"cannot read {path}: no data inside its display window; use window='data'")

    parts = open_exr(path, header_only=False).parts
    if len(parts) != len(headers):
        raise ImageError(f"cannot read {path}: {len(headers) - len(parts)} of its parts are damaged; export it again")
    channels: dict[str, np.ndarray] = {}
    for part, header in zip(parts, headers, strict=True):
        part_window = _window(header, "dataWindow")
        for name, channel in part.channels.items():
            full_name = _full_name(part.name(), name, len(parts), channels)
            channels[full_name] = _place(channel.pixels, part_window, frame)
    attributes = {k: v for k, v in headers[0].items() if isinstance(v, str | int | float)}
    return channels, {
        "width": frame[2],
        "height": frame[3],
        "display_window": display,
        "data_window": data,
        "attributes": attributes,
        "manifest": _manifest(path, attributes),
    }


def _as_plane(path: str | os.PathLike, name: str, values: Any, half: bool) -> np.ndarray:
    array = np.asarray(values.numpy() if hasattr(values, "numpy") else values)
    if array.ndim != 2 or array.size == 0 or array.dtype.kind not in "fiub":
        raise ImageError(
            f"cannot write {path}: channel {name!r} must be a non-empty (H, W) array of numbers,"
            f" got shape {array.shape} of {array.dtype}"
        )
    with np.errstate(over="ignore"):
        plane = np.ascontiguousarray(array, dtype=np.float32)
    if np.isnan(plane).any():
        n_nan = int(np.isnan(plane).sum())
        raise ImageError(f"cannot write {path}: channel {name!r} is NaN at {n_nan} pixels; repair them first")
    if array.dtype.kind in "iu" and not np.array_equal(plane.astype(array.dtype), array):
        raise ImageError(f"cannot write {path}: channel {name!r} holds integers that float32 cannot")
    if not half:
        return plane
    with np.errstate(over="ignore"):
        halves = plane.astype(np.float16)
    if (np.isinf(halves) & np.isfinite(plane)).any():
        raise ImageError(f"cannot write {path}: channel {name!r} exceeds 65504, the largest half float")
    return halves


def write_channels(
    path: str | os.PathLike,
    channels: Mapping[str, Any],
    manifest: Mapping[str, Any] | None = None,
    *,
    half: bool = False,
) -> None:
    """Write an EXR image: one part of scan lines, float32 or half, ZIP, whole or not at all.

    The same channels and manifest give the same bytes.

    Args:
        path: the file; its folder is made.
        channels: name -> (H, W) array of real numbers, all of one shape. Infinities are kept.
        manifest: what to store as JSON in the header attribute ``gtao``.
        half: round the numbers to half floats.

    Raises:
        ImageError: an array has the wrong shape or type, holds NaN or what half floats cannot hold, a name is empty
            or too long, or the file cannot be written.
        RecordError: the manifest holds what JSON cannot.
    """
    if not channels:
        raise ImageError(f"cannot write {path}: no channels were given")
    for name in channels:
        if not name or len(name.encode()) > 255 or "\0" in name:
            raise ImageError(f"cannot write {path}: channel name {name!r} must have 1 to 255 characters")
    planes = {name: _as_plane(path, name, values, half) for name, values in channels.items()}
    shapes = {plane.shape for plane in planes.values()}
    if len(shapes) > 1:
        raise ImageError(f"cannot write {path}: the channels have different shapes {sorted(shapes)}")
    header: dict[str, Any] = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    if manifest is not None:
        header[MANIFEST] = canonical_json(manifest)
    with atomic_path(path) as partial, captured_notices() as notices:
        try:
            OpenEXR.File(header, planes).write(str(partial))
        except RuntimeError as cause:
            reason = reason_of(notices() or str(cause), str(partial))
            raise ImageError(f"cannot write {path}: {reason}; choose another place") from None
