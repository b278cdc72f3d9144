"""The weights of a spatial filter about one pixel."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from .slices import depth_around
from .style import DENSITY, INK, PUBLISHED, new_figure, styled

__all__ = ["filter_weights"]

# Numbers are written into the cells of footprints up to this size.
_WRITTEN = 9


@styled
def filter_weights(weights: Any, g: Any) -> Figure:
    """Depth around a pixel, and what the filter multiplies each neighbour by.

    Args:
        weights: what :func:`gtao.filter_weights` returned.
        g: the :class:`gtao.GBuffer` that it was asked of.

    Returns:
        The figure.

    Raises:
        ShapeError: the pixel does not lie in the frame.
    """
    values = np.array(weights.weights)
    x, y, reach = weights.x, weights.y, len(values) // 2
    figure, grid = new_figure(1, 2, cell=(3.4, 3.3))
    window = (x - reach, x + reach, y - reach, y + reach)
    depth_around(grid[0, 0], g, x, y, *window)
    grid[0, 0].set_title(f"depth around ({x}, {y})")
    axis = grid[0, 1]
    extent = (window[0] - 0.5, window[1] + 0.5, window[3] + 0.5, window[2] - 0.5)
    axis.imshow(values, cmap=DENSITY, vmin=0, vmax=max(values.max(), 1e-9), extent=extent)
    axis.grid(visible=False)
    axis.set(xticks=[x - reach, x, x + reach], yticks=[y - reach, y, y + reach])
    if len(values) <= _WRITTEN:
        for (row, column), value in np.ndenumerate(values):
            if value != 0:
                colour = PUBLISHED if value < 0 else "white" if value > 0.55 * values.max() else INK
                place = (window[0] + column, window[2] + row)
                axis.annotate(f"{100 * value:.3g}", place, ha="center", va="center", fontsize=7, color=colour)
    axis.set_title(f"{type(weights.spatial).__name__}, frame {weights.frame_index}: weights in %")
    return figure
