"""The report of a tuning: one HTML file with everything in it, no script, no network."""

import html
from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

from .markup import html_table, image, json_block, paragraph, section, tiles
from .page import page
from .tuning import tuning_figures
from .words import number

__all__ = ["tuning_report"]

_CAPTIONS = {
    "history": "How the error fell, and by what kind of step. Differences count one evaluation for each of their ends.",
    "parameters": "Where options began and ended, and how far other scenes would move them.",
    "errors": "Every view: blue lines are gains over the rival, red ones losses.",
    "candidates": "Combinations of discrete options after each was tuned on its own.",
}

_ERRORS_NOTE = (
    "Errors are root mean squares over the pixels that show a surface, against rays of the same reach, with the noise "
    "of the rays taken out. “Unseen” views were scored by a tuning that never saw their scene."
)
_DIFFERENCES_NOTE = (
    "Options moved by “differences” have no usable derivative: they decide which texels are read, and the error jumps "
    "where a sample goes from one texel to the next. Their slope is that of the error over many such jumps."
)


def tuning_report(
    result: Any, rival: str, *, record: Mapping[str, Any] | None = None, figures: Mapping[str, Figure] | None = None
) -> str:
    """The report as one HTML page.

    Args:
        result: A :class:`gtao.fit.TuningResult`.
        rival: Label of the method to compare with.
        record: Provenance, shown folded.
        figures: From :func:`tuning_figures`, drawn if left out.

    Returns:
        HTML with its images and styles inside.
    """
    drawn = tuning_figures(result, rival) if figures is None else figures
    parts = {name: image(figure, _CAPTIONS[name]) for name, figure in drawn.items()}
    note = _DIFFERENCES_NOTE if any(p.by == "differences" for p in result.parameters) else ""
    sections = [
        _headline(result, rival),
        section("Options", _parameters(result), paragraph(note), parts["parameters"]),
        section("Scene by scene", paragraph(_ERRORS_NOTE), _against(result, rival), parts["errors"]),
        section("Descent", parts["history"]),
    ]
    if "candidates" in parts:
        sections.append(section("Discrete options", _candidates(result), parts["candidates"]))
    sections.append(section("Provenance", json_block(record)))
    return page("Tuning", "\n".join(sections))


def _headline(result: Any, rival: str) -> str:
    n_scenes = len(set(result.scores.scenes))
    cells = [
        (f"{result.start_loss**0.5:.4f}", "RMSE before"),
        (f"{result.loss**0.5:.4f}", "RMSE after, same scenes"),
    ]
    for held_out, name in ((False, "left out in turn"), (True, "held out")):
        found = result.scores.summary(rival, held_out=held_out)
        if found:
            cells.append((f"{found['unseen']:.4f}", f"RMSE, {name}; {html.escape(rival)} {found['rival']:.4f}"))
    lead = f"{len(result.parameters)} options, {len(result.scores.views)} views of {n_scenes} scenes"
    ended = "" if result.converged else "The tuning ended at its limit of rounds, not because nothing gained any more."
    return f"<section><p class=lead>{html.escape(lead)}</p>{tiles(cells)}{paragraph(ended)}</section>"


def _parameters(result: Any) -> str:
    rows = []
    for p in result.parameters:
        unit = {"": "", "radius": "radii"}.get(p.unit, f"of {p.unit}")
        interval = "–" if p.interval is None else "[{}, {}]".format(*map(number, p.interval))
        rows.append(
            [
                f"<b>{html.escape(p.path)}</b>",
                number(p.start, ".4g"),
                number(p.value, ".4g") + (" (bound)" if p.at_bound else ""),
                html.escape(unit),
                "–" if p.standard_error is None else f"{p.standard_error:.3g}",
                interval,
                p.by,
            ]
        )
    return html_table(["option", "start", "tuned", "unit", "standard error", "interval", "by"], rows)


def _against(result: Any, rival: str) -> str:
    rows = []
    for held_out, name in ((False, "left out in turn"), (True, "held out")):
        for filtered in (True, False) if result.scores.unfiltered is not None else (True,):
            found = result.scores.summary(rival, held_out=held_out, filtered=filtered)
            if not found:
                continue
            error = "" if found["standard_error"] is None else f" ± {found['standard_error']:.4f}"
            rows.append(
                [
                    name + ("" if filtered else ", no filter"),
                    f"{found['unseen']:.4f}",
                    f"{found['rival']:.4f}",
                    f"{found['wins']} of {found['n_views']}",
                    number(found["difference"], "+.4f") + error,
                ]
            )
    if not rows:
        return paragraph("No view was left out: these numbers say how the tuning does on what it has seen.")
    return html_table(["views", "tuned, unseen", html.escape(rival), "won", "change per scene"], rows)


def _candidates(result: Any) -> str:
    head = [*map(html.escape, result.candidates[0].choice), "taps", "RMSE"]
    rows = [
        [*(html.escape(str(v)) for v in c.choice.values()), str(c.taps), f"{c.loss**0.5:.4f}"]
        for c in result.candidates
    ]
    return html_table(head, rows, ["ours", *[""] * (len(rows) - 1)])
