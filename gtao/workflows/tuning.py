"""Tuning from scenes to record: views, fit, comparison, files."""

import csv
import io as text_io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gtao import fit, io, plot, render
from gtao.config import named, with_budget
from gtao.errors import ConfigError, RecordError

from .outputs import OutputDirectory
from .tuning_settings import TuneConfig
from .tuning_views import collect_views
from .views import portable, sources

__all__ = ["TuneOutcome", "tune"]

Report = Callable[[str, int, int], None]

#: Where nothing is asked for: parts of the scenes, and draws of the bootstrap.
FOLDS, DRAWS = 4, 1000

#: Fewer scenes cannot tell how much scenes differ.
FEWEST_SCENES = 3


@dataclass(frozen=True, eq=False)
class TuneOutcome:
    """What a tuning found; everything in it is also in the output directory.

    Attributes:
        result: options, errors, candidates.
        rival: what the unseen errors are compared with: the rival at the same slices and steps.
        record: what ``record.json`` holds.
    """

    result: fit.TuningResult
    rival: str
    record: dict[str, Any]

    def summary(self) -> str:
        """A few lines for a terminal."""
        result = self.result
        change = f"RMSE {result.start_loss**0.5:.4f} -> {result.loss**0.5:.4f} on the scenes of the tuning"
        lines = [change if result.converged else f"{change}, not converged"]
        width = max(len(p.path) for p in result.parameters)
        for p in result.parameters:
            error = "" if p.standard_error is None else f" ± {p.standard_error:.3g}"
            bound = " (at its bound)" if p.at_bound else ""
            lines.append(f"  {p.path:{width}}  {p.start:.4g} -> {p.value:.4g}{error}{bound}")
        lines += [f"  {path:{width}}  {value}" for path, value in result.choice.items()]
        for held_out, name in ((False, "scenes left out in turn"), (True, "held-out scenes")):
            found = result.scores.summary(self.rival, held_out=held_out)
            if found:
                lines.append(
                    f"  {name}: RMSE {found['unseen']:.4f}, {self.rival} {found['rival']:.4f};"
                    f" better on {found['wins']} of {found['n_views']} views"
                )
        return "\n".join(lines)


def tune(
    config: TuneConfig | None = None,
    output: Path | str = "tune",
    *,
    cache: Path | str | None = None,
    progress: Report | None = None,
) -> TuneOutcome:
    """Fit the options of a method to ray-traced truth and write the method, tables, plots, a record and a report.

    Traced views are cached by what they depend on, so that another tuning on the same scenes traces nothing and an
    interrupted run goes on where it stopped. The record is written last: a directory without ``record.json`` is not
    finished.

    Args:
        config: settings; ``TuneConfig()`` if left out.
        output: directory, made if missing; files of an earlier run in it are replaced.
        cache: directory of cached views; default ``$GTAO_CACHE_DIR``, else the user's cache directory.
        progress: called as ``progress(task, done, total)``.

    Returns:
        The tuned method and the record.

    Raises:
        SceneError: a scene cannot be loaded, is given twice, or shows no surface.
        ImageError: an EXR file cannot be read or holds no truth, or the output cannot be written.
        ConfigError: a setting is out of range.
        FitError: an estimate is not finite.
        RecordError: the output or the cache cannot be written.
    """
    config = TuneConfig() if config is None else config
    given, held = _scenes(config)
    folds, n_bootstrap = _counts(config, len(given) - len(held))
    directory = OutputDirectory(output)
    folder = io.default_cache_directory() if cache is None else Path(cache)
    io.ensure_writable(folder / ".probe", error=RecordError)
    views = collect_views(given, config, folder, progress)
    start, choices = config.start(), config.choices()
    rivals = _rivals(config, choices)
    result = fit.tune(
        [view.problem for view in views],
        start,
        config.bounds(),
        search=choices,
        max_taps=config.max_taps,
        held_out=held,
        folds=folds,
        rivals=rivals,
        frames=range(config.n_frames),
        n_bootstrap=n_bootstrap,
        seed=config.seed,
        max_rounds=config.max_rounds,
        progress=progress,
    )
    rival = _rival_name(config.rival, result.method.occlusion.n_slices, result.method.occlusion.n_steps)
    record = io.provenance(["gtao", "tune"], seed=config.seed, config=_portable(config)) | {
        "kind": "tuning",
        "inputs": [view.source for view in views],
        "numbers": result.to_dict() | {"rival": rival, "unseen": _unseen(result, rival)},
    }
    figures = plot.tuning_figures(result, rival)
    texts = {"method.json": io.pretty_json(result.method.to_dict()), "tuning.csv": _table(result)}

    def page(record: dict[str, Any]) -> str:
        return plot.tuning_report(result, rival, record=record, figures=figures)

    return TuneOutcome(result, rival, directory.publish(record, texts, figures, page))


def _scenes(config: TuneConfig) -> tuple[dict[str, str], list[str]]:
    """Source of every scene by name, and the names of those that are held out."""
    if not config.held_out:
        return sources(config.scenes), []
    held = list(sources(config.held_out).values())
    given = sources(config.scenes or [name for name in render.scenes.names("procedural") if name not in held])
    both = sources([*given.values(), *held])
    return both, [name for name, source in both.items() if source in held]


def _counts(config: TuneConfig, n_scenes: int) -> tuple[int, int]:
    """Folds and bootstrap draws."""
    folds = config.folds
    if folds is None:
        folds = min(FOLDS, n_scenes) if n_scenes > 1 else 0
    elif folds != 0 and not 2 <= folds <= n_scenes:
        raise ConfigError(f"folds must be 0 (none) or from 2 to the number of scenes, {n_scenes}, got {folds}")
    draws = config.n_bootstrap
    if draws is None:
        draws = DRAWS if n_scenes >= FEWEST_SCENES else 0
    elif draws and n_scenes < FEWEST_SCENES:
        raise ConfigError(f"the bootstrap needs at least {FEWEST_SCENES} scenes, got {n_scenes}; leave it out")
    return folds, draws


def _rival_name(name: str, n_slices: int, n_steps: int) -> str:
    return f"{name} {n_slices}x{n_steps}"


def _rivals(config: TuneConfig, choices: dict[str, tuple[Any, ...]]) -> dict[str, Any]:
    """The rival at every number of slices and steps that may win."""
    occlusion = config.start().occlusion
    rival = named(config.rival, 1.0)
    return {
        _rival_name(config.rival, n_slices, n_steps): with_budget(rival, n_slices, n_steps)
        for n_slices in choices.get("n_slices", (occlusion.n_slices,))
        for n_steps in choices.get("n_steps", (occlusion.n_steps,))
    }


def _unseen(result: fit.TuningResult, rival: str) -> dict[str, Any]:
    return {
        group: {
            kind: result.scores.summary(rival, held_out=held_out, filtered=kind == "filtered")
            for kind in ("filtered", "unfiltered")
        }
        for group, held_out in (("left out in turn", False), ("held out", True))
    }


def _table(result: fit.TuningResult) -> str:
    """One row per view, one column per method."""
    out = text_io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    scores = result.scores
    tables = {"": scores.rmse} | ({} if scores.unfiltered is None else {" unfiltered": scores.unfiltered})
    columns = {f"{label}{suffix}": values for suffix, table in tables.items() for label, values in table.items()}
    writer.writerow(["view", "scene", "held out", *columns])
    for i, (view, scene) in enumerate(zip(scores.views, scores.scenes, strict=True)):
        numbers = ("" if values[i] != values[i] else f"{values[i]:.6g}" for values in columns.values())
        writer.writerow([view, scene, int(scores.held_out[i]), *numbers])
    return out.getvalue()


def _portable(config: TuneConfig) -> dict[str, Any]:
    """The settings as a record may hold them: files by names that mean something elsewhere."""
    return config.to_dict() | {"scenes": portable(config.scenes), "held_out": portable(config.held_out)}
