"""Figures of a tuning. They take what :func:`gtao.fit.tune` returns and compute nothing."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from .style import CLOSED_FORM, INK, MUTED, OTHER, PUBLISHED, REFIT, new_figure, styled

__all__ = ["tuning_candidates", "tuning_errors", "tuning_figures", "tuning_history", "tuning_parameters"]

_KINDS = {"descent": (REFIT, "quasi-Newton steps"), "search": (CLOSED_FORM, "compass search")}

#: Candidates that a figure has room for.
_MOST_CANDIDATES = 24


def tuning_figures(result: Any, rival: str) -> dict[str, Figure]:
    """All figures of a tuning by name.

    Args:
        result: A :class:`gtao.fit.TuningResult`.
        rival: Label of the method to compare with.

    Returns:
        Figures; "candidates" only where discrete options were searched.
    """
    figures = {
        "history": tuning_history(result),
        "parameters": tuning_parameters(result),
        "errors": tuning_errors(result, rival),
    }
    if len(result.candidates) > 1:
        figures["candidates"] = tuning_candidates(result)
    return figures


@styled
def tuning_history(result: Any) -> Figure:
    """RMSE of the best point so far against evaluations of the loss.

    Args:
        result: A :class:`gtao.fit.TuningResult`.

    Returns:
        One point per improvement, coloured by what made it.
    """
    figure, grid = new_figure(1, 1, cell=(6.6, 3.2))
    axis = grid[0, 0]
    counts, losses, kinds = zip(*result.history, strict=True)
    errors = np.sqrt(losses)
    axis.step([*counts, max(counts[-1], result.candidates[0].n_evaluations)], [*errors, errors[-1]], where="post",
              color=MUTED, linewidth=0.9)  # fmt: skip
    axis.plot(counts[0], errors[0], "o", color=INK, markersize=5, label="start")
    for kind, (colour, label) in _KINDS.items():
        chosen = [i for i, k in enumerate(kinds) if k == kind]
        if chosen:
            points = np.array(counts)[chosen], errors[chosen]
            axis.plot(*points, "o", color=colour, markersize=3.5, label=label)
    axis.set(xlabel="evaluations of the loss", ylabel="RMSE on the scenes of the tuning")
    axis.legend(loc="upper right")
    figure.suptitle("Descent of the error", fontweight="bold")
    return figure


@styled
def tuning_parameters(result: Any) -> Figure:
    """Every tuned option between its start, its bounds and what other scenes would make of it.

    Args:
        result: A :class:`gtao.fit.TuningResult`.

    Returns:
        One row per option with an axis of its own: start, tuned value with its interval, and the values of the folds.
    """
    n = len(result.parameters)
    figure, grid = new_figure(n, 1, cell=(6.6, 0.62 + 0.9 / n))
    for axis, p in zip(grid[:, 0], result.parameters, strict=True):
        axis.grid(visible=False)
        axis.spines["left"].set_visible(False)
        axis.set(ylim=(-1, 1), yticks=[])
        axis.axhline(0, color=MUTED, alpha=0.35, linewidth=1, zorder=1)
        folds = [fold.values[p.path] for fold in result.folds if p.path in fold.values]
        axis.plot(folds, [0.0] * len(folds), "|", color=OTHER, markersize=11, markeredgewidth=1.4, zorder=3)
        if p.interval is not None:
            axis.plot(p.interval, (0, 0), color=REFIT, linewidth=5, alpha=0.3, zorder=2)
        axis.plot(p.start, 0, "D", color=PUBLISHED, markersize=5.5, zorder=4)
        axis.plot(p.value, 0, "o", color=REFIT, markersize=6.5, zorder=5)
        axis.margins(x=0.08)
        # The name stands outside of the axis, where nothing is drawn.
        unit = {"": "", "radius": "\n[radii]"}.get(p.unit, f"\n[share of {p.unit}]")
        axis.set_ylabel(f"{p.path}{unit}", rotation=0, ha="right", va="center", fontsize=8)
        axis.text(1.01, 0.5, f"{p.start:.3g} → {p.value:.3g}", transform=axis.transAxes, va="center", fontsize=8)
    handles = [
        Line2D([], [], linestyle="none", marker="D", color=PUBLISHED, label="start"),
        Line2D([], [], linestyle="none", marker="o", color=REFIT, label="tuned"),
        Line2D([], [], linestyle="none", marker="|", markersize=11, color=OTHER, label="folds"),
    ]
    if any(p.interval is not None for p in result.parameters):
        handles.insert(2, Patch(color=REFIT, alpha=0.3, label="interval over scenes"))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    figure.suptitle("Tuned options", fontweight="bold")
    return figure


@styled
def tuning_errors(result: Any, rival: str) -> Figure:
    """RMSE of every view: before, tuned without the view, and the rival's.

    Args:
        result: A :class:`gtao.fit.TuningResult`.
        rival: Label of the method to compare with.

    Returns:
        Rows sorted by the rival's error, held-out scenes above; open circles where no tuning left the view out.
    """
    scores = result.scores
    table, n = scores.rmse, len(scores.views)
    seen = np.isnan(table["unseen"])
    ours = np.where(seen, table["tuned"], table["unseen"])
    order = np.lexsort((table[rival], scores.held_out))
    figure, grid = new_figure(1, 1, cell=(6.8, 1.4 + 0.2 * n))
    axis = grid[0, 0]
    for y, i in enumerate(order):
        colour = REFIT if ours[i] < table[rival][i] else PUBLISHED
        axis.plot([table[rival][i], ours[i]], [y, y], color=colour, linewidth=1.8, alpha=0.45, zorder=2)
        axis.plot(table["start"][i], y, "|", color=MUTED, markersize=8, markeredgewidth=1.3, zorder=3)
        axis.plot(table[rival][i], y, "D", color=PUBLISHED, markersize=4.5, zorder=4)
        face = "white" if seen[i] else REFIT
        axis.plot(ours[i], y, "o", color=REFIT, markersize=5.5, markerfacecolor=face, zorder=5)
    n_kept = int((~scores.held_out).sum())
    if 0 < n_kept < n:
        axis.axhline(n_kept - 0.5, color=MUTED, linewidth=0.8)
        axis.text(
            1, n_kept - 0.4, "held out", transform=axis.get_yaxis_transform(), ha="right", fontsize=8, color=MUTED
        )
    axis.set(yticks=range(n), yticklabels=[scores.views[i] for i in order], ylim=(-0.7, n - 0.3), xlim=(0, None))
    axis.tick_params(axis="y", labelsize=7.5 if n > 20 else 8.5, length=0)
    axis.set_xlabel("RMSE against ray-traced truth")
    axis.grid(visible=False, axis="y")
    handles = [
        Line2D([], [], linestyle="none", marker="|", markersize=8, color=MUTED, label="start"),
        Line2D([], [], linestyle="none", marker="D", color=PUBLISHED, label=rival),
    ]
    for some, face, label in ((~seen, REFIT, "tuned without the scene"), (seen, "white", "tuned, scene included")):
        if some.any():
            marks = {"linestyle": "none", "marker": "o", "color": REFIT, "markerfacecolor": face}
            handles.append(Line2D([], [], label=label, **marks))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    figure.suptitle("Every view before and after", fontweight="bold")
    return figure


@styled
def tuning_candidates(result: Any) -> Figure:
    """Error of every combination of discrete options after it was tuned, against its depth samples.

    Args:
        result: A :class:`gtao.fit.TuningResult`.

    Returns:
        Horizontal bars, the lowest error on top; the best ones where there are many.
    """
    shown = result.candidates[:_MOST_CANDIDATES]
    figure, grid = new_figure(1, 1, cell=(6.6, 1.0 + 0.28 * len(shown)))
    axis = grid[0, 0]
    errors = [c.loss**0.5 for c in shown]
    y = np.arange(len(shown))[::-1]
    axis.barh(y, errors, 0.62, color=[REFIT, *[MUTED] * (len(shown) - 1)])
    names = [", ".join(f"{k} {_short(v)}" for k, v in c.choice.items()) + f"  ({c.taps} taps)" for c in shown]
    axis.set(yticks=y, yticklabels=names, xlim=(0, 1.12 * max(errors)), xlabel="RMSE on the scenes of the tuning")
    for position, error in zip(y, errors, strict=True):
        axis.text(error, position, f" {error:.4f}", va="center", fontsize=8)
    axis.grid(visible=False, axis="y")
    more = len(result.candidates) - len(shown)
    figure.suptitle("Discrete options, each tuned" + (f" ({more} more not shown)" if more else ""), fontweight="bold")
    return figure


def _short(value: Any) -> str:
    return type(value).__name__ if hasattr(value, "to_dict") or hasattr(value, "__dataclass_fields__") else str(value)
