"""One look for all figures: Okabe and Ito's colour-blind-safe palette, thin axes, no state outside the figure."""

import io
from collections.abc import Callable, Iterable, Sequence
from functools import wraps
from typing import Any, TypeVar

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

__all__ = [
    "BEHIND_TEXT",
    "CLOSED_FORM",
    "DENSITY",
    "INK",
    "MUTED",
    "NO_VALUE",
    "OTHER",
    "PUBLISHED",
    "REFIT",
    "SIGNED",
    "ShownFigure",
    "albedo_colours",
    "grid_shape",
    "hide_unused",
    "method_styles",
    "new_figure",
    "png_bytes",
    "styled",
]

#: Okabe and Ito 2008, "Color Universal Design": blue, vermilion, bluish green, reddish purple.
REFIT, PUBLISHED, CLOSED_FORM, OTHER = "#0072B2", "#D55E00", "#009E73", "#CC79A7"

#: Lines of methods, in order: their palette without the yellow, which is too light for a line, and with a brown.
_CYCLE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#8c5109", "#6b7480")
_MARKERS = ("o", "s", "D", "^", "v", "P", "X")

INK, MUTED, FAINT = "#22262b", "#6b7480", "#e3e6ea"

#: Background and other pixels without a value.
NO_VALUE = "#c9d3de"

#: Number of samples: white where there are none.
DENSITY = LinearSegmentedColormap.from_list("gtao_density", ["#ffffff", "#c3cbd4", "#7c8794", "#39424d"])

#: Signed errors: blue too dark, red too bright, white right. An odd number of colours has one in the middle.
SIGNED = LinearSegmentedColormap.from_list(
    "gtao_signed", ["#054a91", "#6ba3d6", "#f7f7f7", "#e58a5b", "#8f2d06"], N=257
)

#: Box that keeps lines from running through a text.
BEHIND_TEXT: dict[str, Any] = {"facecolor": "white", "alpha": 0.92, "edgecolor": "none", "pad": 0.8}

_STYLE = {
    "figure.facecolor": "white",
    "figure.dpi": 100,
    "savefig.facecolor": "white",
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9,
    "axes.labelcolor": INK,
    "axes.edgecolor": MUTED,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": FAINT,
    "grid.linewidth": 0.7,
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "lines.linewidth": 1.6,
    "lines.solid_capstyle": "round",
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "image.interpolation": "nearest",
}

F = TypeVar("F", bound=Callable[..., Figure])


def styled(draw: F) -> F:
    """Draw in the style of the house and leave the user's own settings as they were."""

    @wraps(draw)
    def inside(*args: Any, **kwargs: Any) -> Figure:
        with mpl.rc_context(_STYLE):
            return draw(*args, **kwargs)

    return inside  # pyright: ignore[reportReturnType]  (a wrapper has its function's signature)


class ShownFigure(Figure):
    """A figure that shows itself in a notebook, with no backend chosen."""

    def _repr_png_(self) -> bytes:
        return png_bytes(self)


def png_bytes(figure: Figure, dpi: int = 110) -> bytes:
    """The figure as a PNG file, the same bytes each time."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi, metadata={"Software": None})
    return buffer.getvalue()


def new_figure(rows: int, columns: int, *, cell: tuple[float, float], **kwargs: Any) -> tuple[Figure, np.ndarray]:
    """A figure that belongs to no window, and its axes, (rows, columns).

    Args:
        rows: Rows of axes.
        columns: Columns of axes.
        cell: Width and height of one of them in inches.
        **kwargs: To ``Figure.subplots``.

    Returns:
        Figure and axes.
    """
    figure = ShownFigure(figsize=(cell[0] * columns, cell[1] * rows), layout="constrained")
    return figure, np.asarray(figure.subplots(rows, columns, squeeze=False, **kwargs))


def grid_shape(n: int, columns: int) -> tuple[int, int]:
    """Rows and columns for n cells, at most ``columns`` wide."""
    columns = min(columns, n)
    return -(-n // columns), columns


def hide_unused(axes: np.ndarray, used: int) -> list[Axes]:
    """Switch the axes beyond the first ``used`` off; returns those in use."""
    for axis in axes.flat[used:]:
        axis.set_axis_off()
    return list(axes.flat[:used])


def albedo_colours(albedos: np.ndarray) -> list[tuple[float, float, float, float]]:
    """A colour per albedo, dark to bright with equal steps of lightness."""
    scale = mpl.colormaps["viridis"]
    return [scale(0.05 + 0.85 * float(albedo)) for albedo in albedos]


def method_styles(labels: Iterable[str], ours: Sequence[str] = ()) -> dict[str, dict[str, Any]]:
    """A colour and a marker per label, in order; after the eighth the colours repeat with other markers and dashes."""
    styles = {}
    for i, label in enumerate(labels):
        turn = i // len(_CYCLE)
        styles[label] = {
            "color": _CYCLE[i % len(_CYCLE)],
            "marker": _MARKERS[i % len(_MARKERS)],
            "linestyle": ("-", (0, (4, 1.5)), (0, (1.5, 1.2)))[turn % 3],
            "linewidth": 2.6 if label in ours else 1.3,
            "zorder": 4 if label in ours else 3,
        }
    return styles
