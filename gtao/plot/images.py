"""Rows of images, for the README, notebooks and reports."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from gtao.errors import ShapeError

from .style import INK, NO_VALUE, SIGNED, ShownFigure, grid_shape, hide_unused, new_figure, styled

__all__ = ["displayed", "error_map", "image_row", "visibility_image"]

#: Height of an image in inches.
_HEIGHT = 2.6


@styled
def image_row(
    images: Sequence[Any],
    titles: Sequence[str] = (),
    *,
    limits: tuple[float, float] = (0.0, 1.0),
    columns: int = 6,
) -> Figure:
    """Images side by side, in display encoding.

    Args:
        images: (H, W) or (H, W, 3), linear values; anything NumPy can view. Values outside the limits are clipped,
            NaN and infinity are drawn in a neutral colour.
        titles: One per image, or none.
        limits: Values that become black and white.
        columns: Images in a row; more of them go into further rows.

    Returns:
        The figure.

    Raises:
        ShapeError: No image, an image of another shape, or another number of titles.
    """
    if len(images) == 0:
        raise ShapeError("there is no image to draw; give at least one")
    if titles and len(titles) != len(images):
        raise ShapeError(f"got {len(titles)} titles for {len(images)} images; give one each, or none")
    pixels = [displayed(image, limits) for image in images]
    rows, columns = grid_shape(len(pixels), columns)
    ratios = [p.shape[1] / p.shape[0] for p in pixels]
    widths = [max(ratios[column::columns]) for column in range(columns)]
    lines = max((title.count("\n") + 1 for title in titles), default=0)
    height = rows * (_HEIGHT + (0.12 + 0.18 * lines if titles else 0))
    figure = ShownFigure(figsize=(_HEIGHT * sum(widths), height), layout="constrained")
    axes = np.asarray(figure.subplots(rows, columns, width_ratios=widths, squeeze=False))
    for i, (axis, shown) in enumerate(zip(hide_unused(axes, len(pixels)), pixels, strict=True)):
        axis.imshow(shown, interpolation="nearest")
        axis.set_axis_off()
        if titles:
            axis.set_title(titles[i], color=INK)
    return figure


def visibility_image(visibility: ArrayLike, title: str = "") -> Figure:
    """One visibility image (H, W): black is closed, white is open; see :func:`image_row`."""
    return image_row([visibility], [title] if title else [])


@styled
def error_map(error: ArrayLike, title: str = "", *, limit: float | None = None, label: str = "error") -> Figure:
    """A signed error image with its scale.

    Args:
        error: (H, W) estimate minus truth: blue where too dark, red where too bright; NaN for no value.
        title: Title.
        limit: Error at the ends of the scale, positive; the largest absolute error if left out.
        label: What the scale shows.

    Returns:
        The figure.

    Raises:
        ShapeError: Not an image, or without any finite value.
    """
    values = np.asarray(error, dtype=float)
    if values.ndim != 2 or not np.isfinite(values).any():
        raise ShapeError(f"error must be an (H, W) image with finite values, got shape {values.shape}")
    shown = np.ma.masked_invalid(values)
    top = float(np.abs(shown).max()) if limit is None else limit
    figure, grid = new_figure(1, 1, cell=(_HEIGHT * values.shape[1] / values.shape[0] + 0.9, _HEIGHT + 0.3))
    axis = grid[0, 0]
    axis.set_facecolor(NO_VALUE)
    image = axis.imshow(shown, cmap=SIGNED, vmin=-top or -1, vmax=top or 1)
    axis.set(xticks=[], yticks=[], title=title)
    axis.grid(visible=False)
    figure.colorbar(image, ax=axis, label=label, extend="neither" if limit is None else "both")
    return figure


def displayed(image: Any, limits: tuple[float, float]) -> np.ndarray:
    """8-bit sRGB pixels, (H, W, 3)."""
    values = np.asarray(image, dtype=float)
    if values.ndim == 2:
        values = np.repeat(values[..., None], 3, axis=-1)
    if values.ndim != 3 or values.shape[2] != 3:
        raise ShapeError(f"an image must be (H, W) or (H, W, 3), got {values.shape}")
    finite = np.isfinite(values).all(axis=-1, keepdims=True)
    linear = np.clip((np.where(finite, values, 0.0) - limits[0]) / (limits[1] - limits[0]), 0, 1)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    neutral = np.array([int(NO_VALUE[i : i + 2], 16) for i in (1, 3, 5)])
    return np.where(finite, np.rint(255 * encoded), neutral).astype(np.uint8)
