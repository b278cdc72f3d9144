"""The report of a refit: one HTML file with everything in it, no script, no network."""

import html
from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

from gtao.data.multibounce import JIMENEZ2016

from . import fits, tables
from .fits import bounces_text
from .markup import folded, html_table, image, json_block, paragraph, section, tiles
from .page import page
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
        section("Coefficients", _coefficients(result), *_notes(result)),
        section(
            "Forms",
            paragraph(_FORMS_NOTE),
            *(_forms(t, settings.label, figures[f"forms_{b:g}"]) for b, t in compared.items()),
        ),
        section("Scene by scene", _scenes(table, settings.label), _figure("left_out", figures)),
        section("The fit", *(_figure(name, figures) for name in ("scatter", "comparison", "coefficients"))),
        section("What it misses, and where it is blind", _figure("residuals", figures), _figure("coverage", figures)),
        section("Settings and provenance", _settings(result), folded("Shader code", shader), json_block(record)),
    ]
    return page(title, "\n".join(sections))


def _headline(result: Any, table: Any, scenes: str) -> str:
    settings = result.settings
    published, ours = table["published"], table[settings.label]
    cells = [
        (f"{ours.train_rmse:.4f}", "RMSE, refit"),
        (f"{published.train_rmse:.4f}", "RMSE, published"),
    ]
    if ours.loso_rmse is not None:
        cells.append((f"{ours.loso_rmse:.4f}", "RMSE, refit on left-out scenes"))
        cells.append((f"{ours.wins} of {len(table.scenes)}", "left-out scenes won"))
    lead = f"{settings.label}, {bounces_text(settings.bounces)}, {len(table.scenes)} scenes"
    return (
        f"<section><p class=lead>{html.escape(lead)}</p>{tiles(cells)}"
        f"{paragraph(verdict(table, settings.label))}{paragraph(best_form(table))}{scenes}</section>"
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
    return html_table(head, rows)


def _notes(result: Any) -> list[str]:
    return [paragraph(text) for text in (clusters_note(result), noise_note(result), tail_note(result))]


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
    return f"<h3>{name}</h3>{html_table(head, rows, marks)}{image(figure, f'{name}: the forms in one view.')}"


def _scenes(table: Any, label: str) -> str:
    ours, published = table[label], table["published"]
    if ours.rmse_per_scene is None:
        return paragraph("One scene: there is nothing to leave out.")
    rows = []
    for name, a, b in zip(table.scenes, ours.rmse_per_scene, published.rmse_per_scene, strict=True):
        word = "<span class=good>won</span>" if a < b else "<span class=bad>lost</span>"
        rows.append([html.escape(name), f"{a:.4f}", f"{b:.4f}", number(a - b, "+.4f"), word])
    return html_table(["scene", "refit without it", "published", "difference", ""], rows)


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
    return html_table(["setting", "value"], rows)


def _bootstrap(result: Any) -> str:
    if result.n_clusters == 0:
        return "none"
    return f"{result.settings.n_bootstrap} draws of {result.n_clusters} {result.clusters}, seed {result.settings.seed}"


def _figure(name: str, figures: Mapping[str, Figure]) -> str:
    return image(figures[name], _CAPTIONS[name]) if name in figures else ""
