"""Images and error maps of several methods beside each other, on one scale."""

import textwrap
from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from gtao.errors import ShapeError

from .images import image_row
from .style import INK, MUTED, NO_VALUE, SIGNED, ShownFigure, grid_shape, hide_unused, styled
from .words import number

__all__ = [
    "comparison_images",
    "error_budget_maps",
    "error_limit",
    "error_of",
    "images_and_errors",
    "signed_error_maps",
]

#: Height of a map in inches, columns of a figure, and letters that fit on top of one inch.
_HEIGHT, _COLUMNS, _LETTERS = 2.3, 3, 13
#: Height where many stand in a row.
_LOW = 1.9


def error_of(image: Any, truth: Any, mask: Any = None) -> np.ndarray:
    """What a signed error map shows: (H, W) image minus truth, NaN outside the mask.

    Raises:
        ShapeError: The images differ in shape, or are none.
    """
    a, b = np.asarray(image, dtype=float), np.asarray(truth, dtype=float)
    keep = np.ones(a.shape, bool) if mask is None else np.asarray(mask, dtype=bool)
    if a.ndim != 2 or not a.shape == b.shape == keep.shape:
        raise ShapeError(f"image {a.shape}, truth {b.shape} and mask {keep.shape} must all be the same (H, W)")
    return np.where(keep, a - b, np.nan)


def error_limit(errors: Mapping[str, np.ndarray], percentile: float = 99.0) -> float:
    """A common end for the scales of error maps: the percentile of all absolute errors together.

    Args:
        errors: Signed errors by name; NaN for no value.
        percentile: Share of the pixels, in percent, that the scale holds.

    Returns:
        The limit, positive also where nothing is wrong anywhere.
    """
    values = np.concatenate([np.abs(e[np.isfinite(e)]) for e in errors.values()] or [np.zeros(0)])
    return (float(np.percentile(values, percentile)) if values.size else 0.0) or 1.0


def comparison_images(
    truth: Any, images: Mapping[str, Any], *, mask: Any = None, columns: int = 4, reference: str = "ray-traced truth"
) -> Figure:
    """The truth and the images of several methods, all on the scale from 0 (black) to 1 (white).

    Args:
        truth: (H, W) visibility.
        images: (H, W) visibility by label.
        mask: (H, W) bool; the other pixels are drawn as background.
        columns: Images in a row.
        reference: Title of the first image.

    Returns:
        The figure.

    Raises:
        ShapeError: The images differ in shape.
    """
    shown = {reference: truth, **images}
    values = [error_of(image, np.zeros_like(image), mask) for image in shown.values()]
    if len({value.shape for value in values}) > 1:
        raise ShapeError(f"the images have different shapes: {[value.shape for value in values]}")
    height, width = values[0].shape
    letters = round(2.6 * width / height * _LETTERS)
    return image_row(values, [textwrap.fill(name, letters) for name in shown], columns=columns)


def signed_error_maps(
    truth: Any,
    images: Mapping[str, Any],
    *,
    mask: Any = None,
    limit: float | None = None,
    captions: Mapping[str, str] | None = None,
) -> Figure:
    """Image minus truth of several methods, on one diverging scale: blue too dark, red too bright, white right.

    Args:
        truth: (H, W) visibility.
        images: (H, W) visibility by label.
        mask: (H, W) bool; the other pixels are drawn as background.
        limit: Error at the ends of the scale; the 99th percentile of all absolute errors together if left out.
        captions: A second line below the title, by label.

    Returns:
        The figure.

    Raises:
        ShapeError: The images differ in shape, or there are none.
    """
    errors = {name: error_of(image, truth, mask) for name, image in images.items()}
    return _maps(errors, limit, captions or {}, "estimate − truth")


def error_budget_maps(budget: Any, *, limit: float | None = None, title: str = "") -> Figure:
    """Every step of an error budget as a map, and their sum, on one scale.

    Args:
        budget: A :class:`gtao.evaluate.ErrorBudget`.
        limit: Difference at the ends of the scale; the 99th percentile of all if left out.
        title: Title above all maps.

    Returns:
        One map per step and, where there are several, the total, with root mean squares and means. What is called noise
        is left in the maps and taken out of the numbers.
    """
    maps = dict(zip(budget.names, budget.images, strict=True))
    squares = [*budget.mean_squares, budget.total]
    biases = [*budget.biases, float(np.sum(budget.biases))]
    if len(maps) > 1:
        maps["all together"] = np.sum(budget.images, axis=0)
    captions = {
        name: f"RMS {np.sqrt(max(square, 0.0)):.4f}, mean {number(bias, '+.4f')}"
        for name, square, bias in zip(maps, squares, biases, strict=False)
    }
    return _maps(maps, limit, captions, "step: after − before", title)


@styled
def images_and_errors(
    pictures: Mapping[str, np.ndarray], errors: Mapping[str, np.ndarray], limit: float, *, title: str, label: str
) -> Figure:
    """The truth and every method above, what they miss it by below.

    Args:
        pictures: (H, W, …) images to show as they are, by name, the truth first.
        errors: (H, W) signed errors of the others, NaN for no value.
        limit: Error at the ends of the scale.
        title: Title above all.
        label: What the errors are.
    """
    height, width = next(iter(pictures.values())).shape[:2]
    inches = max(_LOW * width / height, 1.3)
    columns = len(pictures)
    figure = ShownFigure(figsize=(inches * columns, 2 * _LOW + 1.1), layout="constrained")
    axes = np.asarray(figure.subplots(2, columns, squeeze=False))
    for axis in axes.flat:
        axis.set(xticks=[], yticks=[], facecolor=NO_VALUE)
        axis.grid(visible=False)
        axis.spines[:].set_visible(False)
    for axis, (name, picture) in zip(axes[0], pictures.items(), strict=True):
        axis.imshow(picture, interpolation="nearest")
        axis.set_title(textwrap.fill(name, max(round(inches * _LETTERS), 12)), color=INK)
    axes[1, 0].set_axis_off()
    drawn = None
    for axis, error in zip(axes[1, 1:], errors.values(), strict=True):
        drawn = axis.imshow(np.ma.masked_invalid(error), cmap=SIGNED, vmin=-limit, vmax=limit, interpolation="nearest")
        root = float(np.sqrt(np.nanmean(error**2)))
        axis.set_xlabel(f"RMSE {root:.3f}, mean {np.nanmean(error):+.3f}", color=MUTED, fontsize=7.5, loc="left")
    figure.colorbar(drawn, ax=axes[1, 1:], label=label, extend="both", location="bottom", aspect=60, shrink=0.6)
    figure.suptitle(title, fontweight="bold")
    return figure


@styled
def _maps(
    errors: Mapping[str, np.ndarray], limit: float | None, captions: Mapping[str, str], label: str, title: str = ""
) -> Figure:
    if not errors:
        raise ShapeError("there is no error map to draw; give at least one image")
    top = error_limit(errors) if limit is None else limit
    height, width = next(iter(errors.values())).shape
    rows, columns = grid_shape(len(errors), _COLUMNS)
    inches = _HEIGHT * width / height
    titles = {name: textwrap.fill(name, max(round(inches * _LETTERS), 12)) for name in errors}
    lines = max(title.count("\n") + 1 for title in titles.values())
    cell = _HEIGHT + 0.17 * lines + (0.2 if captions else 0.0) + 0.12
    figure = ShownFigure(
        figsize=(max(inches * columns, 4.0), cell * rows + 0.7 + 0.3 * bool(title)), layout="constrained"
    )
    figure.get_layout_engine().set(  # pyright: ignore[reportOptionalMemberAccess]  (it was given above)
        h_pad=0.06, hspace=0.04
    )
    axes = np.asarray(figure.subplots(rows, columns, squeeze=False))
    image = None
    for axis, (name, error) in zip(hide_unused(axes, len(errors)), errors.items(), strict=True):
        axis.set_facecolor(NO_VALUE)
        image = axis.imshow(np.ma.masked_invalid(error), cmap=SIGNED, vmin=-top, vmax=top)
        axis.set(xticks=[], yticks=[])
        axis.grid(visible=False)
        axis.spines[:].set_visible(False)
        axis.set_title(titles[name], color=INK)
        axis.set_xlabel(captions.get(name, ""), color=MUTED, fontsize=8, loc="left")
    figure.suptitle(title, fontweight="bold")
    figure.colorbar(image, ax=axes, label=label, extend="both", location="bottom", aspect=45, shrink=0.7)
    return figure
