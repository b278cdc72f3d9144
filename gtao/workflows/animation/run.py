"""The whole animation: frames, measurements, videos, files; what has been done stays done."""

import hashlib
import math
import shlex
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gtao import io, plot
from gtao.workflows.outputs import OutputDirectory, command_line
from gtao.workflows.views import portable

from .making import Run
from .measuring import numbers_of
from .methods import Method, methods_of
from .settings import AnimateConfig
from .sources import source_of
from .state import Memory
from .tables import csv_text, markdown_text

__all__ = ["AnimateOutcome", "animate"]

Report = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class AnimateOutcome:
    """What an animation shows; everything in it is also in the output directory.

    Attributes:
        comparison: results, as the report takes them.
        record: what ``record.json`` holds.
    """

    comparison: plot.AnimationComparison
    record: dict[str, Any]

    def summary(self) -> str:
        """A few lines for a terminal: error and flicker of every method, and what the user should know."""
        methods = self.comparison.methods
        width = max(len(m.name) for m in methods)
        lines = [
            f"{self.comparison.name}, {self.comparison.n_frames} frames",
            f"  {'':{width}}     RMSE  flicker      lag",
        ]
        for m in methods:
            cells = (m.numbers[key] for key in ("rmse", "flicker", "lag"))
            lines.append(f"  {m.name:{width}}  " + "  ".join("      –" if v is None else f"{v:7.4f}" for v in cells))
        return "\n".join([*lines, *self.comparison.notes])


def animate(
    config: AnimateConfig | None = None,
    output: Path | str = "animate",
    *,
    cache: Path | str | None = None,
    progress: Report | None = None,
) -> AnimateOutcome:
    """Run methods over an animation; write frames, videos beside the truth, temporal metrics, a record and a report.

    Frames go to ``frames/`` and are never held together, so that memory does not grow with their number. After every
    frame the state of all methods is kept in ``unfinished/``: a run that was killed goes on after the last whole frame
    and ends with the same bytes, if it is started again with the same settings in the same directory; with others it
    starts anew. Traced truths are kept besides, for other methods on the same animation. The record is written last: a
    directory without ``record.json`` is not finished.

    Args:
        config: settings; ``AnimateConfig()`` if left out.
        output: directory, made if missing; files of an earlier run in it are replaced.
        cache: directory of traced truths; default ``$GTAO_CACHE_DIR``, else the user's cache directory.
        progress: called as ``progress(task, done, total)``.

    Returns:
        The results and the record.

    Raises:
        SceneError: there is no such animation or scene, it cannot be loaded, or shows no surface.
        ConfigError: a setting or a method is wrong, or there is no FFmpeg for the MP4 that was asked for.
        ImageError: a picture or a video cannot be written.
        RecordError: the record, the state or the cache cannot be written.
    """
    config = AnimateConfig() if config is None else config
    suffix, notes = _video_format(config)
    source = source_of(config)
    animation = source.animation
    radius = animation.radius if config.radius is None else config.radius
    methods = methods_of(config.methods, config.settings, radius)
    directory = OutputDirectory(output)
    folder = io.default_cache_directory() if cache is None else Path(cache)
    run = Run(config, source, radius, methods, directory, progress)
    done = run.frames(folder)
    memories = [done.memories[m.file] for m in methods]
    videos = [run.video(*pair, suffix) for pair in zip(methods, memories, strict=True)]
    shown = zip(methods, memories, videos, strict=True)
    comparison = plot.AnimationComparison(
        name=animation.name,
        description=animation.description,
        methods=[_result(*of_one, source.cut) for of_one in shown],
        n_frames=source.n_frames,
        fps=config.fps,
        radius=radius,
        cut=source.cut,
        error_limit=config.error_limit,
        notes=[*notes, *_other_reaches(methods, radius)],
    )
    command = _command(config, directory.path)
    record = io.provenance(command, seed=config.seed, config=config.to_dict() | _portable(config))
    versions = {k: str(v) for k, v in record["versions"].items() if v is not None}
    comparison = replace(comparison, command=shlex.join(command), versions=versions)
    figures = plot.animation_figures(comparison)
    texts = {"animation.csv": csv_text(comparison), "animation.md": markdown_text(comparison)}
    views = hashlib.sha256("\n".join(done.views).encode()).hexdigest()
    record |= {
        "kind": "animation",
        "inputs": [
            source.origin | {"views": views} if "sha256" in source.origin else source.origin | {"sha256": views}
        ],
        "methods": {m.name: m.pipeline.to_dict() for m in methods},
        "frames": run.digests(),
        "numbers": {m.name: _numbers(memory, source.cut) for m, memory in zip(methods, memories, strict=True)},
    }

    def page(record: dict[str, Any]) -> str:
        return plot.animation_report(replace(comparison, record={**record, "numbers": "record.json"}), figures=figures)

    record = directory.publish(record, texts, figures, page, present=videos)
    run.state.remove()
    return AnimateOutcome(comparison, record)


def _video_format(config: AnimateConfig) -> tuple[str, list[str]]:
    """The ending of the videos, and what is to be said about it."""
    fault = io.ffmpeg_fault() if config.video == "auto" else None
    suffix = ".gif" if fault is not None or config.video == "gif" else ".mp4"
    io.check_video(f"METHOD{suffix}", config.fps)
    return suffix, [] if fault is None else [f"Videos are GIFs: {fault}."]


def _other_reaches(methods: list[Method], radius: float) -> list[str]:
    """Which methods look for occluders elsewhere than the truth does."""
    reaches = {m.name: getattr(m.pipeline.occlusion, "radius", radius) for m in methods}
    return [
        f"{name} has a radius of {reach:g}, but the truth is that of {radius:g}: give --radius."
        for name, reach in reaches.items()
        if not math.isclose(reach, radius, rel_tol=1e-6)
    ]


def _result(method: Method, memory: Memory, video: str, cut: int | None) -> plot.AnimatedMethod:
    curves = {name: [math.nan if v is None else v for v in values] for name, values in memory.curves.items()}
    numbers = numbers_of(memory, cut)
    settings = io.pretty_json(method.pipeline.to_dict())
    return plot.AnimatedMethod(name=method.name, video=video, curves=curves, numbers=numbers, settings=settings)


def _numbers(memory: Memory, cut: int | None) -> dict[str, Any]:
    return {"whole": numbers_of(memory, cut), "curves": memory.curves, "scores": memory.scores.result()}


def _portable(config: AnimateConfig) -> dict[str, Any]:
    """The settings that name files, as a record may hold them."""
    methods = []
    for text in config.methods:
        name, *own = text.split(",")
        methods.append(",".join([io.portable(name) if name.endswith(".json") else name, *own]))
    return {
        "animation": portable([config.animation])[0],
        "methods": methods,
        "path": None if config.path is None else io.portable(config.path),
    }


def _command(config: AnimateConfig, output: Path) -> list[str]:
    files = _portable(config)
    repeated = {"--method": files["methods"], "--set": config.settings}
    plain = ("frames", "orbit", "up", "radius", "resolution", "spp", "fps", "video", "error_limit", "seed")
    words = command_line("animate", [files["animation"]], output, config, plain, repeated)
    words += ["--path", files["path"]] if files["path"] is not None else []
    return words + (["--exr"] if config.exr else [])
