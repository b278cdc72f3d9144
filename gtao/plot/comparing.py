"""All figures of a comparison by name."""

import re
from collections.abc import Callable

from matplotlib.figure import Figure

from .comparison import Comparison, MethodResult, SceneComparison
from .comparison_images import comparison_images, error_budget_maps, signed_error_maps
from .error_bars import deviation_bars, error_budget_bar
from .error_curves import error_against_samples, error_against_time, stratified_errors

__all__ = ["budget_overviews", "comparison_figures", "figure_name", "scene_figure", "shown_methods"]


def comparison_figures(comparison: Comparison) -> dict[str, Figure]:
    """All figures of a comparison.

    Args:
        comparison: What was measured.

    Returns:
        Figures by names that can be file names: for every scene "SCENE_KIND" with the kinds "images", "errors",
        "budget", "budget_maps", "samples", "time", "deviations" and "strata", as far as there are data for them; and
        "budget_METHOD" over all scenes, where there are several.
    """
    figures = budget_overviews(comparison)
    for scene in comparison.scenes:
        for kind in _KINDS:
            figure = scene_figure(scene, kind)
            if figure is not None:
                figures[figure_name(scene.name, kind)] = figure
    return figures


def figure_name(subject: str, kind: str) -> str:
    """Name of a figure, with nothing in it that a file name cannot hold."""
    return re.sub(r"[^\w.()+-]+", "-", f"{subject}_{kind}")


def scene_figure(scene: SceneComparison, kind: str) -> Figure | None:
    """One of the figures of a scene; None without data for it."""
    return _KINDS[kind](scene)


def budget_overviews(comparison: Comparison) -> dict[str, Figure]:
    """Error budgets over several scenes: of the library's own methods, or else of the first one that has a budget."""
    if len(comparison.scenes) < 2:
        return {}
    labels = dict.fromkeys(label for scene in comparison.scenes for label in scene.budgets)
    ours = [label for label in labels if label in {m.label for s in comparison.scenes for m in s.methods if m.ours}]
    figures = {}
    for label in ours or list(labels)[:1]:
        budgets = {scene.name: scene.budgets[label] for scene in comparison.scenes if label in scene.budgets}
        figures[figure_name("budget", label)] = error_budget_bar(budgets, title=f"Error budget of {label}")
    return figures


def shown_methods(scene: SceneComparison) -> dict[str, MethodResult]:
    """Methods that have an image, the lowest RMSE first, by a label that is theirs alone."""
    methods = sorted((m for m in scene.methods if m.visibility is not None), key=lambda m: m.metrics["rmse"] or 0.0)
    labels = [m.label for m in methods]
    return {m.label if labels.count(m.label) == 1 else f"{m.label}, {m.group or m.name}": m for m in methods}


def _images(scene: SceneComparison) -> Figure | None:
    shown = {label: m.visibility for label, m in shown_methods(scene).items()}
    return comparison_images(scene.truth, shown, mask=scene.mask) if shown else None


def _errors(scene: SceneComparison) -> Figure | None:
    shown = shown_methods(scene)
    if not shown:
        return None
    captions = {label: f"RMSE {m.metrics['rmse']:.4f}" for label, m in shown.items()}
    images = {label: m.visibility for label, m in shown.items()}
    return signed_error_maps(scene.truth, images, mask=scene.mask, captions=captions)


def _budget(scene: SceneComparison) -> Figure | None:
    return error_budget_bar(scene.budgets, title=f"Error budget, {scene.name}") if scene.budgets else None


def _budget_maps(scene: SceneComparison) -> Figure | None:
    if not scene.budgets:
        return None
    ours = _ours(scene)
    label = min(scene.budgets, key=lambda name: name not in ours)
    return error_budget_maps(scene.budgets[label], title=f"Error budget of {label}, {scene.name}")


def _samples(scene: SceneComparison) -> Figure | None:
    if not scene.curves:
        return None
    return error_against_samples(
        scene.curves, noise=scene.noise, limit=scene.limit_rmse, ours=_ours(scene),
        title=f"Error against samples, {scene.name}",
    )  # fmt: skip


def _time(scene: SceneComparison) -> Figure | None:
    points: dict[str, list[tuple[float, float]]] = {}
    for m in scene.methods:
        if m.milliseconds is not None:
            points.setdefault(m.label, []).append((m.milliseconds, m.metrics["rmse"] or 0.0))
    if not points:
        return None
    return error_against_time(
        points, noise=scene.noise, limit=scene.limit_rmse, ours=_ours(scene), title=f"Error against time, {scene.name}"
    )


def _deviations(scene: SceneComparison) -> Figure | None:
    return deviation_bars(scene.deviations, limit=scene.limit_rmse) if scene.deviations else None


def _strata(scene: SceneComparison) -> Figure | None:
    return stratified_errors(scene.strata, ours=_ours(scene)) if scene.strata else None


def _ours(scene: SceneComparison) -> list[str]:
    return [m.label for m in scene.methods if m.ours]


_KINDS: dict[str, Callable[[SceneComparison], Figure | None]] = {
    "images": _images,
    "errors": _errors,
    "budget": _budget,
    "budget_maps": _budget_maps,
    "samples": _samples,
    "time": _time,
    "deviations": _deviations,
    "strata": _strata,
}
