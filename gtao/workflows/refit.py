"""The main job: scenes -> transport images -> fit -> record, coefficients, shader code, plots, report."""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from gtao import fit, io, plot, render
from gtao.data.multibounce import JIMENEZ2016, MultibounceFit

from .outputs import OutputDirectory
from .settings import RefitConfig
from .transports import SceneData, collect
from .views import portable, scene_names

__all__ = ["RefitOutcome", "refit"]

Report = Callable[[str, int, int], None]

#: Every run tabulates these numbers of bounces, whatever its headline.
TABULATED = (4.0, math.inf)
#: Suffix of the file of each shading language.
LANGUAGES = {"hlsl": "hlsl", "glsl": "glsl", "wgsl": "wgsl", "c": "h"}
SHOWN_SHADER = "hlsl"


@dataclass(frozen=True, eq=False)
class RefitOutcome:
    """What a refit found; everything in it is also in the output directory.

    Attributes:
        fit: the headline fit, as written to ``coefficients.json``.
        result: the fit with residuals, covariance and settings.
        tables: forms compared, by number of bounces.
        record: what ``record.json`` holds.
    """

    fit: MultibounceFit
    result: Any
    tables: dict[float, Any]
    record: dict[str, Any]

    def summary(self) -> str:
        """A few lines for a terminal."""
        table = self.tables[self.fit.bounces]
        published = table[fit.PUBLISHED]
        n = len(self.result.scenes)
        lines = [f"{self.fit.form}, {_bounces(self.fit.bounces)}, {n} scene{'' if n == 1 else 's'}"]
        for i, (name, value) in enumerate(zip(self.fit.names, self.fit.coefficients, strict=True)):
            line = f"  {name:7} {value:9.4f}"
            if self.fit.standard_errors and self.fit.intervals:
                low, high = self.fit.intervals[i]
                line += f"  ± {self.fit.standard_errors[i]:.4f}  [{low:.4f}, {high:.4f}]"
            if self.fit.form == JIMENEZ2016.form:
                line += f"   published {JIMENEZ2016.coefficients[i]:9.4f}"
            lines.append(line)
        lines.append(f"  RMSE on these scenes {self.result.rmse:.4f}, published set {published.train_rmse:.4f}")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return self.fit._repr_html_()


def _bounces(value: float) -> str:
    return "infinitely many bounces" if math.isinf(value) else f"{value:g} bounces"


def _samples(data: list[SceneData], config: RefitConfig) -> fit.Samples:
    regressors = {d.name: d.screen for d in data} if config.regressor == "screen" else None
    return fit.Samples.from_transports([(d.name, d.transport) for d in data], regressors=regressors)


def _fit(samples: fit.Samples, config: RefitConfig) -> fit.MultibounceResult:
    settings = {f.name: getattr(config.fit, f.name) for f in fields(config.fit)}
    return fit.multibounce(samples, **settings)


def _scene_entry(d: SceneData, source: str) -> dict[str, Any]:
    """What a record says of one scene: where it came from, as a hash, and what its visibilities look like."""
    v = d.transport.escaped[:, 0].sum(0, dtype=np.int64) / d.transport.spp
    if source in render.scenes.names():
        origin = {"path": f"embedded:{d.name}", "sha256": d.fingerprints[0]}
    else:
        origin = io.file_entry(source)
    return origin | {
        "scene": d.name,
        "views": list(d.fingerprints),
        "n_pixels": int(v.size),
        "mean_visibility": float(v.mean()),
        "visibility_deciles": np.histogram(v, bins=10, range=(0, 1))[0].tolist(),
        "share_left_inside": float(d.transport.remaining.sum(dtype=np.int64) / d.transport.spp / v.size),
    }


def refit(
    config: RefitConfig | None = None,
    output: Path | str = "refit",
    *,
    cache: Path | str | None = None,
    progress: Report | None = None,
) -> RefitOutcome:
    """Refit multi-bounce coefficients and write everything a user or a reviewer needs.

    Transport images are cached by what they depend on, so that another fit of the same scenes takes seconds and an
    interrupted run goes on where it stopped. The record is written last: a directory without ``record.json`` is not
    finished.

    Args:
        config: settings; ``RefitConfig()`` if left out.
        output: directory, made if missing; files of an earlier run in it are replaced.
        cache: directory of cached transport images; default ``$GTAO_CACHE_DIR``, else the user's cache directory.
        progress: called as ``progress(task, done, total)``.

    Returns:
        The fit, the comparison of forms and the record.

    Raises:
        SceneError: a scene cannot be loaded, is given twice, or shows no surface.
        ConfigError: a setting is out of range.
        FitError: the scenes do not determine the coefficients.
        RecordError, ImageError: the output cannot be written.
    """
    config = RefitConfig() if config is None else config
    embedded = render.scenes.names("procedural") if config.also_embedded or not config.scenes else ()
    sources = scene_names([*config.scenes, *embedded])
    directory = OutputDirectory(output)
    store = io.TransportCache(io.default_cache_directory() if cache is None else cache)
    data = collect(sources, config, store, progress)

    compared = list(dict.fromkeys((config.fit.bounces, *TABULATED)))
    steps = _Steps(progress, 3 + len(compared))
    samples = _samples(data, config)
    steps.next()
    result = _fit(samples, config)
    steps.next()
    tables = {}
    for bounces in compared:
        tables[bounces] = fit.compare_forms(
            samples, bounces, albedos=config.fit.albedos, weighting=config.fit.weighting, include=config.fit
        )
        steps.next()

    shaders = {suffix: io.shader_code(result.fit, language) for language, suffix in LANGUAGES.items()}
    diagnostics = fit.diagnose(samples, result)
    figures = plot.refit_figures(result, tables, diagnostics)
    figures["scenes"] = plot.image_row([d.visibility for d in data], [d.name for d in data])
    record = io.provenance(["gtao", "refit"], seed=config.seed, config=_portable(config)) | {
        "kind": "multibounce refit",
        "inputs": [_scene_entry(d, sources[d.name]) for d in data],
        "numbers": {
            "fit": result.to_dict(),
            "comparison": {_key(bounces): table.to_dict() for bounces, table in tables.items()},
        },
    }

    def page(record: dict[str, Any]) -> str:
        shader = shaders[SHOWN_SHADER]
        return plot.refit_report(result, tables, diagnostics, record=record, shader=shader, figures=figures)

    texts = {"coefficients.json": io.fit_text(result.fit)}
    texts |= {f"multibounce.{suffix}": code for suffix, code in shaders.items()}
    record = directory.publish(record, texts, figures, page)
    steps.next()
    return RefitOutcome(result.fit, result, tables, record)


def _portable(config: RefitConfig) -> dict[str, Any]:
    """The settings as a record may hold them: files by names that mean something elsewhere."""
    return config.to_dict() | {"scenes": portable(config.scenes)}


class _Steps:
    """Progress of the part after rendering."""

    def __init__(self, progress: Report | None, total: int):
        self._progress, self._total, self._done = progress, total, -1
        self.next()

    def next(self) -> None:
        self._done += 1
        if self._progress:
            self._progress("fit", self._done, self._total)


def _key(bounces: float) -> str:
    return "inf" if math.isinf(bounces) else f"{bounces:g}"
