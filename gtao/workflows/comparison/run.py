"""The whole comparison: frames, measurements, files."""

import gc
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from gtao import io, plot, render
from gtao.errors import RecordError
from gtao.workflows.outputs import listed, save_figures

from .frames import Frame, frames, sources
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
    output = Path(output)
    started = datetime.now(UTC)
    given = sources(config.scenes)
    record_path = output / "record.json"
    io.ensure_writable(record_path, error=RecordError)
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
    portable = [s if s in render.scenes.names() else io.portable(s) for s in config.scenes]
    command = ["gtao", "compare", *portable]
    record = io.provenance(command, seed=config.seed, config=config.to_dict() | {"scenes": portable})
    comparison = plot.Comparison(
        scenes=scenes,
        command=" ".join(command),
        versions={k: str(v) for k, v in record["versions"].items() if v is not None},
    )
    figures = plot.comparison_figures(comparison)
    # From here on files change: without its record the directory counts as unfinished.
    earlier = listed(record_path)
    record_path.unlink(missing_ok=True)
    texts = {"comparison.csv": csv_text(scenes), "comparison.md": markdown_text(scenes)}
    for name, text in texts.items():
        io.write_text(output / name, text)
    names = [*texts, *save_figures(output, figures), "report.html"]
    for name in earlier - set(names):
        (output / name).unlink(missing_ok=True)
    record |= {
        "kind": "comparison",
        "started": started.isoformat(timespec="seconds"),
        "inputs": origins,
        "numbers": {scene.name: scene_numbers(scene) for scene in scenes},
    }
    page = plot.compare_report(replace(comparison, record=record), figures=figures)
    io.write_text(output / "report.html", page)
    record["outputs"] = [io.file_entry(output / name, output) for name in names]
    io.write_record(record_path, record, overwrite=True)
    return CompareOutcome(comparison, record)


def _one_frame(frame: Frame, config: CompareConfig, progress: Report | None) -> Any:
    step = _step(progress, f"  {frame.name}: methods")
    return measure(frame, height_field(frame, config), config, step)


def _step(progress: Report | None, task: str) -> Callable[[int, int], None]:
    return lambda done, total: progress(task, done, total) if progress else None
