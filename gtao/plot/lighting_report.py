"""The report of a comparison under light: one HTML file with everything in it."""

import html
from collections.abc import Mapping

from matplotlib.figure import Figure

from .comparing import figure_name
from .comparison import Comparison
from .comparison_tables import TABLE_STYLE, summary_rows, summary_table
from .lighting import LightingComparison, lighting_bars, lighting_images
from .markup import html_table, image, paragraph, repeating, section
from .page import page

__all__ = ["lighting_figures", "lighting_report"]

#: Pictures on a page, half a megabyte each at 128x128; every light has one at least.
_PICTURES = 24

_ERRORS_NOTE = (
    "Errors are those of the irradiance of all pixels that show a surface, in all colour channels, relative to its "
    "mean under the whole light, without the noise of the rays. Truth and estimates have the same reach of occluders."
)
_CUT_NOTE = (
    "Where the light is cut, so is the truth: what is left is the error of the method and of the visibility that it is "
    "given, ray-traced visibility having none. What the cut itself costs is measured apart, with exact visibility. A "
    "window takes the negative radiance out of light that was cut."
)


def lighting_figures(comparison: LightingComparison) -> dict[str, Figure]:
    """All figures by names that can be file names: "methods", and "FRAME_LIGHT" for every view."""
    tables = [table for cuts in comparison.tables.values() for table in cuts.values()]
    ours = dict.fromkeys(m.name for table in tables for scene in table.scenes for m in scene.methods if m.ours)
    figures = {"methods": lighting_bars(comparison.means, ours=list(ours))}
    for view in comparison.views:
        figures[figure_name(view.frame, view.light)] = lighting_images(view)
    return figures


def lighting_report(comparison: LightingComparison, *, figures: Mapping[str, Figure] | None = None) -> str:
    """The report as one HTML page.

    Args:
        comparison: What was measured.
        figures: From :func:`lighting_figures`; drawn if left out.

    Returns:
        HTML with its images and styles inside; it needs no network. With many views it shows the first ones under each
        light, so that a browser can hold it.
    """
    drawn = lighting_figures(comparison) if figures is None else figures
    sections = [_headline(comparison, drawn["methods"])]
    n_pictures = max(1, _PICTURES // len(comparison.tables))
    for i, (light, cuts) in enumerate(comparison.tables.items()):
        views = [view for view in comparison.views if view.light == light][:n_pictures]
        pictures = [image(drawn[figure_name(v.frame, v.light)], f"{v.frame}, {v.source}") for v in views]
        tables = [_tables(name, table) for name, table in cuts.items()]
        sections.append(section(light, *pictures, *tables, anchor=f"light-{i}"))
    sections.append(repeating(comparison.command, comparison.versions, comparison.record))
    return page(comparison.title, "\n".join(sections), style=TABLE_STYLE)


def _headline(comparison: LightingComparison, bars: Figure) -> str:
    links = " · ".join(f"<a href='#light-{i}'>{html.escape(name)}</a>" for i, name in enumerate(comparison.tables))
    parts = [_matrix(comparison, cut, source) for cut, sources in comparison.means.items() for source in sources]
    notes = [*comparison.notes, _ERRORS_NOTE, _CUT_NOTE]
    return (
        f"<section><p class=lead>{links}</p>{''.join(map(paragraph, notes))}"
        f"{image(bars, 'Mean over all light and all frames.')}{''.join(parts)}</section>"
    )


def _matrix(comparison: LightingComparison, cut: str, source: str) -> str:
    """A row per method and a column per light; the lowest of each is marked."""
    means = comparison.means[cut][source]
    columns = {}
    for light, cuts in comparison.tables.items():
        rows = summary_rows(cuts[cut], source) if cut in cuts else []
        columns[light] = {row.present[0].name: row.rmse for row in rows}
    body = []
    for name in sorted(means, key=means.__getitem__):
        line = [html.escape(name), f"{means[name]:.4f}"]
        for values in columns.values():
            text = f"{values[name]:.4f}" if name in values else "–"
            best = name in values and values[name] == min(values.values())
            line.append(f"<span class=good>{text}</span>" if best else text)
        body.append(line)
    heading = f"<h3>{html.escape(cut)}, {html.escape(source)}</h3>"
    return heading + html_table(["method", "mean", *map(html.escape, columns)], body)


def _tables(cut: str, table: Comparison) -> str:
    parts = []
    for group in table.groups():
        words = f"{html.escape(cut)}, {html.escape(group)}"
        parts.append(f"<details><summary>{words}</summary>{summary_table(table, summary_rows(table, group))}</details>")
    return "".join(parts)
