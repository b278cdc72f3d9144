"""Numbers against the number of frames: how errors settle, and what they settle at."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from gtao.errors import ShapeError

from .style import MUTED, grid_shape, hide_unused, method_styles, new_figure, styled

__all__ = ["settling_curves"]


@styled
def settling_curves(
    panels: Mapping[str, Mapping[str, Sequence[float]]],
    *,
    at: Sequence[float] | None = None,
    levels: Mapping[str, Mapping[str, float]] | None = None,
    marks: Mapping[str, float] | None = None,
    xlabel: str = "frames",
    ylabel: str = "RMSE",
    log: bool = False,
    title: str = "",
) -> Figure:
    """Curves over frames, or over another number, a panel for each scene.

    Args:
        panels: Panel -> method -> values; None and NaN leave gaps.
        at: Where the values are; 1, 2, 3 … if left out.
        levels: Panel -> name -> value to draw across, dashed, such as the error of a single frame.
        marks: Panel -> place to mark, such as a cut.
        xlabel, ylabel: What is drawn.
        log: Both axes are logarithmic; else the vertical one holds 0.
        title: Title.

    Returns:
        The figure; panels that have the same methods share their colours and one legend.

    Raises:
        ShapeError: There is no curve, or one has another length than ``at``.
    """
    names = list(dict.fromkeys(name for curves in panels.values() for name in curves))
    if not names:
        raise ShapeError("there are no curves to draw; give at least one")
    across = list(dict.fromkeys(name for values in (levels or {}).values() for name in values))
    styles, dashes = method_styles(names), ["--", ":", "-.", (0, (5, 1, 1, 1, 1, 1))]
    rows, columns = grid_shape(len(panels), 3)
    figure, grid = new_figure(rows, columns, cell=(3.6, 2.8), sharex=True)
    for axis, (panel, curves) in zip(hide_unused(grid, len(panels)), panels.items(), strict=True):
        for name, values in curves.items():
            y = np.array([np.nan if value is None else value for value in values], dtype=float)
            x = np.arange(1, len(y) + 1) if at is None else np.asarray(at, dtype=float)
            if x.shape != y.shape:
                raise ShapeError(f"{name} has {len(y)} values at {len(x)} places")
            axis.plot(
                x, y, **styles[name] | {"marker": ""} if len(y) > 12 else styles[name], label=name, markersize=3.5
            )
        for name, value in (levels or {}).get(panel, {}).items():
            axis.axhline(
                value, color=MUTED, linewidth=1, linestyle=dashes[across.index(name) % len(dashes)], label=name
            )
        if marks and panel in marks:
            axis.axvline(marks[panel], color=MUTED, linewidth=0.8, zorder=1)
        axis.set_title(panel)
        axis.set(xlabel=xlabel, **({"xscale": "log", "yscale": "log"} if log else {}))
    for axis in grid[:, 0]:
        axis.set_ylabel(ylabel)
    found = {text: line for axis in grid.flat for line, text in zip(*axis.get_legend_handles_labels(), strict=True)}
    figure.legend(found.values(), found.keys(), loc="outside lower center", ncols=3)
    figure.suptitle(title, fontweight="bold")
    return figure
