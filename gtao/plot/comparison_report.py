"""The report of a comparison: one HTML file with everything in it."""

import html
import math
from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure

from .comparison import Comparison, MethodResult, SceneComparison
from .comparison_images import error_budget_maps
from .comparison_tables import TABLE_STYLE, Row, scene_table, settings_table, summary_rows, summary_table
from .error_bars import deviation_bars, error_budget_bar
from .error_curves import error_against_samples, error_against_time, stratified_errors
from .markup import html_table, image, json_block, paragraph, section, tiles
from .page import page
from .viewer import VIEWER_SCRIPT, VIEWER_STYLE, viewer
from .words import number

__all__ = ["compare_figures", "compare_report"]

_CAPTIONS = {
    "budget": "What the error is made of. Coloured: the mean square of each step from the truth to the estimate. "
    "Hatched: what their cross terms take away or add, up to the total at the black line.",
    "budget_maps": "The same steps as maps, on one scale: blue darkens, red brightens.",
    "samples": "Error against depth samples per pixel.",
    "time": "Error against time, of the kernels alone: down and to the left is better.",
    "deviations": "The deviations of each renderer from the published estimator, switched on one after the other.",
    "strata": "Error by circumstance. Below each bin, its share of the pixels.",
}

#: Figures that stand two in a row.
_NARROW = ("budget", "deviations", "samples", "time")

_STYLE = """
.columns { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(34rem, 100%), 1fr)); gap: 0 1.5rem; }
pre.command { padding: .8rem 1rem; background: var(--card); border: 1px solid var(--line); border-radius: .6rem; }
"""

_ERRORS_NOTE = (
    "Errors are those of the visibility of all pixels that show a surface, against rays of the same reach. The RMSE "
    "contains the noise of the truth itself, which is printed with each scene; “no noise” has it taken out."
)


def compare_figures(scene: SceneComparison) -> dict[str, Figure]:
    """All figures of one scene by name.

    Args:
        scene: What was measured.

    Returns:
        Those of "budget", "budget_maps", "samples", "time", "deviations" and "strata" that there are data for.
    """
    levels = {"noise": scene.noise, "limit": scene.limit_rmse}
    ours = [m.label for m in scene.methods if m.ours]
    figures = {}
    if scene.budgets:
        label, first = next(iter(scene.budgets.items()))
        figures["budget"] = error_budget_bar(scene.budgets, title=f"Error budget, {scene.name}")
        figures["budget_maps"] = error_budget_maps(first, title=f"{label}, {scene.name}")
    if scene.curves:
        figures["samples"] = error_against_samples(
            scene.curves, **levels, ours=ours, title=f"Error against samples, {scene.name}"
        )
    times = _times(scene)
    if times:
        figures["time"] = error_against_time(times, **levels, ours=ours, title=f"Error against time, {scene.name}")
    if scene.deviations:
        figures["deviations"] = deviation_bars(scene.deviations, limit=scene.limit_rmse)
    if scene.strata:
        figures["strata"] = stratified_errors(scene.strata, ours=ours)
    return figures


def compare_report(comparison: Comparison, *, figures: Mapping[str, Mapping[str, Figure]] | None = None) -> str:
    """The report as one HTML page.

    Args:
        comparison: What was measured.
        figures: Scene -> figures of :func:`compare_figures`; drawn where left out.

    Returns:
        HTML with its images, styles and script inside; it needs no network, and reads well without the script.
    """
    drawn = figures or {}
    sections = [_headline(comparison), _overview(comparison)]
    for i, scene in enumerate(comparison.scenes):
        sections.append(_scene(scene, drawn.get(scene.name) or compare_figures(scene), f"scene-{i}"))
    sections.append(_repeat(comparison))
    return page(comparison.title, "\n".join(sections), style=VIEWER_STYLE + TABLE_STYLE + _STYLE, script=VIEWER_SCRIPT)


def _headline(comparison: Comparison) -> str:
    tables, cells = [], []
    for group in comparison.groups():
        rows = summary_rows(comparison, group)
        tables.append((f"<h3>{html.escape(group)}</h3>" if group else "") + summary_table(comparison, rows))
        cells.append(_tile(rows[0], group, len(comparison.scenes)))
    n_methods = len({m.name for scene in comparison.scenes for m in scene.methods})
    n_scenes = len(comparison.scenes)
    lead = f"{n_methods} method{'s' * (n_methods != 1)} on {n_scenes} scene{'s' * (n_scenes != 1)}"
    links = " · ".join(f"<a href='#scene-{i}'>{html.escape(s.name)}</a>" for i, s in enumerate(comparison.scenes))
    return (
        f"<section><p class=lead>{lead}: {links}</p>{tiles(cells)}{''.join(map(paragraph, comparison.notes))}"
        f"{paragraph(_ERRORS_NOTE)}{''.join(tables)}</section>"
    )


def _tile(best: Row, group: str, n_scenes: int) -> tuple[str, str]:
    where = f", {html.escape(group)}" if group else ""
    wins = f", first on {best.lowest} of {n_scenes} scenes" if n_scenes > 1 else ""
    return f"{best.rmse:.4f}", f"lowest RMSE{where}:<br><strong>{html.escape(best.label)}</strong>{wins}"


def _overview(comparison: Comparison) -> str:
    """The budgets of one method over all scenes, where there are several scenes."""
    labels = dict.fromkeys(label for scene in comparison.scenes for label in scene.budgets)
    if len(comparison.scenes) < 2 or not labels:
        return ""
    parts = []
    for label in labels:
        budgets = {scene.name: scene.budgets[label] for scene in comparison.scenes if label in scene.budgets}
        parts.append(image(error_budget_bar(budgets, title=f"Error budget of {label}"), label))
    return section("Where the error comes from", paragraph(_CAPTIONS["budget"]), _columns(parts))


def _scene(scene: SceneComparison, figures: Mapping[str, Figure], anchor: str) -> str:
    facts = ["occluders at any distance" if math.isinf(scene.radius) else f"occluders within {scene.radius:g}"]
    if scene.noise is not None:
        facts.append(f"noise of the truth {scene.noise:.4f}")
    if scene.limit_rmse is not None:
        facts.append(f"limit of one depth layer {scene.limit_rmse:.4f} (tick on the bars)")
    shown = _shown(scene)
    parts = [f"<p class=lead>{' · '.join(facts)}</p>", *map(paragraph, scene.notes)]
    if shown:
        captions = {label: f"RMSE {m.metrics['rmse']:.4f}" + _bias(m.metrics.get("bias")) for label, m in shown.items()}
        best = min(shown, key=lambda label: (not shown[label].ours, shown[label].metrics["rmse"]))
        pictures = {label: m.visibility for label, m in shown.items()}
        parts.append(viewer(scene.truth, pictures, mask=scene.mask, captions=captions, ours=best))
    parts.append(scene_table(scene))
    narrow = [image(figures[name], _CAPTIONS[name]) for name in _NARROW if name in figures]
    wide = [image(figure, _CAPTIONS.get(name, name)) for name, figure in figures.items() if name not in _NARROW]
    return section(scene.name, *parts, _columns(narrow), *wide, anchor=anchor)


def _columns(figures: Sequence[str]) -> str:
    """Two figures in a row, where the window is wide enough."""
    return f"<div class=columns>{''.join(figures)}</div>" if figures else ""


def _shown(scene: SceneComparison) -> dict[str, MethodResult]:
    """Methods that have an image, the lowest RMSE first, by a label that is theirs alone."""
    methods = sorted((m for m in scene.methods if m.visibility is not None), key=lambda m: m.metrics["rmse"])
    labels = [m.label for m in methods]
    return {m.label if labels.count(m.label) == 1 else f"{m.label}, {m.group or m.name}": m for m in methods}


def _times(scene: SceneComparison) -> dict[str, list[tuple[float, float]]]:
    """(milliseconds, RMSE) of every method that was timed, all its groups together."""
    times: dict[str, list[tuple[float, float]]] = {}
    for m in scene.methods:
        if m.milliseconds is not None:
            times.setdefault(m.label, []).append((m.milliseconds, m.metrics["rmse"]))
    return times


def _bias(value: float | None) -> str:
    return "" if value is None else f", bias {number(value, '+.4f')}"


def _repeat(comparison: Comparison) -> str:
    parts = []
    if comparison.command:
        parts.append(f"<div class=scroll><pre class=command>{html.escape(comparison.command)}</pre></div>")
    if comparison.versions:
        rows = [[html.escape(name), html.escape(version)] for name, version in comparison.versions.items()]
        parts.append(html_table(["", "version"], rows))
    settings = settings_table(comparison)
    if settings:
        parts.append(f"<details><summary>Settings of the methods</summary>{settings}</details>")
    parts.append(json_block(comparison.record))
    return section("How to repeat it", *parts) if any(parts) else ""
