"""The fit of the reflection cone's aperture, from scenes to record."""

import csv
import gc
import io as text_io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gtao import fit, io, plot
from gtao.config import ConeBRDF, ConeCone
from gtao.estimators import specular_occlusion
from gtao.workflows.outputs import OutputDirectory, command_line
from gtao.workflows.views import portable, scenes_only

from .aperture_settings import SOURCES, FitApertureConfig
from .frames import GlossyFrame, glossy_frames

__all__ = ["FitApertureOutcome", "fit_aperture"]

Report = Callable[[str, int, int], None]

#: Apertures that others found by fitting cones to lobes, not to images.
RIVALS = ("drobot", "uludag")


@dataclass(frozen=True, eq=False)
class FitApertureOutcome:
    """What a fit found; everything in it is also in the output directory.

    Attributes:
        result: the fit.
        record: what ``record.json`` holds.
    """

    result: fit.ApertureFit
    record: dict[str, Any]

    def summary(self) -> str:
        """A few lines for a terminal."""
        found, name = self.result, self.result.metric.upper()
        interval = "" if found.interval is None else " in [{:.3g}, {:.3g}]".format(*found.interval)
        interval += " (at the end of the search)" if found.best.at_bound else ""
        lines = [
            f"u = {found.best.u:.4g}{interval}, cos α_s = 2^(-{found.exponent:.5g} α²)",
            f"mean {name}: {found.best.score:.5f}, with the published u = 0.01 {found.best.published:.5f}",
        ]
        return "\n".join([*lines, *(f"  {rival}: {score:.5f}" for rival, score in found.rivals.items())])


def fit_aperture(
    config: FitApertureConfig | None = None, output: Path | str = "fit-aperture", *, progress: Report | None = None
) -> FitApertureOutcome:
    """Fit u of cos α_s = u^(α²/2) to ray-traced specular occlusion; write a table, plots, a record and a report.

    Jimenez et al. 2016 chose u = 0.01 by the dissimilarity of images; so does this. The record is written last: a
    directory without ``record.json`` is not finished.

    Args:
        config: settings; ``FitApertureConfig()`` if left out.
        output: directory, made if missing; files of an earlier run in it are replaced.
        progress: called as ``progress(task, done, total)``.

    Returns:
        The fit and the record.

    Raises:
        SceneError: a scene cannot be loaded, is given twice, or shows no surface.
        ConfigError: a setting is out of range.
        ShapeError: a view is too small for the metric.
        ImageError, RecordError: the output cannot be written.
    """
    config = FitApertureConfig() if config is None else config
    given = scenes_only(config.scenes)
    directory = OutputDirectory(output)

    def tasks(task: str) -> Callable[[int, int], None]:
        return lambda done, total: progress(task, done, total) if progress else None

    samples: list[fit.ApertureSample] = []
    origins = []
    for i, (name, source) in enumerate(given.items()):
        tasks("scenes")(i, len(given))
        for frame in glossy_frames(name, source, config, tasks):
            samples += _samples(name, frame, config)
            origins.append(frame.view.source | {"radius": frame.view.radius})
            gc.collect()
    tasks("scenes")(len(given), len(given))
    result = fit.aperture(
        samples, metric=config.metric, n_bootstrap=config.n_bootstrap, seed=config.seed, progress=tasks("fit")
    )
    files = portable(config.scenes)
    names = ("f0", "reference", "source", "weighting", "aperture", "metric", "radius", "resolution", "spp", "seed")
    repeated = {"--roughness": config.roughness, "--bootstrap": (config.n_bootstrap,)}
    command = command_line("fit-aperture", files, directory.path, config, names, repeated)
    record = io.provenance(command, seed=config.seed, config=config.to_dict() | {"scenes": files})
    record |= {"kind": "aperture fit", "inputs": origins, "numbers": result.to_dict()}
    figures = plot.aperture_figures(result)

    def page(record: dict[str, Any]) -> str:
        return plot.aperture_report(result, record={**record, "numbers": "record.json"}, figures=figures)

    return FitApertureOutcome(result, directory.publish(record, {"aperture.csv": _csv(result)}, figures, page))


def _samples(scene: str, frame: GlossyFrame, config: FitApertureConfig) -> list[fit.ApertureSample]:
    """One for each roughness."""
    estimates = [one[config.weighting] for one in frame.given[SOURCES[config.source]]]
    aperture: Any = config.aperture

    def image(roughness: float, method: Any) -> np.ndarray:
        runs = [specular_occlusion(ao, frame.view.g, roughness, config.f0, method).numpy() for ao in estimates]
        return np.mean(runs, axis=0, dtype=np.float64)

    def by_u(roughness: float) -> Callable[[float], np.ndarray]:
        return lambda u: image(roughness, ConeCone(aperture=aperture, u=u))

    def truth(roughness: float) -> np.ndarray:
        if config.reference == "cone":
            return image(roughness, ConeBRDF(aperture=aperture))
        return np.mean(frame.truths[roughness], axis=0)

    return [
        fit.ApertureSample(
            scene=scene,
            view=frame.view.name,
            roughness=roughness,
            truth=truth(roughness),
            mask=frame.view.mask,
            occlusion=by_u(roughness),
            rivals={name: image(roughness, ConeCone(aperture=aperture, reflection=name)) for name in RIVALS},
        )
        for roughness in frame.truths
    ]


def _csv(result: fit.ApertureFit) -> str:
    """One row per view and roughness, one column per u."""
    out = text_io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["scene", "view", "roughness", *(f"u = {u:.4g}" for u in result.grid)])
    for (scene, view, roughness), curve in zip(result.samples, result.curves, strict=True):
        writer.writerow([scene, view, f"{roughness:g}", *(f"{score:.6g}" for score in curve)])
    return out.getvalue()
