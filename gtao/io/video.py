"""Moving pictures: H.264 in MP4 by FFmpeg, which every browser plays, and GIF without any further program.

Frames are taken one at a time and never held together, so that memory does not grow with their number.
"""

import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import ArrayLike
from PIL import GifImagePlugin, Image

from gtao.errors import ConfigError, ImageError, ShapeError

from .atomic import atomic_path

__all__ = ["VIDEO_FORMATS", "check_video", "ffmpeg_fault", "find_ffmpeg", "write_video"]

#: Endings of what can be written.
VIDEO_FORMATS = ("mp4", "gif")

#: Constant quality of H.264, from 0 (lossless) to 51: noise, which is what is to be seen, survives.
_QUALITY = 16
#: GIF counts time in hundredths of a second, and browsers slow down what is faster than two of them.
_GIF_TICKS, _GIF_FASTEST, _FASTEST = 100, 50, 240
#: Colours that are compared with a palette at once.
_AT_ONCE = 4096


def find_ffmpeg() -> str | None:
    """The FFmpeg program that :func:`write_video` runs: that of imageio-ffmpeg (``pip install "gtao[video]"``), whose
    variable ``IMAGEIO_FFMPEG_EXE`` may name another, else the one on the search path, else None.
    """
    try:
        import imageio_ffmpeg
    except ImportError:
        return shutil.which("ffmpeg")
    try:
        return imageio_ffmpeg.get_ffmpeg_exe()
    except RuntimeError:  # a package without its program
        return shutil.which("ffmpeg")


def ffmpeg_fault() -> str | None:
    """Why no MP4 can be written, found by writing a tiny one; None where nothing is wrong."""
    program = find_ffmpeg()
    if program is None:
        return "there is no FFmpeg: pip install 'gtao[video]'"
    with tempfile.TemporaryDirectory() as folder:
        try:
            _write_mp4(program, Path(folder) / "trial.mp4", iter([np.zeros((16, 16, 3), np.uint8)]), 24.0)
        except _FFmpegError as fault:
            return str(fault)
    return None


def check_video(name: str, fps: float) -> None:
    """Raise now, before hours of work, what :func:`write_video` would raise of a file's name and its pace.

    Raises:
        ConfigError: the ending is none of :data:`VIDEO_FORMATS`, ``fps`` is out of range, or MP4 lacks an FFmpeg that
            runs.
    """
    fault = ffmpeg_fault() if _checked_kind(name, fps) == "mp4" else None
    if fault is not None:
        raise ConfigError(f"cannot write {name}: {fault}; or write a .gif")


def _checked_kind(name: str, fps: float) -> str:
    kind = Path(name).suffix.lower().removeprefix(".")
    if kind not in VIDEO_FORMATS:
        raise ConfigError(f"video {name} must end in {' or '.join('.' + ending for ending in VIDEO_FORMATS)}")
    limit = _GIF_FASTEST if kind == "gif" else _FASTEST
    if not 0 < fps <= limit:
        raise ConfigError(f"fps must lie in (0, {limit}] in a .{kind}, got {fps}")
    return kind


def write_video(
    path: str | os.PathLike, frames: Iterable[np.ndarray], fps: float = 24.0, *, palette: ArrayLike | None = None
) -> int:
    """Write frames as ``.mp4`` or ``.gif``, whole or not at all; the same frames give the same bytes.

    MP4 is H.264 with 4:2:0 colour, as browsers want it, and needs :func:`find_ffmpeg`; an odd width or height is
    filled up by repeating the last column or row. GIF repeats for ever, has 256 colours and no dither, which would
    flicker.

    Args:
        path: the file; its ending chooses the format.
        frames: (H, W, 3) uint8 images of one size, sRGB; taken one by one.
        fps: frames per second, up to 240; in a GIF up to 50, where frames last multiples of 1/100 s, right on average.
        palette: (n, 3) colours, n <= 256, of a GIF; taken from its first frame if left out.

    Returns:
        The number of frames.

    Raises:
        ConfigError: the ending is another one, ``fps`` or ``palette`` is out of range, or there is no FFmpeg for MP4.
        ShapeError: there is no frame, or one of another shape or type.
        ImageError: the file cannot be written, or FFmpeg failed.
    """
    path = Path(path)
    if _checked_kind(path.name, fps) == "gif":
        colours = None if palette is None else _checked_palette(palette)
        return _write(path, frames, lambda partial, checked: _write_gif(partial, checked, fps, colours))
    program = find_ffmpeg()
    if program is None:
        raise ConfigError(f"cannot write {path.name}: {ffmpeg_fault()}; or write a .gif")
    try:
        return _write(path, frames, lambda partial, checked: _write_mp4(program, partial, checked, fps))
    except _FFmpegError as fault:
        raise ImageError(f"cannot write {path}: {fault}; or write a .gif") from None


class _FFmpegError(Exception):
    """FFmpeg did not run, or not to its end."""


def _write(path: Path, frames: Iterable[np.ndarray], encode: Callable[[Path, Iterator[np.ndarray]], None]) -> int:
    count = 0

    def counted() -> Iterator[np.ndarray]:
        nonlocal count
        for frame in _checked(frames):
            count += 1
            yield frame

    with atomic_path(path) as partial:
        encode(partial, counted())
        if count == 0:
            raise ShapeError(f"there is no frame for {path.name}; give at least one")
    return count


def _checked(frames: Iterable[np.ndarray]) -> Iterator[np.ndarray]:
    """The frames, of which each is looked at."""
    shape = None
    for i, given in enumerate(frames):
        frame = np.asarray(given)
        if frame.dtype != np.uint8 or frame.ndim != 3 or frame.shape[2] != 3 or 0 in frame.shape:
            raise ShapeError(f"frame {i} must be an (H, W, 3) array of uint8, got {frame.shape} of {frame.dtype}")
        if shape not in (None, frame.shape):
            raise ShapeError(f"frame {i} has shape {frame.shape}, those before it {shape}; they must be equal")
        shape = frame.shape
        yield frame


def _write_mp4(program: str, path: Path, frames: Iterator[np.ndarray], fps: float) -> None:
    first = next(frames, None)
    if first is None:
        return
    height, width = (n + n % 2 for n in first.shape[:2])
    given = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{fps:.6f}", "-i", "-"]
    # One thread and no traces of the program or the time, so that the same frames give the same file; the colours are
    # converted by the matrix that the file then names; the index comes first, so that a browser plays while it loads.
    coding = ["-c:v", "libx264", "-preset", "medium", "-crf", str(_QUALITY), "-threads", "1"]
    tags = "setparams=colorspace=bt709:color_primaries=bt709:color_trc=iec61966-2-1:range=tv"
    colours = ["-vf", f"scale=out_color_matrix=bt709:out_range=tv,format=yuv420p,{tags}"]
    plain = ["-map_metadata", "-1", "-fflags", "+bitexact", "-flags:v", "+bitexact", "-movflags", "+faststart"]
    command = [program, "-y", "-v", "error", *given, "-an", *coding, *colours, *plain, "-f", "mp4", str(path)]
    # Into a file, which cannot fill up as a pipe does.
    with tempfile.TemporaryFile() as errors:
        try:
            process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=errors)
        except OSError as cause:
            raise _FFmpegError(f"FFmpeg at {program} does not run: {cause.strerror}") from None
        with process:
            try:
                _feed(process.stdin, first, frames)
            except BaseException:
                process.kill()
                raise
        if process.returncode or not path.exists() or path.stat().st_size == 0:
            errors.seek(0)
            said = errors.read().decode(errors="replace").strip().splitlines()
            last = (said or ["nothing"])[-1].replace(str(path), "the file")
            raise _FFmpegError(f"FFmpeg at {program} ended with status {process.returncode} and says {last!r}")


def _feed(pipe: Any, first: np.ndarray, frames: Iterator[np.ndarray]) -> None:
    try:
        with pipe:
            pipe.write(_even(first).tobytes())
            for frame in frames:
                pipe.write(_even(frame).tobytes())
    except BrokenPipeError:  # it has ended, and its status will say why
        pass


def _even(frame: np.ndarray) -> np.ndarray:
    return np.pad(frame, ((0, frame.shape[0] % 2), (0, frame.shape[1] % 2), (0, 0)), mode="edge")


def _checked_palette(palette: ArrayLike) -> np.ndarray:
    colours = np.asarray(palette)
    if colours.ndim != 2 or colours.shape[1] != 3 or not 1 <= len(colours) <= 256 or colours.dtype != np.uint8:
        raise ConfigError(f"palette must hold 1 to 256 colours of three uint8, got {colours.shape} of {colours.dtype}")
    return colours


def _write_gif(path: Path, frames: Iterator[np.ndarray], fps: float, palette: np.ndarray | None) -> None:
    """One image block after the other; Pillow's own writer of animations would hold them all."""
    with path.open("wb") as file:
        shown = 0
        for i, frame in enumerate(frames):
            if palette is None:
                chosen = Image.fromarray(frame).quantize(256, method=Image.Quantize.MEDIANCUT)
                palette = np.array(chosen.getpalette("RGB"), np.uint8).reshape(-1, 3)
            if i == 0:
                _start_gif(file, frame.shape, palette)
            until = round((i + 1) * _GIF_TICKS / fps)
            # Graphic control extension: stays in place, no transparency.
            file.write(b"\x21\xf9\x04\x04" + (until - shown).to_bytes(2, "little") + b"\0\0")
            indexed = Image.frombytes("P", frame.shape[1::-1], _nearest(frame, palette).tobytes())
            for block in GifImagePlugin.getdata(indexed):
                file.write(block)
            shown = until
        file.write(b";")


def _nearest(frame: np.ndarray, palette: np.ndarray) -> np.ndarray:
    """(H, W) index of the nearest colour; Pillow's own search is off by up to three steps of 255."""
    codes = frame.astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], np.uint32)
    colours, place = np.unique(codes, return_inverse=True)
    channels = np.stack([colours >> 16, colours >> 8 & 255, colours & 255], axis=-1).astype(np.int32)
    found = np.empty(len(colours), np.uint8)
    for start in range(0, len(colours), _AT_ONCE):
        part = slice(start, start + _AT_ONCE)
        found[part] = np.argmin(((channels[part, None] - palette.astype(np.int32)) ** 2).sum(-1), axis=1)
    return found[place].reshape(frame.shape[:2])


def _start_gif(file: BinaryIO, shape: tuple[int, ...], palette: np.ndarray) -> None:
    sides = b"".join(n.to_bytes(2, "little") for n in shape[1::-1])
    # A global table of 256 colours, then the extension that repeats for ever.
    file.write(b"GIF89a" + sides + b"\xf7\0\0" + palette.tobytes().ljust(3 * 256, b"\0"))
    file.write(b"\x21\xff\x0bNETSCAPE2.0\x03\x01\0\0\0")
