"""Frame after frame: every method takes a step, pictures are written, the state is kept."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from gtao import io, plot
from gtao.workflows.outputs import OutputDirectory

from .frames import Frame, frames
from .measuring import measure
from .methods import Method
from .pictures import Pictures
from .settings import AnimateConfig
from .sources import Source
from .state import Memory, Progress, Unfinished

__all__ = ["Run"]

Report = Callable[[str, int, int], None]


class Run:
    """The frames of an animation, from the first that is not there yet.

    Args:
        config: settings.
        source: the animation.
        radius: reach of occluders of the truth.
        methods: what to run.
        directory: of all output.
        progress: called as ``progress(task, done, total)``.
    """

    def __init__(
        self,
        config: AnimateConfig,
        source: Source,
        radius: float,
        methods: list[Method],
        directory: OutputDirectory,
        progress: Report | None,
    ):
        self.config, self.source, self.radius, self.methods, self.directory = config, source, radius, methods, directory
        self._progress = progress
        self.pictures = Pictures(directory.path, config.error_limit, exr=config.exr)
        pipelines = {m.file: m.pipeline.to_dict() for m in methods}
        # Files are named by the settings, but what they hold counts.
        inputs = {"origin": source.origin, "scene": source.animation.stage.digest()}
        settings = config.of_frames() | {"pipelines": pipelines, "radius": radius, "inputs": inputs}
        self.state = Unfinished(directory.path, settings)

    def tasks(self, task: str) -> Callable[[int, int], None]:
        return lambda done, total: self._progress(task, done, total) if self._progress else None

    def frames(self, cache: Path) -> Progress:
        """Make what is missing."""
        done = self.state.load([m.file for m in self.methods], lambda n: self.pictures.whole(self.methods, n))
        total, step = self.source.n_frames, self.tasks("frames")
        step(len(done.views), total)
        for frame in frames(self.source, self.config, self.radius, done.views, cache, self.tasks):
            results = [(m, *self._step(m, frame, done.memories[m.file])) for m in self.methods]
            if frame.index == 0:
                self._begin()
            self.pictures.write_truth(frame)
            for method, ao, image in results:
                self.pictures.write_result(method, frame, ao, image)
            done.views.append(frame.view)
            self.state.save(done)
            step(len(done.views), total)
            del frame, results
        return done

    def _begin(self) -> None:
        """The first frame is there: what an earlier run has left makes room for it, be it finished or not."""
        self.directory.begin()
        for name in self.state.methods():
            for suffix in io.VIDEO_FORMATS:
                (self.directory.path / f"{name}.{suffix}").unlink(missing_ok=True)
        self.state.remove()
        self.pictures.remove_others()

    def _step(self, method: Method, frame: Frame, memory: Memory) -> tuple[Any, np.ndarray]:
        baseline = None
        if method.forgetful is not None:
            baseline = method.forgetful.step(frame.g, frame_index=frame.index).visibility.numpy()
        ao = method.pipeline.step(frame.g, memory.history, frame_index=frame.index)
        image = ao.visibility.numpy()
        measure(memory, frame, image, baseline)
        return ao, image

    def video(self, method: Method, memory: Memory, suffix: str) -> str:
        """Write the video of a method; its file name."""
        name = method.file + suffix
        step = self.tasks(f"  {name}")
        shown = self.pictures.video_frames(method, memory.curves["rmse"], step)
        io.write_video(self.directory.path / name, shown, self.config.fps, palette=plot.ANIMATION_PALETTE)
        return name

    def digests(self) -> dict[str, Any]:
        """What says whether two runs have the same frames."""
        n = self.source.n_frames
        return {
            name: {"frames": n, "sha256": self.pictures.digest(name, n)} for name in self.pictures.stems(self.methods)
        }
