"""What an error is made of: bars of error budgets, and steps of deviations."""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from gtao.errors import ShapeError

from .style import BEHIND_TEXT, INK, MUTED, PUBLISHED, REFIT, grid_shape, hide_unused, method_styles, new_figure, styled
from .words import number

__all__ = ["deviation_bars", "error_budget_bar"]


@styled
def error_budget_bar(budgets: Mapping[str, Any], *, title: str = "Error budget") -> Figure:
    """One stacked bar per error budget: the mean squares of the steps, and what their cross terms add or take away.

    Args:
        budgets: :class:`gtao.evaluate.ErrorBudget` by name of the scene or the method.
        title: Title.

    Returns:
        Horizontal bars. The coloured parts are mean squares and start at 0; the hatched part goes from their end to
        the total, which a line marks: to the left where steps undo each other's error, to the right where they add up.

    Raises:
        ShapeError: There is no budget.
    """
    if not budgets:
        raise ShapeError("there is no error budget to draw; give at least one")
    names = list(dict.fromkeys(name for budget in budgets.values() for name in budget.names))
    colours = {name: style["color"] for name, style in method_styles(names).items()}
    figure, grid = new_figure(1, 1, cell=(6.4, 1.5 + 0.42 * len(budgets) + 0.17 * -(-(len(names) + 2) // 3)))
    axis = grid[0, 0]
    y = np.arange(len(budgets))[::-1]
    ends = []
    for row, budget in zip(y, budgets.values(), strict=True):
        # Unbiased mean squares can lie below 0, within noise: those go to the left.
        right = left = 0.0
        for name, square in zip(budget.names, budget.mean_squares, strict=True):
            axis.barh(row, square, 0.62, left=right if square > 0 else left, color=colours[name], linewidth=0)
            right, left = right + max(square, 0.0), left + min(square, 0.0)
        start = right + left
        axis.barh(
            row, budget.total - start, 0.34, left=start, facecolor="white", alpha=0.85, edgecolor=INK, hatch="//////",
            linewidth=0.8,
        )  # fmt: skip
        axis.plot([budget.total] * 2, [row - 0.4, row + 0.4], color=INK, linewidth=2.2, solid_capstyle="butt")
        if budget.total_error is not None:
            axis.errorbar(budget.total, row - 0.4, xerr=budget.total_error, color=INK, linewidth=1, capsize=2)
        ends.append(max(right, budget.total))
    for row, end, budget in zip(y, ends, budgets.values(), strict=True):
        words = f"RMSE {np.sqrt(max(budget.total, 0.0)):.4f}"
        axis.annotate(
            words, (end, row), xytext=(6, 0), textcoords="offset points", va="center", fontsize=8, color=INK
        )  # fmt: skip
    axis.set(yticks=y, yticklabels=list(budgets), xlabel="mean squared error, noise taken out")
    axis.set_ylim(-0.6, len(budgets) - 0.4)
    axis.set_xlim(None, 1.22 * max(ends) or 1.0)
    axis.axvline(0, color=MUTED, linewidth=0.8)
    axis.grid(visible=False, axis="y")
    axis.ticklabel_format(axis="x", style="sci", scilimits=(-2, 3), useMathText=True)
    handles: list[Any] = [Patch(facecolor=colours[name], label=name) for name in names]
    handles.append(Patch(facecolor="white", edgecolor=INK, hatch="//////", label="cross terms, up to the total"))
    figure.legend(handles=handles, loc="outside lower center", ncols=min(3, len(handles)))
    figure.suptitle(title, fontweight="bold")
    return figure


@styled
def deviation_bars(deviations: Mapping[str, Sequence[tuple[str, float]]], *, limit: float | None = None) -> Figure:
    """How the error changes as the deviations of a renderer from the published estimator are switched on one by one.

    Args:
        deviations: Renderer -> (deviation, RMSE) pairs: the first is the published estimator, each further one has one
            more deviation.
        limit: RMSE of the best that a single depth layer gives, drawn as a line.

    Returns:
        One panel per renderer, two in a row, read from top to bottom: full bars for the first and last RMSE, floating
        bars between for what each deviation adds (vermilion) or takes away (blue).

    Raises:
        ShapeError: There is no renderer, or one without a pair.
    """
    if not deviations or not all(deviations.values()):
        raise ShapeError("there are no deviations to draw; give at least one renderer with one (name, RMSE) pair")
    rows, columns = grid_shape(len(deviations), 2)
    lengths = [len(steps) + (len(steps) > 1) for steps in deviations.values()]
    heights = [max(lengths[row * columns : (row + 1) * columns]) for row in range(rows)]
    figure, grid = new_figure(
        rows, columns, cell=(6.0, 0.7 + 0.27 * sum(heights) / rows), sharex=True, height_ratios=heights
    )
    top = max(value for steps in deviations.values() for _, value in steps)
    panels = zip(hide_unused(grid, len(lengths)), deviations.items(), strict=True)
    for i, (axis, (engine, steps)) in enumerate(panels):
        bars = [(steps[0][0], 0.0, steps[0][1], MUTED)]
        for (_, before), (name, after) in itertools.pairwise(steps):
            bars.append((name, before, after, PUBLISHED if after > before else REFIT))
        if len(steps) > 1:
            bars.append((engine, 0.0, steps[-1][1], MUTED))
        for y, (_, before, after, colour) in enumerate(bars):
            axis.barh(y, after - before, 0.66, left=before, color=colour, linewidth=0)
            words = f"{after:.4f}" if colour == MUTED else number(after - before, "+.4f")
            axis.annotate(
                words, (max(before, after), y), xytext=(4, 0), textcoords="offset points", va="center", fontsize=7.5,
                bbox=BEHIND_TEXT,
            )  # fmt: skip
            if y + 1 < len(bars):
                axis.plot([after] * 2, [y - 0.33, y + 1.33], color=INK, linewidth=0.6)
        axis.set(
            yticks=range(len(bars)),
            yticklabels=[bar[0] for bar in bars],
            xlim=(0, 1.12 * max(top, limit or 0.0) or 1.0),
        )
        axis.set_ylim(heights[i // columns] - 0.5, -0.5)
        axis.tick_params(labelbottom=True)
        axis.grid(visible=False, axis="y")
        axis.set_title(engine)
        if limit is not None:
            axis.axvline(limit, color=INK, linewidth=1.0, linestyle=(0, (6, 3)), zorder=0.9)
    note = "" if limit is None else "  (dashed: limit of one depth layer)"
    figure.supxlabel(f"RMSE against the truth{note}", fontsize=9)
    return figure
