"""The report of a refit: one HTML file with everything in it, no script, no network."""

import base64
import html
import json
from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

from gtao.data.multibounce import JIMENEZ2016

from . import fits, tables
from .fits import bounces_text
from .page import PAGE
from .style import png_bytes
from .words import best_form, clusters_note, inside, noise_note, number, tail_note, verdict

__all__ = ["refit_figures", "refit_report"]

_CAPTIONS = {
    "scenes": "The scenes: visibility, white is open.",
    "scatter": "All samples, and what the fit makes of them.",
    "comparison": "The refit beside the published coefficients.",
    "coefficients": "Cubics of single albedos, and the lines in the albedo through their coefficients.",
    "left_out": "How each scene fares with coefficients that never saw it.",
    "residuals": "Where in visibility each scene is missed, and by how much.",
    "coverage": "Which visibilities the scenes can say something about.",
}

_FORMS_NOTE = (
    "An RMSE is the root of the squared error, averaged over albedos and over scenes that count the same, with the "
    "noise of the samples taken out. “Left out” scores every scene with coefficients from the others. The two-step "
    "procedure gives the same numbers as the direct fit, as it must: visibility does not depend on the albedo."
)

#: Pixels of the page per inch of a figure: the widest just fill the column.
_PIXELS_PER_INCH = 92


def refit_figures(result: Any, compared: Mapping[float, Any], diagnostics: Any) -> dict[str, Figure]:
    """All figures of a refit by name.

    Args:
        result: A :class:`gtao.fit.MultibounceResult`.
        compared: A :class:`gtao.fit.FormTable` per number of bounces; that of the result among them.
        diagnostics: A :class:`gtao.fit.Diagnostics` of the result.

    Returns:
        Figures; "coefficients" only for the form ``linear_cubic``.
    """
    label = result.settings.label
    figures = {
        "scatter": fits.scatter(diagnostics),
        "comparison": fits.comparison(diagnostics),
        "left_out": tables.left_out(compared[result.settings.bounces], label),
        "residuals": fits.residuals(diagnostics),
        "coverage": fits.coverage(diagnostics),
    }
    if result.fit.form == "linear_cubic":
        figures["coefficients"] = fits.coefficients(result)
    for bounces, table in compared.items():
        figures[f"forms_{bounces:g}"] = tables.forms(table, label)
    return figures


def refit_report(
    result: Any,
    compared: Mapping[float, Any],
    diagnostics: Any,
    *,
    record: Mapping[str, Any] | None = None,
    shader: str | None = None,
    figures: Mapping[str, Figure] | None = None,
    title: str = "Multi-bounce refit",
) -> str:
    """The report as one HTML page.

    Args:
        result: A :class:`gtao.fit.MultibounceResult`.
        compared: A :class:`gtao.fit.FormTable` per number of bounces; that of the result among them.
        diagnostics: A :class:`gtao.fit.Diagnostics` of the result.
        record: Provenance, shown folded.
        shader: Shader code of the fit, shown folded.
        figures: From :func:`refit_figures`, drawn if left out; and, as "scenes", a picture of the scenes.
        title: Heading.

    Returns:
        HTML with its images and styles inside.
    """
    figures = refit_figures(result, compared, diagnostics) if figures is None else figures
    settings = result.settings
    table = compared[settings.bounces]
    sections = [
        _headline(result, table, _figure("scenes", figures)),
        _section("Coefficients", _coefficients(result), *_notes(result)),
        _section(
            "Forms",
            _paragraph(_FORMS_NOTE),
            *(_forms(t, settings.label, figures[f"forms_{b:g}"]) for b, t in compared.items()),
        ),
        _section("Scene by scene", _scenes(table, settings.label), _figure("left_out", figures)),
        _section("The fit", *(_figure(name, figures) for name in ("scatter", "comparison", "coefficients"))),
        _section("What it misses, and where it is blind", _figure("residuals", figures), _figure("coverage", figures)),
        _section("Settings and provenance", _settings(result), _folded("Shader code", shader), _json(record)),
    ]
    return PAGE.substitute(title=html.escape(title), body="\n".join(sections))


def _section(title: str, *parts: str) -> str:
    return f"<section><h2>{html.escape(title)}</h2>{''.join(parts)}</section>"


def _paragraph(text: str) -> str:
    return f"<p>{html.escape(text)}</p>" if text else ""


def _headline(result: Any, table: Any, scenes: str) -> str:
    settings = result.settings
    published, ours = table["published"], table[settings.label]
    tiles = [
        (f"{ours.train_rmse:.4f}", "RMSE, refit"),
        (f"{published.train_rmse:.4f}", "RMSE, published"),
    ]
    if ours.loso_rmse is not None:
        tiles.append((f"{ours.loso_rmse:.4f}", "RMSE, refit on left-out scenes"))
        tiles.append((f"{ours.wins} of {len(table.scenes)}", "left-out scenes won"))
    cells = "".join(f"<div class=tile><b>{value}</b><span>{name}</span></div>" for value, name in tiles)
    lead = f"{settings.label}, {bounces_text(settings.bounces)}, {len(table.scenes)} scenes"
    return (
        f"<section><p class=lead>{html.escape(lead)}</p><div class=tiles>{cells}</div>"
        f"{_paragraph(verdict(table, settings.label))}{_paragraph(best_form(table))}{scenes}</section>"
    )


def _coefficients(result: Any) -> str:
    fit = result.fit
    compare = fit.form == JIMENEZ2016.form
    head = ["", "value", "standard error"]
    head += [f"{fit.level:.0%} interval"] if fit.intervals else []
    head += ["published", "inside interval"] if compare else []
    rows = []
    for i, (name, value) in enumerate(zip(fit.names, fit.coefficients, strict=True)):
        cells = [f"<b>{name}</b>", number(value), f"{fit.standard_errors[i]:.4f}" if fit.standard_errors else "–"]
        if fit.intervals:
            cells.append("[{}, {}]".format(*map(number, fit.intervals[i])))
        if compare:
            known = JIMENEZ2016.coefficients[i]
            cells += [number(known), inside(known, fit.intervals[i] if fit.intervals else None)]
        rows.append(cells)
    return _table(head, rows)


def _notes(result: Any) -> list[str]:
    return [_paragraph(text) for text in (clusters_note(result), noise_note(result), tail_note(result))]


def _forms(table: Any, label: str, figure: Figure) -> str:
    head = ["form", "parameters", "RMSE", "left out", "bias", "scenes won", "change per scene"]
    rows, marks = [], []
    for row in table.rows:
        left = ["–"] * 4
        if row.loso_rmse is not None:
            left = [f"{row.loso_rmse:.4f}", number(row.bias, "+.4f"), "–", "–"]
        if row.difference is not None:
            left[2:] = [
                f"{row.wins} of {len(table.scenes)}",
                f"{number(row.difference, '+.4f')} ± {row.difference_error:.4f}",
            ]
        rows.append([html.escape(row.label), str(row.n_parameters), f"{row.train_rmse:.4f}", *left])
        marks.append("ours" if row.label == label else "published" if row.label == "published" else "")
    name = bounces_text(table.bounces).capitalize()
    return f"<h3>{name}</h3>{_table(head, rows, marks)}{_image(figure, f'{name}: the forms in one view.')}"


def _scenes(table: Any, label: str) -> str:
    ours, published = table[label], table["published"]
    if ours.rmse_per_scene is None:
        return _paragraph("One scene: there is nothing to leave out.")
    rows = []
    for name, a, b in zip(table.scenes, ours.rmse_per_scene, published.rmse_per_scene, strict=True):
        word = "<span class=good>won</span>" if a < b else "<span class=bad>lost</span>"
        rows.append([html.escape(name), f"{a:.4f}", f"{b:.4f}", number(a - b, "+.4f"), word])
    return _table(["scene", "refit without it", "published", "difference", ""], rows)


def _settings(result: Any) -> str:
    settings = result.settings
    rows = [
        ["form", html.escape(settings.form)],
        ["bounces", bounces_text(settings.bounces)],
        ["albedos", ", ".join(f"{albedo:g}" for albedo in settings.albedos)],
        ["procedure", settings.procedure],
        ["constraints", html.escape(", ".join(settings.constraints)) or "none"],
        ["constraints that bind", html.escape(", ".join(result.active)) or "none"],
        ["weighting", settings.weighting],
        ["bootstrap", _bootstrap(result)],
    ]
    return _table(["setting", "value"], rows)


def _bootstrap(result: Any) -> str:
    if result.n_clusters == 0:
        return "none"
    return f"{result.settings.n_bootstrap} draws of {result.n_clusters} {result.clusters}, seed {result.settings.seed}"


def _table(head: list[str], rows: list[list[str]], marks: list[str] | None = None) -> str:
    marks = marks or [""] * len(rows)
    body = "".join(
        f"<tr class='{mark}'>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>"
        for row, mark in zip(rows, marks, strict=True)
    )
    return f"<div class=scroll><table><tr>{''.join(f'<th>{h}</th>' for h in head)}</tr>{body}</table></div>"


def _figure(name: str, figures: Mapping[str, Figure]) -> str:
    return _image(figures[name], _CAPTIONS[name]) if name in figures else ""


def _image(figure: Figure, caption: str) -> str:
    data = base64.b64encode(png_bytes(figure, dpi=130)).decode()
    text = html.escape(caption)
    width = round(_PIXELS_PER_INCH * figure.get_figwidth())
    image = f'<img alt="{text}" width={width} src="data:image/png;base64,{data}">'
    return f"<figure>{image}<figcaption>{text}</figcaption></figure>"


def _folded(summary: str, text: str | None) -> str:
    if not text:
        return ""
    return f"<details><summary>{html.escape(summary)}</summary><pre>{html.escape(text)}</pre></details>"


def _json(record: Mapping[str, Any] | None) -> str:
    return _folded("Record", json.dumps(record, indent=2, default=str)) if record else ""
