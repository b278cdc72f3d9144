"""Pictures of frames: written once each, and put together for videos one after the other."""

import contextlib
import hashlib
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from gtao import io, plot
from gtao.errors import GtaoError
from gtao.io.png import read_png, write_png
from gtao.results import AmbientOcclusion

from .frames import Frame
from .methods import Method

__all__ = ["Pictures"]

#: Folder of the frames in the output.
FOLDER = "frames"
_TRUTH, _ERROR = "truth", "error"
_OURS = re.compile(r"[A-Za-z0-9.-]+(_error)?_\d{5,}\.(png|exr)")


class Pictures:
    """The frames in an output directory: ``frames/NAME_00000.png``.

    Args:
        output: the directory.
        limit: |error| at the bright end of the scale.
        exr: write EXR files too.
    """

    def __init__(self, output: Path, limit: float, *, exr: bool):
        self.folder, self.limit, self.exr = output / FOLDER, limit, exr

    def path(self, name: str, index: int, suffix: str = ".png") -> Path:
        return self.folder / f"{name}_{index:05d}{suffix}"

    def write_truth(self, frame: Frame) -> None:
        self._write(_TRUTH, frame, plot.visibility_pixels(frame.truth, frame.mask))
        if self.exr:
            extra = {"visibility.mean": frame.truth, "visibility.var": frame.variance}
            manifest = {"config": {"max_distance": frame.radius}}
            io.write_gbuffer(self.path(_TRUTH, frame.index, ".exr"), frame.g, extra=extra, manifest=manifest)

    def write_result(self, method: Method, frame: Frame, ao: AmbientOcclusion, image: np.ndarray) -> None:
        self._write(method.file, frame, plot.visibility_pixels(image, frame.mask))
        error = plot.error_pixels(image, frame.truth, frame.mask, self.limit)
        self._write(f"{method.file}_{_ERROR}", frame, error)
        if self.exr:
            found = io.directions_of(ao)
            told = {"config": method.pipeline.to_dict(), **io.direction_manifest(found)}
            extra = io.direction_channels(found)
            io.write_gbuffer(self.path(method.file, frame.index, ".exr"), frame.g, extra=extra, manifest=told)

    def _write(self, name: str, frame: Frame, pixels: np.ndarray) -> None:
        write_png(self.path(name, frame.index), pixels, {})

    def remove_others(self) -> None:
        """Remove the frames of an earlier run, and nothing else."""
        if self.folder.is_dir():
            for path in self.folder.iterdir():
                if _OURS.fullmatch(path.name):
                    path.unlink(missing_ok=True)

    def whole(self, methods: list[Method], n_frames: int) -> bool:
        """Whether the files of all frames up to ``n_frames`` are there, and the PNGs among them can be read."""
        with contextlib.suppress(GtaoError):
            for i in range(n_frames):
                for name in self.stems(methods):
                    read_png(self.path(name, i))
            exrs = [_TRUTH, *(m.file for m in methods)] if self.exr else []
            return all(self.path(name, i, ".exr").exists() for name in exrs for i in range(n_frames))
        return False

    def stems(self, methods: list[Method]) -> list[str]:
        """What the PNG files of a run are called, but for the number of the frame."""
        return [_TRUTH, *(m.file for m in methods), *(f"{m.file}_{_ERROR}" for m in methods)]

    def video_frames(self, method: Method, rmse: list[float], step: Callable[[int, int], Any]) -> Iterator[np.ndarray]:
        """Truth, result and error side by side, of one frame after the other.

        Raises:
            ImageError: a picture has been damaged since it was written.
        """
        for i, error in enumerate(rmse):
            step(i, len(rmse))
            panels = (read_png(self.path(name, i))[0] for name in (_TRUTH, method.file, f"{method.file}_{_ERROR}"))
            yield plot.video_frame(*panels, name=method.name, frame=i, rmse=error, limit=self.limit)
        step(len(rmse), len(rmse))

    def digest(self, name: str, n_frames: int) -> str:
        """SHA-256 of all PNG files of a name, one after the other."""
        hasher = hashlib.sha256()
        for i in range(n_frames):
            hasher.update(self.path(name, i).read_bytes())
        return hasher.hexdigest()
