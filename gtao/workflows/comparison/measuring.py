"""Methods on a frame, against its truth."""

from dataclasses import replace
from typing import Any

import numpy as np

from gtao import evaluate
from gtao.config import GTAO, Pipeline, VisibilityBitmask, deviations, faithful, named, with_budget
from gtao.errors import ConfigError
from gtao.plot import MethodResult, SceneComparison

from .frames import Frame
from .ladder import DENSE, Field, budget_of
from .reasons import reason
from .settings import CompareConfig
from .timing import interleaved

__all__ = ["DEFAULTS", "measure"]

#: Group of the methods as they come; the others are called after their taps.
DEFAULTS = "own defaults"
#: Group of what a single depth layer can give.
LIMITS = "limits of one depth layer"
#: Methods that stand for this library.
OURS = ("gtao", "recommended")


def taps(n_slices: int, n_steps: int) -> int:
    return 2 * n_slices * n_steps


class _Bench:
    """All numbers of one frame, gathered by :func:`measure`."""

    def __init__(self, frame: Frame, field: Field, config: CompareConfig):
        self.frame, self.field, self.config = frame, field, config
        self.pipelines, self.left_out = _pipelines(config, frame.radius)

    def image(self, pipeline: Pipeline) -> np.ndarray:
        return pipeline.step(self.frame.g).visibility.numpy()

    def rmse(self, image: np.ndarray) -> float:
        return evaluate.rmse(image, self.frame.truth, mask=self.frame.mask)

    def result(self, name: str, pipeline: Pipeline, group: str, *, shown: bool, seconds: float | None = None) -> Any:
        image = self.image(pipeline)
        return MethodResult(
            name=name,
            label=name,
            metrics=self.metrics(image, perceptual=shown),
            group=group,
            taps=_taps(pipeline),
            milliseconds=None if seconds is None else 1e3 * seconds,
            visibility=image if shown else None,
            settings=_settings(pipeline),
            ours=name in OURS,
        )

    def metrics(self, image: np.ndarray, *, perceptual: bool, variance: Any = 0.0) -> dict[str, float | None]:
        """All numbers of an image whose own noise has ``variance``."""
        frame, field = self.frame, self.field
        noise = frame.variance + variance
        metrics = evaluate.scores(image, frame.truth, variance=noise, mask=frame.mask, perceptual=perceptual)
        toward_field = evaluate.corrected_rmse(image, field.inside, field.inside_variance, mask=frame.mask)
        return metrics | {"field_rmse": toward_field}

    def field_rmse(self, pipeline: Pipeline) -> float:
        field = self.field
        return evaluate.corrected_rmse(self.image(pipeline), field.inside, field.inside_variance, mask=self.frame.mask)

    def raw(self, pipeline: Pipeline, counts: tuple[int, int]) -> Pipeline:
        """The estimator alone, at a given budget: no filter, no clamp."""
        return replace(with_budget(pipeline, *counts), spatial=None, clamp=False)


def measure(frame: Frame, field: Field, config: CompareConfig, progress: Any) -> SceneComparison:
    """Every method on one frame: own defaults, equal budgets, curves, deviations, error budgets and strata.

    Args:
        progress: called as ``progress(done, total)``.
    """
    m = _Bench(frame, field, config)
    total = 6
    progress(0, total)
    seconds = interleaved(
        {name: lambda p=p: p.step(frame.g).visibility for name, p in m.pipelines.items()}, config.rounds
    )
    progress(1, total)
    results = [m.result(name, p, DEFAULTS, shown=True, seconds=seconds[name]) for name, p in m.pipelines.items()]
    progress(2, total)
    notes = []
    for counts in config.budgets:
        group = f"{taps(*counts)} taps per pixel"
        at_budget = _distinct({name: m.raw(p, counts) for name, p in m.pipelines.items()})
        equal = [m.result(name, p, group, shown=False) for name, p in at_budget.items()]
        notes += _nearer_than_gtao(m, at_budget, equal, group)
        results += equal
    results += _limits(m)
    progress(3, total)
    # Which are the same at one budget are so at all.
    curves = {
        name: [(taps(*counts), m.rmse(m.image(m.raw(m.pipelines[name], counts)))) for counts in config.curve]
        for name in _distinct({name: m.raw(p, (1, 1)) for name, p in m.pipelines.items()})
    }
    progress(4, total)
    walks = {name: _walk(m, p) for name, p in m.pipelines.items() if isinstance(p.occlusion, GTAO | VisibilityBitmask)}
    progress(5, total)
    budgets = {name: budget_of(p, frame, field) for name, p in m.pipelines.items()}
    by = evaluate.strata_of(
        frame.g.position_v.numpy(), frame.g.normal_v.numpy(), frame.truth, view_dir=_view_dir(frame)
    )
    strata = {
        r.name: evaluate.stratify(r.visibility, frame.truth, by=by, mask=frame.mask, variance=frame.variance)
        for r in results
        if r.group == DEFAULTS
    }
    progress(total, total)
    return SceneComparison(
        name=frame.name,
        radius=frame.radius,
        truth=frame.truth,
        mask=frame.mask,
        methods=results,
        noise=evaluate.noise_floor(frame.variance, mask=frame.mask),
        limit_rmse=evaluate.corrected_rmse(
            field.inside, frame.truth, frame.variance + field.inside_variance, mask=frame.mask
        ),
        budgets=budgets,
        curves=curves,
        deviations={name: walk for name, walk in walks.items() if len(walk) > 1},
        strata=strata,
        notes=[*m.left_out, *notes],
    )


def _pipelines(config: CompareConfig, radius: float) -> tuple[dict[str, Pipeline], list[str]]:
    """The methods to compare, and a sentence on those that do not take the radius."""
    pipelines, refused = {}, []
    for name in config.names:
        try:
            pipelines[name] = named(name, radius)
        except ConfigError:
            if config.methods:
                raise
            refused.append(name)
    return pipelines, [f"Left out, because they do not take the radius {radius:g}: {', '.join(refused)}."] * bool(
        refused
    )


def _limits(m: _Bench) -> list[MethodResult]:
    """What one depth layer can give: both ground truths of the height field, and GTAO with many samples."""
    method = GTAO(radius=m.frame.radius, fetch="linear", n_slices=DENSE[0], n_steps=DENSE[1])
    images = {
        "height field, ray march": (m.field.inside, m.field.inside_variance),
        "height field, dense slices": (m.field.horizon, 0.0),
        "gtao, dense": (m.image(Pipeline(occlusion=method, clamp=False)), 0.0),
    }
    return [
        MethodResult(name=name, label=name, metrics=m.metrics(image, perceptual=False, variance=variance), group=LIMITS)
        for name, (image, variance) in images.items()
    ]


def _distinct(pipelines: dict[str, Pipeline]) -> dict[str, Pipeline]:
    """Without those that equal an earlier one: quality levels differ in nothing but their budget."""
    kept: dict[str, Pipeline] = {}
    for name, pipeline in pipelines.items():
        if pipeline not in kept.values():
            kept[name] = pipeline
    return kept


def _nearer_than_gtao(m: _Bench, pipelines: dict[str, Pipeline], results: list[Any], group: str) -> list[str]:
    """Which methods are nearer the height field at the same budget, and which of their deviations makes them so."""
    errors = {r.name: float(r.metrics["field_rmse"] or 0.0) for r in results}
    if "gtao" not in errors:
        return []
    notes = []
    for name in sorted((n for n in errors if errors[n] < errors["gtao"]), key=errors.__getitem__):
        pipeline = pipelines[name]
        changes = {}
        clean = faithful(pipeline.occlusion)
        base = m.field_rmse(replace(pipeline, occlusion=clean))
        for d in deviations(pipeline.occlusion):
            alone = _switched(clean, d)
            if alone is not None:
                changes[d] = m.field_rmse(replace(pipeline, occlusion=alone)) - base
        helps = min(changes, key=changes.__getitem__, default=None)
        why = (
            f"; alone, its {helps.label} changes the faithful method's error by {changes[helps]:+.4f}:"
            f" {reason(helps.option)}"
            if helps is not None and changes[helps] < 0
            else "; it deviates in nothing that helps alone: another seed may turn the order"
        )
        notes.append(
            f"{group}: {name} is nearer the height field than gtao, {errors[name]:.4f} against"
            f" {errors['gtao']:.4f}{why}."
        )
    return notes


def _switched(method: Any, d: Any) -> Any:
    """The method with one deviation, or None where that one needs others."""
    try:
        return replace(method, **{d.option: d.value})
    except ConfigError:
        return None


def _walk(m: _Bench, pipeline: Pipeline) -> list[tuple[str, float]]:
    """RMSE as the deviations of a method from the faithful one are switched on, one after the other."""
    method, steps = pipeline.occlusion, deviations(pipeline.occlusion)
    method = replace(method, **{d.option: d.faithful for d in steps})
    walk = [("faithful", m.rmse(m.image(replace(pipeline, occlusion=method, spatial=None, clamp=False))))]
    for d in steps:
        method = replace(method, **{d.option: d.value})
        walk.append((d.label, m.rmse(m.image(replace(pipeline, occlusion=method, spatial=None, clamp=False)))))
    if pipeline.spatial is not None or pipeline.clamp:
        walk.append(("filter" if pipeline.spatial is not None else "clamp", m.rmse(m.image(pipeline))))
    return walk


def _taps(pipeline: Pipeline) -> int:
    method = pipeline.occlusion
    if hasattr(method, "n_slices"):
        return taps(method.n_slices, method.n_steps)
    return method.n_directions * method.rays_per_direction * method.n_steps


def _settings(pipeline: Pipeline) -> str:
    parts = [repr(pipeline.occlusion)]
    if pipeline.spatial is not None:
        parts.append(repr(pipeline.spatial))
    return ", then ".join(parts)


def _view_dir(frame: Frame) -> np.ndarray | None:
    if not frame.g.camera.is_orthographic:
        return None
    return np.array([0.0, 0.0, 1.0])
