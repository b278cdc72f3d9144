"""The report of a comparison of specular occlusion: one HTML file with everything in it."""

import html
from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure

from .comparing import figure_name
from .comparison import Comparison
from .comparison_tables import TABLE_STYLE, summary_rows, summary_table
from .lighting import lighting_bars, lighting_images
from .markup import html_table, image, paragraph, repeating, section
from .page import page
from .specular import SpecularComparison, specular_curves, specular_images, specular_steps

__all__ = ["specular_figures", "specular_report"]

#: Pictures on a page of each kind, half a megabyte each.
_PICTURES = 12

_ERRORS_NOTE = (
    "S is the share of what a glossy surface would reflect of a white dome that the scene lets through. Errors are "
    "those of all pixels that show a surface, without the noise of the rays. Truth and estimates have the same reach "
    "of occluders."
)
_STEPS_NOTE = (
    "cone-brdf sums the BRDF up over the visible cone: it is off by the assumption that visibility is a cone, and by "
    "nothing else. What others change on top of that are their own approximations. Steps do not add up: they may "
    "cancel each other."
)
_CONES_NOTE = (
    "Visibility is a cone here, cut by the tangent plane, and every method is told that cone: RMSE against the BRDF "
    "summed up over it. Bent normals are tilted from the normal by up to the angle of the column."
)
_LIT_NOTE = (
    "Radiance of glossy surfaces against traced reflections of the light, relative to its mean: S (F0 A + B) times the "
    "pre-filtered light. Traced factors say what is left where no method errs; light alone is the error of "
    "pre-filtered light where nothing occludes, against light traced without occluders."
)


def specular_figures(comparison: SpecularComparison) -> dict[str, Figure]:
    """All figures by names that can be file names.

    "methods" and "steps", where there are lights "lit", and one for every view: "FRAME_ROUGHNESS_SOURCE" under the
    white dome, "FRAME_LIGHT-roughness-ROUGHNESS" under a light.
    """
    figures = {"methods": specular_curves(comparison.means, shown=comparison.shown)}
    if any(comparison.steps.values()):
        figures["steps"] = specular_steps(comparison.steps)
    if comparison.lit_means:
        errors = {f"roughness {r}": _chosen(groups, comparison.shown) for r, groups in comparison.lit_means.items()}
        figures["lit"] = lighting_bars(errors, label="RMSE / mean radiance")
    for view in comparison.views:
        figures[_name(view)] = specular_images(view)
    for view in comparison.lit_views:
        figures[figure_name(view.frame, view.light)] = lighting_images(view)
    return figures


def _chosen(groups: Mapping[str, Mapping[str, float]], shown: Sequence[str]) -> dict[str, dict[str, float]]:
    """Of groups that hold methods to show those, of others everything."""
    return {
        group: {name: v for name, v in rows.items() if name in shown} or dict(rows) for group, rows in groups.items()
    }


def _name(view) -> str:
    return figure_name(view.frame, f"{view.roughness:g}_{view.source}")


def specular_report(comparison: SpecularComparison, *, figures: Mapping[str, Figure] | None = None) -> str:
    """The report as one HTML page.

    Args:
        comparison: What was measured.
        figures: From :func:`specular_figures`; drawn if left out.

    Returns:
        HTML with its images and styles inside; it needs no network. With many views it shows the first ones, so that a
        browser can hold it.
    """
    drawn = specular_figures(comparison) if figures is None else figures
    parts = [paragraph(note) for note in (*comparison.notes, _ERRORS_NOTE)]
    parts.append(image(drawn["methods"], "Mean over all frames."))
    parts += [_matrix(f"Given {source}, by roughness", rows) for source, rows in comparison.means.items()]
    sections = [f"<section>{''.join(parts)}</section>"]
    if "steps" in drawn:
        steps = image(drawn["steps"], "Mean over all frames, given ray-traced visibility except for the last two.")
        sections.append(section("Where errors come from", paragraph(_STEPS_NOTE), steps))
    if comparison.cones:
        cones = [_matrix(f"F0 = {f0}, by the greatest tilt in degrees", rows) for f0, rows in comparison.cones.items()]
        sections.append(section("Where visibility is a cone", paragraph(_CONES_NOTE), *cones))
    views = [image(drawn[_name(view)], _caption(view)) for view in comparison.views[:_PICTURES]]
    sections.append(section("Pictures", *views) if views else "")
    details = [_details(f"roughness {r}", table) for r, table in comparison.tables.items()]
    sections.append(section("Frame by frame", *details))
    sections.append(_lit(comparison, drawn) if comparison.lit else "")
    sections.append(repeating(comparison.command, comparison.versions, comparison.record))
    return page(comparison.title, "\n".join(sections), style=TABLE_STYLE)


def _caption(view) -> str:
    return f"{view.frame}, roughness {view.roughness:g}, {view.source}"


def _matrix(heading: str, rows: Mapping[str, Mapping[str, float]]) -> str:
    """A row per method and a column per key; the lowest of each is marked."""
    names = list(dict.fromkeys(name for row in rows.values() for name in row))
    averages = {name: [row[name] for row in rows.values() if name in row] for name in names}
    body = []
    for name in sorted(names, key=lambda name: sum(averages[name]) / len(averages[name])):
        cells = [html.escape(name), f"{sum(averages[name]) / len(averages[name]):.4f}"]
        body.append(cells + [_cell(row, name) for row in rows.values()])
    return f"<h3>{html.escape(heading)}</h3>" + html_table(["method", "mean", *rows], body)


def _composites(roughness: str, groups: Mapping[str, Mapping[str, float]]) -> str:
    """A row per composite and a column per group; the lowest of each column is marked."""
    names = dict.fromkeys(name for rows in groups.values() for name in rows)
    least = {name: min(rows[name] for rows in groups.values() if name in rows) for name in names}
    order = sorted(names, key=least.__getitem__)
    body = [[html.escape(name), *(_cell(rows, name) for rows in groups.values())] for name in order]
    heading = f"<h3>Mean over light and frames, roughness {html.escape(roughness)}</h3>"
    return heading + html_table(["composite", *map(html.escape, groups)], body)


def _cell(row: Mapping[str, float], name: str) -> str:
    if name not in row:
        return "–"
    best = row[name] == min(row.values())
    return f"<span class=good>{row[name]:.4f}</span>" if best else f"{row[name]:.4f}"


def _details(words: str, table: Comparison) -> str:
    parts = []
    for group in table.groups():
        summary = f"{html.escape(words)}, {html.escape(group)}"
        rows = summary_table(table, summary_rows(table, group))
        parts.append(f"<details><summary>{summary}</summary>{rows}</details>")
    return "".join(parts)


def _lit(comparison: SpecularComparison, drawn: Mapping[str, Figure]) -> str:
    parts = [paragraph(_LIT_NOTE), image(drawn["lit"], "Mean over all light and all frames.")]
    parts += [_composites(r, groups) for r, groups in comparison.lit_means.items()]
    n_pictures = max(1, _PICTURES // len(comparison.lit))
    for light, tables in comparison.lit.items():
        parts.append(f"<h3>{html.escape(light)}</h3>")
        views = [v for v in comparison.lit_views if v.light.startswith(f"{light}, ")][:n_pictures]
        parts += [image(drawn[figure_name(v.frame, v.light)], f"{v.frame}, {v.source}") for v in views]
        parts += [_details(f"{light}, roughness {r}", table) for r, table in tables.items()]
    return section("Under light from afar", *parts)
