"""Error against samples, against time and by circumstance, one line or mark per method."""

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from gtao.errors import ShapeError

from .style import BEHIND_TEXT, INK, MUTED, grid_shape, method_styles, new_figure, styled

__all__ = ["error_against_samples", "error_against_time", "stratified_errors"]

#: Width of a figure in inches.
_WIDTH = 6.4

#: A noise floor lower than the lowest error by more than this factor would only squeeze the curves.
_FAR = 4.0

_LEVEL_TEXT: dict[str, Any] = {
    "xytext": (-3, 3), "textcoords": "offset points", "ha": "right", "va": "bottom", "fontsize": 7.5, "color": INK,
    "bbox": BEHIND_TEXT,
}  # fmt: skip

#: Numbers that tick labels of a logarithmic axis may show, per decade: many, some, one.
_DECADES = (1, 1.5, 2, 3, 5, 7), (1, 2, 5), (1,)


@styled
def error_against_samples(
    curves: Mapping[str, Sequence[tuple[float, float]]],
    *,
    noise: float | None = None,
    limit: float | None = None,
    ours: Sequence[str] = (),
    title: str = "Error against samples",
) -> Figure:
    """RMSE over depth samples per pixel, both logarithmic.

    Args:
        curves: (taps per pixel, RMSE) pairs by label, in any order; both positive.
        noise: Noise floor of the truth, drawn as a line, or named at the lower end where it is far below all errors.
        limit: RMSE of the best that a single depth layer gives, drawn as a line.
        ours: Labels to emphasise.
        title: Title.

    Returns:
        The figure.

    Raises:
        ShapeError: There is no curve, or a number is not positive.
    """
    figure, axis = _log_axes(curves, "depth samples per pixel", title, noise, limit)
    styles = method_styles(curves, ours)
    for label, points in curves.items():
        x, y = np.array(sorted(points)).T
        axis.plot(x, y, label=label, markersize=5, **styles[label])
    figure.legend(loc="outside lower center", ncols=2)
    return figure


@styled
def error_against_time(
    points: Mapping[str, tuple[float, float] | Sequence[tuple[float, float]]],
    *,
    noise: float | None = None,
    limit: float | None = None,
    ours: Sequence[str] = (),
    title: str = "Error against time",
) -> Figure:
    """RMSE over the time of one frame, both logarithmic: down and to the left is better.

    Args:
        points: (milliseconds, RMSE) by label, or several of them, which are joined; all positive.
        noise: As in :func:`error_against_samples`.
        limit: As in :func:`error_against_samples`.
        ours: Labels to emphasise.
        title: Title.

    Returns:
        The figure.

    Raises:
        ShapeError: There is no point, or a number is not positive.
    """
    joined = {label: np.atleast_2d(np.asarray(value, dtype=float)) for label, value in points.items()}
    figure, axis = _log_axes(joined, "milliseconds per frame, warm", title, noise, limit)
    styles = method_styles(joined, ours)
    for label, values in joined.items():
        x, y = values[np.argsort(values[:, 0])].T
        axis.plot(x, y, label=label, markersize=7, **styles[label])
    figure.legend(loc="outside lower center", ncols=2)
    return figure


@styled
def stratified_errors(strata: Mapping[str, Mapping[str, Any]], *, ours: Sequence[str] = ()) -> Figure:
    """RMSE and bias by circumstance: one column of panels per quantity, one line per method.

    Args:
        strata: Label -> quantity -> :class:`gtao.evaluate.Strata`. The first method's quantities and edges name the
            panels; the other methods must have the same.
        ours: Labels to emphasise.

    Returns:
        The figure: noise-corrected RMSE above, with the noise floor of the truth, bias below, the share of the pixels
        between them in the tick labels.

    Raises:
        ShapeError: There is no method or no quantity, or the edges differ.
    """
    first = next(iter(strata.values()), {})
    if not first:
        raise ShapeError("there is nothing to draw; give at least one method with one quantity")
    styles = method_styles(strata, ours)
    figure, grid = new_figure(2, len(first), cell=(2.75, 2.3), sharey="row", sharex="col")
    for column, (quantity, table) in enumerate(first.items()):
        above, below = grid[:, column]
        x = np.arange(len(table.count))
        for label, tables in strata.items():
            if not np.array_equal(tables[quantity].edges, table.edges):
                raise ShapeError(f"{label} has other edges of {quantity} than the first method; use the same")
            above.plot(x, tables[quantity].corrected_rmse, markersize=3.5, label=label, **styles[label])
            below.plot(x, tables[quantity].bias, markersize=3.5, **styles[label])
        above.plot(x, table.noise, color=INK, linewidth=0.9, linestyle=(0, (1, 1.5)), label="noise of the truth")
        above.set_title(quantity)
        below.axhline(0, color=MUTED, linewidth=0.8)
        shares = 100 * table.count / max(table.count.sum(), 1)
        words = [f"{name}\n{share:.0f} %" for name, share in zip(_bins(quantity, table.edges), shares, strict=True)]
        below.set_xticks(x, words, fontsize=7)
        below.set_xlabel(_UNITS.get(quantity, quantity))
    # Once, after all lines: the row shares its axis, and a limit ends the automatic ones.
    grid[0, 0].set_ylim(0, None)
    grid[0, 0].set_ylabel("RMSE without noise")
    grid[1, 0].set_ylabel("bias")
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=grid_shape(len(labels), 5)[1])
    figure.suptitle("Error by circumstance (with the share of the pixels)", fontweight="bold")
    return figure


_UNITS = {"tilt": "tilt [°]", "image radius": "distance from the centre", "depth edge": "pixels to a depth edge"}


def _bins(quantity: str, edges: np.ndarray) -> list[str]:
    """Names of bins, in degrees for angles."""
    shown = np.rad2deg(edges) if quantity == "tilt" else edges
    pairs = itertools.pairwise(shown)
    return [f"≥{a:.3g}" if np.isinf(b) else f"<{b:.3g}" if np.isinf(a) else f"{a:.3g}–{b:.3g}" for a, b in pairs]


def _log_axes(
    series: Mapping[str, Any], xlabel: str, title: str, noise: float | None, limit: float | None
) -> tuple[Figure, Axes]:
    """Logarithmic axes around all points, with readable ticks and the lines that no method can pass."""
    values = np.concatenate([np.asarray(v, dtype=float).reshape(-1, 2) for v in series.values()] or [np.zeros((0, 2))])
    if not len(values) or not np.all(np.isfinite(values) & (values > 0)):
        raise ShapeError(f"{title}: there must be at least one point, and all numbers positive and finite")
    figure, grid = new_figure(1, 1, cell=(_WIDTH, 3.6 + 0.19 * -(-len(series) // 2)))
    axis = grid[0, 0]
    axis.set(xscale="log", yscale="log", xlabel=xlabel, ylabel="RMSE against the truth")
    axis.set_title(title)
    drawn: dict[str, tuple[float, Any]] = {}
    if noise and noise * _FAR > values[:, 1].min():
        drawn["noise of the truth"] = noise, (0, (1, 1.5))
    elif noise:
        axis.annotate(f"↓ noise of the truth {noise:.4f}", (1, 0), xycoords="axes fraction", **_LEVEL_TEXT)
    if limit:
        drawn["limit of one depth layer"] = limit, (0, (6, 3))
    _scale(axis.xaxis, axis.set_xlim, values[:, 0])
    _scale(axis.yaxis, axis.set_ylim, np.concatenate([values[:, 1], [value for value, _ in drawn.values()]]))
    for name, (value, dash) in drawn.items():
        axis.axhline(value, color=INK, linewidth=1.0, linestyle=dash, zorder=1)
        axis.annotate(name, (1, value), xycoords=("axes fraction", "data"), **_LEVEL_TEXT)
    return figure, axis


def _scale(line: Axis, set_limits: Callable[..., Any], values: np.ndarray) -> None:
    """Limits around all values, a tenth of the range but at least a quarter of a value away, and ticks between."""
    low, high = float(values.min()), float(values.max())
    margin = max(1.25, (high / low) ** 0.1)
    low, high = low / margin, high * margin
    set_limits(low, high)
    line.set_major_locator(FixedLocator(_ticks(low, high)))
    line.set_minor_locator(NullLocator())
    line.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))


def _ticks(low: float, high: float) -> list[float]:
    """Round numbers from low to high, as many as fit an axis."""
    decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    for steps in _DECADES:
        ticks = [float(f"{s}e{d}") for d in decades for s in steps if low <= s * 10.0**d <= high]
        if len(ticks) <= 9:
            return ticks
    return ticks
