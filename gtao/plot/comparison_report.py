"""The report of a comparison: one HTML file with everything in it."""

import html

from .comparison import Comparison, SceneComparison
from .markup import folded, html_table, json_block, paragraph, section
from .page import PAGE

__all__ = ["compare_report"]


def compare_report(comparison: Comparison) -> str:
    """The report as one HTML page.

    Args:
        comparison: What was measured.

    Returns:
        HTML with its images, styles and script inside; it needs no network.
    """
    sections = [section(scene.name, _methods(scene)) for scene in comparison.scenes]
    sections += [section("How to repeat it", folded("Command", comparison.command), json_block(comparison.record))]
    notes = "".join(map(paragraph, comparison.notes))
    return PAGE.substitute(title=html.escape(comparison.title), body=notes + "\n".join(sections))


def _methods(scene: SceneComparison) -> str:
    rows = sorted(scene.methods, key=lambda m: m.metrics["rmse"])
    cells = [[html.escape(m.group), html.escape(m.label), f"{m.metrics['rmse']:.4f}"] for m in rows]
    return html_table(["group", "method", "RMSE"], cells)
