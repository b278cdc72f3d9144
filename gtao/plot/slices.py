"""What a method looked at for one pixel: samples over the depth buffer, and the profile of each slice."""

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from gtao.errors import ShapeError

from .style import FAINT, INK, MUTED, NO_VALUE, ShownFigure, method_styles, styled

__all__ = ["depth_around", "slices"]

# Size of a profile in inches.
_WIDTH, _HEIGHT = 2.75, 2.5
_IMAGE = 4.5
# Texels shown beyond the outermost sample, and at least on every side of the pixel.
_MARGIN, _LEAST = 3, 10
_SIDE = (-1, 1)


@styled
def slices(inspection: Any, g: Any) -> Figure:
    """Samples of one pixel over the depth buffer, and beside it the profile of each slice.

    In the profiles the zenith (the view vector, unless the method chose another) points up and side 1 of the slice to
    the right; points are samples, rings those that the result stands on. Shaded is what they block: up to the horizons
    or, of bitmasks, the arcs of the samples that closed any sector; the strip below shows the sectors, open white.

    Args:
        inspection: what :func:`gtao.inspect_slices` returned.
        g: the :class:`gtao.GBuffer` that it was asked of.

    Returns:
        The figure.

    Raises:
        ShapeError: the pixel does not lie in the frame.
    """
    shown = inspection.slices
    columns = math.ceil(math.sqrt(len(shown)))
    rows = -(-len(shown) // columns)
    size = (_IMAGE + columns * _WIDTH, max(_IMAGE, rows * _HEIGHT))
    figure = ShownFigure(figsize=size, layout="constrained")
    grid = figure.add_gridspec(rows, columns + 1, width_ratios=[_IMAGE] + [_WIDTH] * columns)
    colours = [style["color"] for style in method_styles(str(k) for k in range(len(shown))).values()]
    _over_depth(figure.add_subplot(grid[:, 0]), inspection, g, colours)
    for k, (sl, colour) in enumerate(zip(shown, colours, strict=True)):
        axis = figure.add_subplot(grid[k // columns, 1 + k % columns])
        _profile(axis, sl, colour)
        if k % columns == 0:
            axis.set_ylabel("height (scene units)")
    return figure


def depth_around(axis: Axes, g: Any, x: int, y: int, left: int, right: int, top: int, bottom: int) -> None:
    """Draw the depth of columns ``left`` to ``right`` and rows ``top`` to ``bottom``, near bright, and mark the pixel.

    Raises:
        ShapeError: the pixel does not lie in the frame.
    """
    height, width = g.shape
    if not (0 <= x < width and 0 <= y < height):
        raise ShapeError(f"pixel ({x}, {y}) does not lie in the frame of {width}x{height}; pass its own frame")
    left, right, top, bottom = max(left, 0), min(right, width - 1), max(top, 0), min(bottom, height - 1)
    depth = np.array(g.view_z, dtype=float)[top : bottom + 1, left : right + 1]
    # Distances in the image grow with 1 / z, and so do what is seen of depths.
    near = np.ma.masked_invalid(1 / np.where(np.isfinite(depth), depth, np.nan))
    axis.set_facecolor(NO_VALUE)
    extent = (left - 0.5, right + 0.5, bottom + 0.5, top - 0.5)
    low, high = float(near.min()), float(near.max())
    # Not down to black, which marks would not be seen on.
    axis.imshow(near, cmap="gray", extent=extent, vmin=low - 0.6 * (high - low) - 1e-9, vmax=high)
    axis.grid(visible=False)
    axis.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    axis.yaxis.set_major_locator(MaxNLocator(6, integer=True))
    axis.plot([x], [y], marker="+", color=INK, markersize=11, markeredgewidth=2, zorder=6)


def _over_depth(axis: Axes, inspection: Any, g: Any, colours: list[Any]) -> None:
    x, y = inspection.x, inspection.y
    samples = [s for sl in inspection.slices for s in sl.samples]
    across = [abs(s.x - x) for s in samples]
    down = [abs(s.y - y) for s in samples]
    dx, dy = (math.ceil(max([_LEAST, *values])) + _MARGIN for values in (across, down))
    depth_around(axis, g, x, y, x - dx, x + dx, y - dy, y + dy)
    for sl, colour in zip(inspection.slices, colours, strict=True):
        (ux, uy), (back, ahead) = sl.direction, (r if math.isfinite(r) else 0.0 for r in sl.reach)
        axis.plot([x - ux * back, x + ux * ahead], [y - uy * back, y + uy * ahead], color=colour, linewidth=0.9)
        axis.plot([s.x for s in sl.samples], [s.y for s in sl.samples], "o", color=colour, markersize=4, zorder=4)
        best = [s for s in sl.samples if s.wins]
        ring = {"markerfacecolor": "none", "markeredgecolor": INK, "markersize": 8, "linestyle": "none", "zorder": 5}
        axis.plot([s.x for s in best], [s.y for s in best], marker="o", **ring)
    place = f"{type(inspection.method).__name__}, pixel ({x}, {y}), frame {inspection.frame_index}"
    axis.set_title(f"{place}: visibility {inspection.visibility:.3f}")


def _profile(axis: Axes, sl: Any, colour: Any) -> None:
    """Heights above the plane orthogonal to the zenith, over the distance within it."""
    seen = [s for s in sl.samples if math.isfinite(s.distance) and math.isfinite(s.cosine)]
    points = np.array([_place(s.side, s.cosine, s.distance) for s in seen]).reshape(-1, 2)
    # Far below or above lie samples beyond depth edges, which would make everything else small.
    across, up = np.abs(points).max(axis=0, initial=1e-9)
    limit = 1.15 * max(across, min(up, 2 * across))
    for side in (0, 1):
        for upper, lower in _blocked(sl, side):
            _wedge(axis, side, upper, lower, 2 * limit, colour)
        if sl.horizons is not None:
            tip = _place(side, sl.horizons[side][0], 2 * limit)
            axis.plot([0, tip[0]], [0, tip[1]], color=colour, linewidth=1.6)
        tip = _place(side, sl.tangent[side], 2 * limit)
        axis.plot([0, tip[0]], [0, tip[1]], color=MUTED, linewidth=0.9, linestyle=(0, (4, 2)))
    order = np.argsort(points[:, 0])
    axis.plot(*points[order].T, color=MUTED, linewidth=0.8)
    axis.plot(*points.T, "o", color=colour, markersize=3.5)
    best = np.array([p for p, s in zip(points, seen, strict=True) if s.wins]).reshape(-1, 2)
    axis.plot(*best.T, "o", markerfacecolor="none", markeredgecolor=INK, markersize=7)
    n_V, n_T = sl.normal
    length = 0.55 * limit / math.hypot(n_V, n_T)
    axis.annotate("", (n_T * length, n_V * length), (0, 0), arrowprops={"arrowstyle": "->", "color": INK})
    axis.set(xlim=(-limit, limit), ylim=(-0.9 * limit, limit), aspect="equal")
    axis.xaxis.set_major_locator(MaxNLocator(3))
    axis.yaxis.set_major_locator(MaxNLocator(3))
    axis.set_title(f"slice {sl.index}, {math.degrees(sl.azimuth) % 360:.0f}°: {sl.contribution:.3f}", color=colour)
    if sl.open_sectors is not None:
        strip = axis.inset_axes((0.0, 0.0, 1.0, 0.07))
        strip.imshow(np.array([sl.open_sectors], dtype=float), cmap="gray", vmin=-0.25, vmax=1, aspect="auto")
        strip.set(xticks=[], yticks=[])
        strip.spines[:].set(visible=True, color=FAINT)


def _blocked(sl: Any, side: int) -> list[tuple[float, float]]:
    """Pairs of cosines between which a side is shaded."""
    if sl.horizons is not None:
        upper, lower = sl.horizons[side]
        return [(upper, lower)] if upper > lower else []
    arcs = [arc for s in sl.samples if s.side == side and s.wins for arc in s.blocks]
    start = sl.tangent[side]
    return [(front, max(back, start)) for front, back in arcs if front > start]


def _place(side: int, cosine: float, distance: float) -> tuple[float, float]:
    return _SIDE[side] * distance * math.sqrt(max(0.0, 1 - cosine * cosine)), distance * cosine


def _wedge(axis: Axes, side: int, upper: float, lower: float, length: float, colour: Any) -> None:
    angles = np.linspace(math.acos(max(-1.0, min(upper, 1.0))), math.acos(max(-1.0, min(lower, 1.0))), 24)
    x, y = _SIDE[side] * length * np.sin(angles), length * np.cos(angles)
    axis.fill(np.append(x, 0), np.append(y, 0), color=colour, alpha=0.22, linewidth=0)
