"""The whole comparison: frames, measurements, files."""

import gc
import shlex
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gtao import io, plot
from gtao.workflows.outputs import OutputDirectory, command_line
from gtao.workflows.views import portable, sources

from .frames import Frame, frames
from .ladder import height_field
from .measuring import DEFAULTS, measure
from .settings import CompareConfig
from .tables import csv_text, markdown_text, scene_numbers

__all__ = ["CompareOutcome", "compare"]

Report = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class CompareOutcome:
    """What a comparison found; everything in it is also in the output directory.

    Attributes:
        comparison: results of all frames, as the report takes them.
        record: what ``record.json`` holds.
    """

    comparison: plot.Comparison
    record: dict[str, Any]

    def summary(self) -> str:
        """A few lines for a terminal: the mean RMSE of every method over the frames, at its own defaults."""
        scenes = self.comparison.scenes
        errors: dict[str, list[float]] = {}
        for scene in scenes:
            for m in scene.methods:
                if m.group == DEFAULTS:
                    errors.setdefault(m.label, []).append(float(m.metrics["rmse"] or 0))
        means = sorted((sum(values) / len(values), name) for name, values in errors.items())
        width = max(map(len, errors))
        lines = [f"mean RMSE against ray-traced truth, {len(scenes)} frame{'' if len(scenes) == 1 else 's'}"]
        return "\n".join([*lines, *(f"  {name:{width}}  {mean:.4f}" for mean, name in means)])


def compare(
    config: CompareConfig | None = None, output: Path | str = "compare", *, progress: Report | None = None
) -> CompareOutcome:
    """Compare methods with ray-traced truth and write tables, pictures, a record and a report.

    The record is written last: a directory without ``record.json`` is not finished.

    Args:
        config: settings; ``CompareConfig()`` if left out.
        output: directory, made if missing; files of an earlier run in it are replaced.
        progress: called as ``progress(task, done, total)``.

    Returns:
        The results and the record.

    Raises:
        SceneError: a scene cannot be loaded, is given twice, or shows no surface.
        ImageError: an EXR file cannot be read or holds no truth, or the output cannot be written.
        ConfigError: a setting is out of range.
        RecordError: the record cannot be written.
    """
    config = CompareConfig() if config is None else config
    given = sources(config.scenes)
    directory = OutputDirectory(output)
    scenes, origins = [], []
    for i, (name, source) in enumerate(given.items()):
        if progress:
            progress("scenes", i, len(given))
        for frame in frames(name, source, config, _step(progress, f"  {name}: truth")):
            scenes.append(_one_frame(frame, config, progress))
            origins.append(frame.source | {"frame": frame.name})
            gc.collect()
    if progress:
        progress("scenes", len(given), len(given))
    given_scenes = portable(config.scenes)
    plain = ("radius", "resolution", "spp", "seed")
    command = command_line("compare", given_scenes, directory.path, config, plain, {"--method": config.methods})
    record = io.provenance(command, seed=config.seed, config=config.to_dict() | {"scenes": given_scenes})
    comparison = plot.Comparison(
        scenes=scenes,
        command=shlex.join(command),
        versions={k: str(v) for k, v in record["versions"].items() if v is not None},
    )
    figures = plot.comparison_figures(comparison)
    record |= {
        "kind": "comparison",
        "inputs": origins,
        "numbers": {scene.name: scene_numbers(scene) for scene in scenes},
    }

    def page(record: dict[str, Any]) -> str:
        return plot.compare_report(replace(comparison, record=record), figures=figures)

    texts = {"comparison.csv": csv_text(scenes), "comparison.md": markdown_text(scenes)}
    return CompareOutcome(comparison, directory.publish(record, texts, figures, page))


def _one_frame(frame: Frame, config: CompareConfig, progress: Report | None) -> Any:
    step = _step(progress, f"  {frame.name}: methods")
    return measure(frame, height_field(frame, config), config, step)


def _step(progress: Report | None, task: str) -> Callable[[int, int], None]:
    return lambda done, total: progress(task, done, total) if progress else None
