"""The whole comparison under light: frames, light, measurements, files."""

import gc
import shlex
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gtao import io, plot
from gtao.errors import SceneError
from gtao.workflows.outputs import OutputDirectory, command_line
from gtao.workflows.standings import numbers_of
from gtao.workflows.views import portable, scenes_only

from .frames import LightingFrame, frames_of
from .lights import Light, lights, placed
from .measuring import ALL, CUTS, LIMITS, measure, view
from .methods import DENSE
from .settings import CompareLightingConfig
from .tables import csv_text, markdown_text, means, standings

__all__ = ["CompareLightingOutcome", "compare_lighting"]

Report = Callable[[str, int, int], None]

RMSE_IS = "root of the mean squared error over the mean irradiance, without noise"


@dataclass(frozen=True, eq=False)
class CompareLightingOutcome:
    """What a comparison under light found; everything in it is also in the output directory.

    Attributes:
        comparison: results, as the report takes them.
        record: what ``record.json`` holds.
    """

    comparison: plot.LightingComparison
    record: dict[str, Any]

    def summary(self) -> str:
        """A few lines for a terminal: the mean relative RMSE of every method, given dense slices."""
        averages = {cut: sources[DENSE] for cut, sources in self.comparison.means.items()}
        cuts = [*CUTS, ALL]
        n_lights = len(self.comparison.tables)
        names = sorted(averages[ALL], key=averages[ALL].__getitem__)
        width = max(map(len, names))
        lines = [
            f"RMSE / mean irradiance, {DENSE}, mean over {n_lights} kind{'s' * (n_lights != 1)} of light",
            f"  {'':{width}}  " + "  ".join(f"{cut:>9}" for cut in cuts),
        ]
        return "\n".join(
            lines + [f"  {n:{width}}  " + "  ".join(f"{averages[cut][n]:9.4f}" for cut in cuts) for n in names]
        )


class _Results:
    """Comparisons by light and cut, pictures and notes, as they come in."""

    def __init__(self, names: list[str], config: CompareLightingConfig, progress: Report | None):
        self.scenes: dict[str, dict[str, list[plot.SceneComparison]]] = {name: {} for name in names}
        self.views: list[plot.LightingView] = []
        self.notes: list[str] = []
        self.origins: list[dict[str, Any]] = []
        self.config, self.progress = config, progress

    def tasks(self, task: str) -> Callable[[int, int], None]:
        return lambda done, total: self.progress(task, done, total) if self.progress else None

    def add(self, frame: LightingFrame, given: list[Light]) -> None:
        index = len(self.origins)
        turn = index * self.config.turn
        self.origins.append(frame.view.source | {"radius": frame.view.radius, "up": frame.up, "turn": turn})
        progress = self.tasks(f"  {frame.view.name}: light")
        for i, light in enumerate(given):
            progress(i, len(given))
            environment = placed(light, frame.up, turn)
            measured = measure(frame, light, environment, self.config)
            if measured is None:
                pair = f"{frame.view.name} under {light.name}"
                self.notes.append(f"Left out, because hardly any light gets there: {pair}.")
                continue
            for cut, scene in measured[0].items():
                self.scenes[light.name].setdefault(cut, []).append(scene)
            # Pictures of all pairs would be too many for a page.
            if index == 0 or index % len(given) == i:
                self.views.append(view(frame, environment, light.name, measured[1]))
        progress(len(given), len(given))

    def comparison(self) -> plot.LightingComparison:
        tables = {
            light: {cut: plot.Comparison(scenes=scenes, rmse_is=RMSE_IS) for cut, scenes in cuts.items()}
            for light, cuts in self.scenes.items()
            if cuts
        }
        if not tables:
            raise SceneError("no light reaches any of the surfaces; turn it, name another axis as up, or take others")
        return plot.LightingComparison(tables=tables, means=means(tables, LIMITS), views=self.views, notes=self.notes)


def compare_lighting(
    config: CompareLightingConfig | None = None,
    output: Path | str = "compare-lighting",
    *,
    progress: Report | None = None,
) -> CompareLightingOutcome:
    """Compare methods of irradiance with ray-traced light and write tables, pictures, a record and a report.

    The light is seen directly, without bounces, through whatever stands within the radius. Methods are given ray-traced
    visibility, which isolates them, then dense slices, then few slices with a filter, as a game has them. The record is
    written last: a directory without ``record.json`` is not finished.

    Args:
        config: settings; ``CompareLightingConfig()`` if left out.
        output: directory, made if missing; files of an earlier run in it are replaced.
        progress: called as ``progress(task, done, total)``.

    Returns:
        The results and the record.

    Raises:
        SceneError: a scene cannot be loaded, is given twice, shows no surface or gets no light.
        ImageError: a map cannot be read, or the output cannot be written.
        ConfigError: a setting is out of range.
        RecordError: the record cannot be written.
    """
    config = CompareLightingConfig() if config is None else config
    given = scenes_only(config.scenes)
    light = lights(config.lights)
    directory = OutputDirectory(output)
    results = _Results([one.name for one in light], config, progress)
    steps = results.tasks("scenes")
    for i, (name, source) in enumerate(given.items()):
        steps(i, len(given))
        for frame in frames_of(name, source, config, results.tasks):
            results.add(frame, light)
            gc.collect()
    steps(len(given), len(given))
    comparison = results.comparison()
    files = {
        "scenes": portable(config.scenes),
        "environments": [io.portable(s) if one.source else s for s, one in zip(config.lights, light, strict=True)],
    }
    command = command_line(
        "compare-lighting",
        files["scenes"],
        directory.path,
        config,
        ("radius", "up", "turn", "resolution", "spp", "seed"),
        {"--environment": files["environments"], "--method": config.methods},
    )
    record = io.provenance(command, seed=config.seed, config=config.to_dict() | files)
    versions = {k: str(v) for k, v in record["versions"].items() if v is not None}
    comparison = replace(comparison, command=shlex.join(command), versions=versions)
    figures = plot.lighting_figures(comparison)
    texts = {
        "lighting.csv": csv_text(comparison.tables),
        "lighting.md": markdown_text(comparison.tables, comparison.means),
    }
    record |= {
        "kind": "comparison under light",
        "inputs": [*results.origins, *(one.source | {"light": one.name} for one in light if one.source)],
        "numbers": {
            "lights": {
                name: {cut: numbers_of(table) for cut, table in cuts.items()}
                for name, cuts in comparison.tables.items()
            },
            "standings": {
                name: {cut: standings(numbers_of(table), cut) for cut, table in cuts.items()}
                for name, cuts in comparison.tables.items()
            },
            "means": comparison.means,
            "notes": results.notes,
        },
    }

    def page(record: dict[str, Any]) -> str:
        shown = replace(comparison, record={**record, "numbers": "record.json"})
        return plot.lighting_report(shown, figures=figures)

    return CompareLightingOutcome(comparison, directory.publish(record, texts, figures, page))
