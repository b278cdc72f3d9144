"""The whole comparison of specular occlusion: frames, measurements, files."""

import gc
import shlex
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gtao import io, plot, render
from gtao.workflows.lighting.lights import lights
from gtao.workflows.outputs import OutputDirectory, command_line
from gtao.workflows.standings import numbers_of, ranked
from gtao.workflows.views import portable, scenes_only

from .composites import Probe, lit_view, measure_lit
from .cone_shaped import cone_shaped
from .frames import GlossyFrame, glossy_frames
from .measuring import Occlusions, measured, steps, tilt
from .methods import DENSE, TRACED
from .settings import NO_LIGHT, CompareSpecularConfig
from .tables import csv_text, dome_means, lit_csv, lit_means, markdown_text, step_means

__all__ = ["CompareSpecularOutcome", "compare_specular"]

Report = Callable[[str, int, int], None]

RMSE_IS = "root of the mean squared error of S, without noise"
LIT_RMSE_IS = "root of the mean squared error over the mean radiance, without noise"

#: Methods that curves and pictures show, if they take part.
SHOWN = ("cone-brdf", "brdf-4d", "brdf-3d", "cone-lobe", "cone-cone", "lagarde", "visibility", "unoccluded")
PICTURED = ("cone-brdf", "brdf-4d", "brdf-3d", "cone-cone", "lagarde", "visibility")


@dataclass(frozen=True, eq=False)
class CompareSpecularOutcome:
    """What a comparison found; everything in it is also in the output directory.

    Attributes:
        comparison: results, as the report takes them.
        record: what ``record.json`` holds.
    """

    comparison: plot.SpecularComparison
    record: dict[str, Any]

    def summary(self) -> str:
        """A few lines for a terminal: the mean RMSE of every method, given dense slices."""
        rows = self.comparison.means[DENSE]
        names = next(iter(rows.values()))
        width = max(map(len, names))
        lines = [
            f"RMSE of specular occlusion, {DENSE}, mean over the frames",
            f"  {'roughness':{width}}  " + "  ".join(f"{r:>6}" for r in rows),
        ]
        for name in sorted(names, key=lambda name: sum(row[name] for row in rows.values())):
            lines.append(f"  {name:{width}}  " + "  ".join(f"{row[name]:6.4f}" for row in rows.values()))
        return "\n".join(lines)


class _Results:
    """What is measured, as it comes in."""

    def __init__(self, config: CompareSpecularConfig, probes: list[Probe], progress: Report | None):
        self.config, self.probes, self.progress = config, probes, progress
        self.dome: dict[str, list[plot.SceneComparison]] = {f"{r:g}": [] for r in config.roughness}
        self.steps: dict[str, dict[str, dict[str, float]]] = {f"{r:g}": {} for r in config.roughness}
        self.lit: dict[str, dict[str, list[plot.SceneComparison]]] = {p.light.name: {} for p in probes}
        self.views: list[plot.SpecularView] = []
        self.lit_views: list[plot.LightingView] = []
        self.origins: list[dict[str, Any]] = []
        self.notes: list[str] = []

    def tasks(self, task: str) -> Callable[[int, int], None]:
        return lambda done, total: self.progress(task, done, total) if self.progress else None

    def add(self, frame: GlossyFrame, up: str) -> None:
        index, config = len(self.origins), self.config
        turn = index * config.turn
        known = {"radius": frame.view.radius, "up": up, "turn": turn, "tilt": tilt(frame)}
        self.origins.append(frame.view.source | known)
        found = Occlusions(frame, config.f0)
        for roughness in config.roughness:
            key = f"{roughness:g}"
            self.dome[key].append(measured(found, config.names, roughness))
            self.steps[key][frame.view.name] = steps(found, config.names, roughness)
        # Pictures of every roughness would be too many for a page.
        roughness = config.roughness[index % len(config.roughness)]
        self.views += [self._view(found, source, roughness) for source in (TRACED, DENSE)]
        self._light(found, up, turn)

    def _view(self, found: Occlusions, source: str, roughness: float) -> plot.SpecularView:
        names = [name for name in PICTURED if name in self.config.names] or self.config.names[: len(PICTURED)]
        return plot.SpecularView(
            frame=found.frame.view.name,
            source=source,
            roughness=roughness,
            truth=self.dome[f"{roughness:g}"][-1].truth,
            images={name: found.image(source, name, roughness)[0] for name in names},
            mask=found.frame.view.mask,
        )

    def _light(self, found: Occlusions, up: str, turn: float) -> None:
        config, index = self.config, len(self.origins) - 1
        pairs = [(probe, roughness) for probe in self.probes for roughness in config.lit_roughness]
        progress = self.tasks(f"  {found.frame.view.name}: light")
        for i, (probe, roughness) in enumerate(pairs):
            progress(i, len(pairs))
            name = probe.light.name
            result = measure_lit(found, *probe.placed(up, turn), roughness, config)
            if result is None:
                pair = f"{found.frame.view.name} under {name}"
                self.notes.append(f"Left out, because hardly any light gets there: {pair}.")
                continue
            self.lit[name].setdefault(f"{roughness:g}", []).append(result[0])
            if index == 0 or index % len(pairs) == i:
                self.lit_views.append(lit_view(found, result[1], name, roughness))
        progress(len(pairs), len(pairs))

    def comparison(self, cones: dict[str, dict[str, dict[str, float]]]) -> plot.SpecularComparison:
        tables = {r: plot.Comparison(scenes=scenes, rmse_is=RMSE_IS) for r, scenes in self.dome.items()}
        lit = {
            light: {r: plot.Comparison(scenes=scenes, rmse_is=LIT_RMSE_IS) for r, scenes in by_roughness.items()}
            for light, by_roughness in self.lit.items()
            if by_roughness
        }
        return plot.SpecularComparison(
            tables=tables,
            means=dome_means(tables),
            steps=step_means(self.steps),
            cones=cones,
            lit=lit,
            lit_means=lit_means(lit),
            views=self.views,
            lit_views=self.lit_views,
            shown=[name for name in SHOWN if name in self.config.names],
            notes=list(dict.fromkeys(self.notes)),
        )


def compare_specular(
    config: CompareSpecularConfig | None = None,
    output: Path | str = "compare-specular",
    *,
    progress: Report | None = None,
) -> CompareSpecularOutcome:
    """Compare methods of specular occlusion with traced reflections; write tables, pictures, a record and a report.

    Under a white dome, the occlusion itself at every roughness; under light from afar, the radiance of images that are
    put together from factors; and, without any scene, methods where visibility is the cone that they take it for.
    Methods are given ray-traced visibility, which isolates them, then dense slices, few slices with a filter, and the
    recommended pipeline. The record is written last: a directory without ``record.json`` is not finished.

    Args:
        config: settings; ``CompareSpecularConfig()`` if left out.
        output: directory, made if missing; files of an earlier run in it are replaced.
        progress: called as ``progress(task, done, total)``.

    Returns:
        The results and the record.

    Raises:
        SceneError: a scene cannot be loaded, is given twice or shows no surface.
        ImageError: a map cannot be read, or the output cannot be written.
        ConfigError: a setting is out of range.
        RecordError: the record cannot be written.
    """
    config = CompareSpecularConfig() if config is None else config
    given = scenes_only(config.scenes)
    light = lights(config.lights)
    directory = OutputDirectory(output)
    results = _Results(config, [Probe(one, config.lit_roughness) for one in light], progress)
    scenes = results.tasks("scenes")
    for i, (name, source) in enumerate(given.items()):
        scenes(i, len(given))
        up = config.up_of(name, "z" if source in render.scenes.names() else "y")
        for frame in glossy_frames(name, source, config, results.tasks):
            results.add(frame, up)
            gc.collect()
    scenes(len(given), len(given))
    comparison = results.comparison(cone_shaped(config.names, config.seed))
    maps = {one.name: one.source for one in light if one.source}
    files = {
        "scenes": portable(config.scenes),
        "environments": [io.portable(s) if one.source else s for s, one in zip(config.lights, light, strict=True)]
        or [NO_LIGHT],
    }
    repeated = {
        "--roughness": config.roughness,
        "--environment": files["environments"],
        "--lit-roughness": config.lit_roughness,
        "--method": config.methods,
    }
    plain = ("f0", "radius", "up", "turn", "resolution", "spp", "lit_spp", "seed")
    command = command_line("compare-specular", files["scenes"], directory.path, config, plain, repeated)
    record = io.provenance(command, seed=config.seed, config=config.to_dict() | files)
    versions = {k: str(v) for k, v in record["versions"].items() if v is not None}
    comparison = replace(comparison, command=shlex.join(command), versions=versions)
    figures = plot.specular_figures(comparison)
    texts = {"specular.csv": csv_text(comparison.tables), "specular.md": markdown_text(comparison.means)}
    texts |= {"lit.csv": lit_csv(comparison.lit)} if comparison.lit else {}
    record |= {
        "kind": "comparison of specular occlusion",
        "inputs": [*results.origins, *(entry | {"light": name} for name, entry in maps.items())],
        "numbers": _numbers(comparison, results),
    }

    def page(record: dict[str, Any]) -> str:
        shown = replace(comparison, record={**record, "numbers": "record.json"})
        return plot.specular_report(shown, figures=figures)

    return CompareSpecularOutcome(comparison, directory.publish(record, texts, figures, page))


def _numbers(comparison: plot.SpecularComparison, results: _Results) -> dict[str, Any]:
    dome = {r: numbers_of(table) for r, table in comparison.tables.items()}
    lit = {name: {r: numbers_of(table) for r, table in tables.items()} for name, tables in comparison.lit.items()}
    return {
        "dome": dome,
        "standings": {r: ranked(frames, {}) for r, frames in dome.items()},
        "means": comparison.means,
        "steps": results.steps,
        "step_means": comparison.steps,
        "cones": comparison.cones,
        "lit": lit,
        "lit_standings": {n: {r: ranked(frames, {}) for r, frames in tables.items()} for n, tables in lit.items()},
        "lit_means": comparison.lit_means,
        "notes": list(comparison.notes),
    }
