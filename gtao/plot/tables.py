"""Figures of a comparison of forms."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from .fits import bounces_text
from .style import CLOSED_FORM, INK, MUTED, OTHER, PUBLISHED, REFIT, new_figure, styled

__all__ = ["forms", "left_out"]

_MARKS = {"color": CLOSED_FORM, "marker": "D"}, {"color": OTHER, "marker": "s"}


@styled
def left_out(table: Any, label: str, *, others: tuple[str, ...] = ("four parameters", "one parameter")) -> Figure:
    """Error on each scene with coefficients from the other scenes, beside the published coefficients.

    Args:
        table: A :class:`gtao.fit.FormTable`.
        label: Row to show as bars beside the published ones.
        others: Rows to show as marks; at most two.

    Returns:
        Horizontal bars, scenes sorted by the published error. Empty axes with a note where there is a single scene.
    """
    n = len(table.scenes)
    figure, grid = new_figure(1, 1, cell=(6.6, 1.3 + 0.36 * n))
    axis = grid[0, 0]
    ours, published = table[label], table["published"]
    if ours.rmse_per_scene is None:
        axis.set_axis_off()
        axis.text(0.5, 0.5, "One scene: there is nothing to leave out.", ha="center", va="center")
        return figure
    order = np.argsort(published.rmse_per_scene)
    y = np.arange(n)
    axis.barh(y + 0.19, np.array(ours.rmse_per_scene)[order], 0.36, color=REFIT, label=label)
    axis.barh(y - 0.19, np.array(published.rmse_per_scene)[order], 0.36, color=PUBLISHED, label="published")
    for name, mark in zip(others, _MARKS, strict=False):
        values = table[name].rmse_per_scene
        if name != label and values is not None:
            axis.plot(
                np.array(values)[order], y, linestyle="none", markersize=5, markeredgecolor=INK,
                markeredgewidth=0.6, label=name, **mark,
            )  # fmt: skip
    axis.set(
        yticks=y, yticklabels=[table.scenes[i] for i in order], xlabel="RMSE of V' over all albedos", xlim=(0, None)
    )
    axis.grid(visible=False, axis="y")
    handles, names = axis.get_legend_handles_labels()
    figure.legend(
        handles[-2:] + handles[:-2], names[-2:] + names[:-2], loc="outside lower center", ncols=2, frameon=False
    )
    figure.suptitle(f"Each scene with coefficients from the others, {bounces_text(table.bounces)}", fontweight="bold")
    return figure


@styled
def forms(table: Any, label: str) -> Figure:
    """Training and left-out error of every form.

    Args:
        table: A :class:`gtao.fit.FormTable`.
        label: Row to emphasise.

    Returns:
        One line per form, from the error on its own scenes (open) to that on left-out scenes (full).
    """
    rows = list(table.rows)[::-1]
    figure, grid = new_figure(1, 1, cell=(6.6, 1.1 + 0.27 * len(rows)))
    axis = grid[0, 0]
    axis.axvline(table["published"].train_rmse, color=PUBLISHED, linewidth=0.9, linestyle=(0, (5, 2)))
    for y, row in enumerate(rows):
        colour = REFIT if row.label == label else PUBLISHED if row.label == "published" else MUTED
        end = row.train_rmse if row.loso_rmse is None else row.loso_rmse
        axis.plot([row.train_rmse, end], [y, y], color=colour, linewidth=2)
        axis.plot(row.train_rmse, y, "o", color=colour, markerfacecolor="white", markersize=6)
        if row.loso_rmse is not None:
            axis.plot(end, y, "o", color=colour, markersize=6)
    names = [f"{row.label}  ({row.n_parameters})" for row in rows]
    axis.set(yticks=range(len(rows)), yticklabels=names, xlabel="RMSE of V':  ○ scenes of the fit   ● left-out scenes")
    axis.grid(visible=False, axis="y")
    figure.suptitle(f"Forms (number of parameters), {bounces_text(table.bounces)}", fontweight="bold")
    return figure
