"""Methods of specular occlusion: what a report is made of, and its figures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from gtao.errors import ConfigError, ShapeError

from .comparison import Comparison
from .comparison_images import error_limit, error_of, images_and_errors
from .images import displayed
from .lighting import LightingView
from .style import grid_shape, hide_unused, method_styles, new_figure, styled

__all__ = ["SpecularComparison", "SpecularView", "specular_curves", "specular_images", "specular_steps"]


@dataclass(frozen=True, kw_only=True)
class SpecularView:
    """Pictures of one frame under a white dome.

    Attributes:
        frame: its name.
        source: Where visibility and directions come from.
        roughness: Perceptual roughness of the surface.
        truth: (H, W) ray-traced occlusion.
        images: (H, W) occlusion by method.
        mask: (H, W) bool; the other pixels are drawn as background.
    """

    frame: str
    source: str
    roughness: float
    truth: Any
    images: Mapping[str, Any]
    mask: Any


@dataclass(frozen=True, kw_only=True)
class SpecularComparison:
    """Methods of specular occlusion against traced reflections on any number of frames.

    Attributes:
        tables: Roughness -> comparison under a white dome, whose scenes are the frames and whose groups are the sources
            of visibility.
        means: Source -> roughness -> method -> mean RMSE over the frames.
        steps: Roughness -> step of the error -> mean over the frames of the root mean square of what it changes.
        cones: Reflectance at normal incidence -> greatest tilt in degrees -> method -> RMSE where visibility is a cone.
        lit: Light -> roughness -> comparison of composites, whose "rmse" and "bias" are relative to the mean radiance.
        lit_means: Roughness -> group -> composite -> mean over light and frames of the relative RMSE.
        views, lit_views: Pictures.
        shown: Methods that curves show; all if empty.
        title: Heading of the report.
        command: Command line that repeats it.
        versions: Version by name.
        record: The JSON record of the run, shown folded; None for none.
        notes: Sentences to print at the top.
    """

    tables: Mapping[str, Comparison]
    means: Mapping[str, Mapping[str, Mapping[str, float]]]
    steps: Mapping[str, Mapping[str, float]]
    cones: Mapping[str, Mapping[str, Mapping[str, float]]] = field(default_factory=dict)
    lit: Mapping[str, Mapping[str, Comparison]] = field(default_factory=dict)
    lit_means: Mapping[str, Mapping[str, Mapping[str, float]]] = field(default_factory=dict)
    views: Sequence[SpecularView] = ()
    lit_views: Sequence[LightingView] = ()
    shown: Sequence[str] = ()
    title: str = "Specular occlusion"
    command: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)
    record: Mapping[str, Any] | None = None
    notes: Sequence[str] = ()

    def __post_init__(self) -> None:
        if not self.tables:
            raise ConfigError("there is no roughness to report; give at least one")


@styled
def specular_curves(
    means: Mapping[str, Mapping[str, Mapping[str, float]]], *, shown: Sequence[str] = (), title: str = ""
) -> Figure:
    """Error of every method against roughness, a panel for each source of visibility.

    Args:
        means: Source -> roughness -> method -> error.
        shown: Methods to draw, in this order; all if empty.
        title: Title.

    Raises:
        ShapeError: There is no error.
    """
    names = list(shown) or list(dict.fromkeys(m for rows in means.values() for row in rows.values() for m in row))
    if not means or not names:
        raise ShapeError("there are no errors to draw; give at least one source of visibility with one method")
    styles = method_styles(names)
    rows, columns = grid_shape(len(means), 2)
    figure, grid = new_figure(rows, columns, cell=(4.2, 3.0), sharey=True, sharex=True)
    for axis, (source, by_roughness) in zip(hide_unused(grid, len(means)), means.items(), strict=True):
        for name in names:
            points = [(float(r), row[name]) for r, row in by_roughness.items() if name in row]
            axis.plot(*zip(*points, strict=True), **styles[name], markersize=3.5, label=name)
        axis.set_title(source)
        axis.set(xlabel="roughness", ylim=(0, None))
    for axis in grid[:, 0]:
        axis.set_ylabel("RMSE of S")
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    figure.suptitle(title, fontweight="bold")
    return figure


@styled
def specular_steps(steps: Mapping[str, Mapping[str, float]]) -> Figure:
    """What each assumption changes, against roughness.

    Args:
        steps: Roughness -> step -> root mean square of the change.

    Raises:
        ShapeError: There is no step.
    """
    names = list(dict.fromkeys(name for row in steps.values() for name in row))
    if not names:
        raise ShapeError("there are no steps to draw; give at least one")
    styles = method_styles(names)
    figure, grid = new_figure(1, 1, cell=(7.4, 3.6))
    axis = grid[0, 0]
    for name in names:
        points = [(float(r), row[name]) for r, row in steps.items() if name in row]
        axis.plot(*zip(*points, strict=True), **styles[name], markersize=3.5, label=name)
    axis.set(xlabel="roughness", ylabel="RMS of the change of S", ylim=(0, None))
    figure.legend(loc="outside right center")
    figure.suptitle("Where errors come from", fontweight="bold")
    return figure


def specular_images(view: SpecularView, *, limit: float | None = None) -> Figure:
    """A frame under a white dome: the truth and every method above, what they miss it by below.

    Args:
        view: The pictures.
        limit: Error at the ends of the scale; the 99th percentile of all if left out.

    Returns:
        The figure: occlusion from 0 (black) to 1 (white), errors blue too dark, red too bright.

    Raises:
        ShapeError: There is no method, or an image of another shape.
    """
    if not view.images:
        raise ShapeError("there is no image to draw beside the truth; give at least one")
    errors = {name: error_of(image, view.truth, view.mask) for name, image in view.images.items()}
    mask = np.asarray(view.mask, dtype=bool)
    shown = {"ray-traced": view.truth, **view.images}
    pictures = {name: displayed(np.where(mask, image, np.nan), (0.0, 1.0)) for name, image in shown.items()}
    top = error_limit(errors) if limit is None else limit
    title = f"{view.frame}, roughness {view.roughness:g}, {view.source}"
    return images_and_errors(pictures, errors, top, title=title, label="estimate − truth")
