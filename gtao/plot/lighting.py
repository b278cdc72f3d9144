"""Methods of irradiance under several kinds of light: what a report is made of, and its figures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from gtao.errors import ConfigError, ShapeError

from .comparison import Comparison
from .comparison_images import error_limit, images_and_errors
from .images import displayed
from .style import MUTED, grid_shape, hide_unused, method_styles, new_figure, styled

__all__ = ["LightingComparison", "LightingView", "lighting_bars", "lighting_images"]

#: Percentile of the true radiance that is drawn white.
_WHITE = 98.0
#: Of the luminance of linear RGB (Rec. 709).
_LUMINANCE = (0.2126, 0.7152, 0.0722)


@dataclass(frozen=True, kw_only=True)
class LightingView:
    """Pictures of one frame under one light.

    Attributes:
        frame, light: their names.
        source: Where visibility and directions come from.
        truth: (H, W, 3) ray-traced radiance, linear RGB.
        images: (H, W, 3) radiance by method.
        mask: (H, W) bool; the other pixels are drawn as background.
    """

    frame: str
    light: str
    source: str
    truth: Any
    images: Mapping[str, Any]
    mask: Any


@dataclass(frozen=True, kw_only=True)
class LightingComparison:
    """Methods of irradiance against ray-traced light on any number of frames.

    Attributes:
        tables: Light -> what it is cut to -> comparison whose scenes are the frames, whose groups are the sources of
            visibility, and whose "rmse" and "bias" are relative to the mean irradiance.
        means: What the light is cut to -> source -> method -> mean over light and frames of the relative RMSE.
        views: Pictures.
        title: Heading of the report.
        command: Command line that repeats it.
        versions: Version by name.
        record: The JSON record of the run, shown folded; None for none.
        notes: Sentences to print at the top.
    """

    tables: Mapping[str, Mapping[str, Comparison]]
    means: Mapping[str, Mapping[str, Mapping[str, float]]]
    views: Sequence[LightingView] = ()
    title: str = "Directional occlusion under light"
    command: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)
    record: Mapping[str, Any] | None = None
    notes: Sequence[str] = ()

    def __post_init__(self) -> None:
        if not self.tables:
            raise ConfigError("there is no light to report; give at least one")


@styled
def lighting_bars(
    errors: Mapping[str, Mapping[str, Mapping[str, float]]],
    *,
    title: str = "",
    ours: Sequence[str] = (),
    label: str = "RMSE / mean irradiance",
) -> Figure:
    """Error of every method, side by side for several kinds of light.

    Args:
        errors: Kind of light -> series, such as the source of visibility -> method -> error.
        title: Title.
        ours: Methods whose names are emphasised.
        label: What the errors are.

    Returns:
        One panel per kind of light, two in a row, with one bar per method and series; methods in the order of the first
        series of the first panel, the lowest error on top, equal ones by name.

    Raises:
        ShapeError: There is no error.
    """
    series = {kind: {name: values for name, values in sources.items() if values} for kind, sources in errors.items()}
    if not series or not all(series.values()):
        raise ShapeError("there are no errors to draw; give at least one method for every kind of light")
    first = next(iter(series.values()))
    order = sorted({m for values in first.values() for m in values}, key=lambda m: (_first(first, m), m))
    names = list(first)
    styles = method_styles(names)
    thick = 0.8 / len(names)
    rows, columns = grid_shape(len(series), 2)
    figure, grid = new_figure(rows, columns, cell=(4.4, 0.9 + 0.1 * (len(names) + 1) * len(order)), sharey=True)
    for axis, (kind, sources) in zip(hide_unused(grid, len(series)), series.items(), strict=True):
        top = max(v for values in sources.values() for v in values.values())
        for i, name in enumerate(names):
            values = sources.get(name, {})
            places = [y for y, m in enumerate(order) if m in values]
            bars = [values[order[y]] for y in places]
            at = np.array(places) + (i - (len(names) - 1) / 2) * thick
            axis.barh(at, bars, 0.92 * thick, color=styles[name]["color"], label=name, linewidth=0)
            for y, value in zip(at, bars, strict=True):
                axis.annotate(f"{value:.3f}", (value, y), xytext=(3, 0), textcoords="offset points", va="center",
                              fontsize=6.5, color=MUTED)  # fmt: skip
        axis.set(xlim=(0, 1.16 * top or 1.0), xlabel=label)
        axis.set_title(kind)
        axis.grid(visible=False, axis="y")
    grid[0, 0].set(yticks=range(len(order)), yticklabels=order, ylim=(len(order) - 0.4, -0.6))
    for label in (label for axis in grid[:, 0] for label in axis.get_yticklabels()):
        label.set_fontweight("bold" if label.get_text() in ours else "normal")
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(len(names), 3))
    figure.suptitle(title, fontweight="bold")
    return figure


@styled
def lighting_images(view: LightingView, *, limit: float | None = None) -> Figure:
    """A frame under a light: the truth and every method above, what they miss it by below.

    Args:
        view: The pictures.
        limit: Error at the ends of the scale, relative to the mean radiance; the 99th percentile of all if left out.

    Returns:
        The figure: images in display encoding, the 98th percentile of the truth white; errors in luminance,
        blue too dark, red too bright.

    Raises:
        ShapeError: There is no method, or an image of another shape.
    """
    if not view.images:
        raise ShapeError("there is no image to draw beside the truth; give at least one")
    truth = np.asarray(view.truth, dtype=float)
    mask = np.asarray(view.mask, dtype=bool)
    images = {name: np.asarray(image, dtype=float) for name, image in view.images.items()}
    for name, image in images.items():
        if image.shape != truth.shape or image.ndim != 3:
            raise ShapeError(f"{name} has shape {image.shape} and the truth {truth.shape}; both must be (H, W, 3)")
    mean = float((truth @ _LUMINANCE)[mask].mean()) or 1.0
    white = float(np.percentile(truth[mask].max(-1), _WHITE)) or 1.0
    errors = {name: np.where(mask, (image - truth) @ _LUMINANCE / mean, np.nan) for name, image in images.items()}
    top = error_limit(errors) if limit is None else limit
    shown = {"ray-traced": truth, **images}
    pictures = {
        name: displayed(np.where(mask[..., None], image, np.nan), (0.0, white)) for name, image in shown.items()
    }
    title = f"{view.frame} under {view.light}, {view.source}"
    return images_and_errors(pictures, errors, top, title=title, label="(estimate − truth) / mean")


def _first(sources: Mapping[str, Mapping[str, float]], method: str) -> float:
    """Error of a method in the first series that has it."""
    return next(values[method] for values in sources.values() if method in values)
