"""Methods on moving images: what a report is made of, its curves, and the pictures of a video."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from PIL import Image, ImageDraw, ImageFont

from gtao.errors import ConfigError, ShapeError

from .images import displayed
from .style import NO_VALUE, grid_shape, hide_unused, method_styles, new_figure, styled

__all__ = [
    "ANIMATION_PALETTE",
    "AnimatedMethod",
    "AnimationComparison",
    "animation_curves",
    "error_pixels",
    "video_frame",
    "visibility_pixels",
]

_ERRORS = mpl.colormaps["magma"]
#: A GIF's colours: every second grey and the scale of errors, so that no frame needs colours of its own.
ANIMATION_PALETTE = np.concatenate(
    [np.repeat(np.arange(0, 256, 2)[:, None], 3, axis=1), _ERRORS(np.linspace(0, 1, 128), bytes=True)[:, :3]]
).astype(np.uint8)

#: Pixels of a video: the least width of a panel, the gap between two, the height of a line, the size of letters.
_WIDTH, _GAP, _LINE, _LETTERS = 240, 4, 17, 13
_STRIP, _PAPER, _TEXT, _FAINT = 2 * _LINE + 6, 24, 236, 164

#: Frames up to which curves have markers.
_MARKED = 16
#: What a panel of curves shows: title, and label of the axis.
_PANELS = {
    "rmse": ("error of each frame", "RMSE"),
    "bias": ("bias of each frame", "mean of estimate − truth"),
    "step": ("flicker: change along the motion", "RMS of what the truth does not do"),
    "lag": ("ghosts: lag in the trail of what has moved", "mean of how far behind"),
}


@dataclass(frozen=True, kw_only=True)
class AnimatedMethod:
    """One method on one animation.

    Attributes:
        name: Of the method.
        video: Name of its video beside the report.
        curves: Quantity -> its value in every frame, NaN where there is none: "rmse", "bias", "step", "lag".
        numbers: Quantity -> its value over the whole animation; None where there is none.
        settings: What it is, as text.
    """

    name: str
    video: str
    curves: Mapping[str, Sequence[float]]
    numbers: Mapping[str, float | None]
    settings: str = ""


@dataclass(frozen=True, kw_only=True)
class AnimationComparison:
    """Methods on one animation against its ray-traced truth, frame by frame.

    Attributes:
        name: Of the animation.
        description: One line about it.
        methods: What was measured.
        n_frames: Frames.
        fps: Frames per second of the videos.
        radius: Reach of occluders in scene units.
        cut: First frame after a cut, or None.
        error_limit: |error| at the bright end of the scale of the videos.
        title: Heading of the report.
        command: Command line that repeats it.
        versions: Version by name.
        record: The JSON record of the run, shown folded; None for none.
        notes: Sentences to print at the top.

    Raises:
        ConfigError: There is no method.
    """

    name: str
    description: str
    methods: Sequence[AnimatedMethod]
    n_frames: int
    fps: float
    radius: float
    cut: int | None = None
    error_limit: float = 0.25
    title: str = "Animation"
    command: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)
    record: Mapping[str, Any] | None = None
    notes: Sequence[str] = ()

    def __post_init__(self) -> None:
        if not self.methods:
            raise ConfigError("there is no method to report; give at least one")


def visibility_pixels(visibility: Any, mask: Any) -> np.ndarray:
    """Visibility as sRGB pixels, (H, W, 3) uint8: black is closed, white is open, a neutral colour outside the mask.

    Args:
        visibility: (H, W), clipped to [0, 1].
        mask: (H, W) bool.
    """
    return displayed(np.where(np.asarray(mask, dtype=bool), np.asarray(visibility, dtype=float), np.nan), (0.0, 1.0))


def error_pixels(image: Any, truth: Any, mask: Any, limit: float) -> np.ndarray:
    """|image - truth| as pixels, (H, W, 3) uint8, from dark (none) to bright (``limit`` and more).

    Args:
        image: (H, W) visibility.
        truth: (H, W) visibility.
        mask: (H, W) bool; the other pixels are drawn as background.
        limit: Error at the end of the scale, positive.
    """
    error = np.abs(np.asarray(image, dtype=float) - np.asarray(truth, dtype=float))
    keep = np.asarray(mask, dtype=bool)
    pixels = _ERRORS(np.clip(np.where(keep, error, 0.0) / limit, 0, 1), bytes=True)[..., :3]
    neutral = [int(NO_VALUE[i : i + 2], 16) for i in (1, 3, 5)]
    return np.where(keep[..., None], pixels, neutral).astype(np.uint8)


def video_frame(
    truth: np.ndarray, result: np.ndarray, error: np.ndarray, *, name: str, frame: int, rmse: float, limit: float
) -> np.ndarray:
    """Truth, result and |error| side by side below a strip that says what they are.

    Args:
        truth, result: (H, W, 3) uint8, from :func:`visibility_pixels`.
        error: (H, W, 3) uint8, from :func:`error_pixels`.
        name: Of the method.
        frame: Index of the frame.
        rmse: Its error.
        limit: |error| at the bright end of the scale.

    Returns:
        (H', W', 3) uint8. Small images are enlarged by a whole factor, so that the words have room.

    Raises:
        ShapeError: The images differ in shape.
    """
    if not truth.shape == result.shape == error.shape:
        raise ShapeError(f"the images have different shapes: {truth.shape}, {result.shape}, {error.shape}")
    factor = max(-(-_WIDTH // truth.shape[1]), 1)
    panels = [np.repeat(np.repeat(image, factor, axis=0), factor, axis=1) for image in (truth, result, error)]
    height, width = panels[0].shape[:2]
    gap = np.full((height, _GAP, 3), _PAPER, np.uint8)
    pictures = np.concatenate([panels[0], gap, panels[1], gap, panels[2]], axis=1)
    strip = Image.new("RGB", (pictures.shape[1], _STRIP), (_PAPER,) * 3)
    draw = ImageDraw.Draw(strip)
    words = (("ray-traced truth", f"frame {frame}"), _two_lines(name, width - 8), (f"|error|, RMSE {rmse:.4f}", ""))
    for i, (first, second) in enumerate(words):
        left = i * (width + _GAP) + 4
        draw.text((left, 2), first, font=_font(), fill=(_TEXT,) * 3)
        draw.text((left, 2 + _LINE), second, font=_font(), fill=(_FAINT,) * 3)
    _scale(draw, 2 * (width + _GAP) + 4, width - 8, limit)
    return np.concatenate([np.asarray(strip), pictures])


@cache
def _font() -> ImageFont.FreeTypeFont:
    """The font that comes with Matplotlib, so that letters are the same everywhere."""
    return ImageFont.truetype(str(Path(mpl.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"), _LETTERS)


def _two_lines(name: str, width: float) -> tuple[str, str]:
    """A name, its options on the second line where they do not fit on the first."""
    if _font().getlength(name) <= width:
        return name, ""
    first, _, rest = name.partition(",")
    return _fitting(first, width), _fitting(rest, width)


def _fitting(text: str, width: float) -> str:
    """The text, its end cut off where it is too long."""
    if _font().getlength(text) <= width:
        return text
    kept = next(n for n in range(len(text), -1, -1) if _font().getlength(text[:n] + "…") <= width or n == 0)
    return text[:kept] + "…"


def _scale(draw: ImageDraw.ImageDraw, left: int, width: int, limit: float) -> None:
    """A bar of the error's colours with its ends."""
    start, end = "0", f"{limit:g}"
    first, last = (round(_font().getlength(text)) + 5 for text in (start, end))
    bar = range(left + first, left + width - last)
    top, fill = 2 + _LINE, (_FAINT,) * 3
    draw.text((left, top), start, font=_font(), fill=fill)
    draw.text((bar.stop + 5, top), end, font=_font(), fill=fill)
    for x in bar:
        colour = _ERRORS((x - bar.start) / max(len(bar) - 1, 1), bytes=True)[:3]
        draw.line([(x, top + 4), (x, top + _LETTERS - 1)], fill=tuple(map(int, colour)))


@styled
def animation_curves(comparison: AnimationComparison) -> Figure:
    """What every method does from frame to frame; a panel for each quantity that any of them has.

    Args:
        comparison: What was measured.

    Raises:
        ShapeError: There is no curve.
    """
    methods = comparison.methods
    kinds = [k for k in _PANELS if any(np.isfinite(m.curves.get(k, ())).any() for m in methods)]
    if not kinds:
        raise ShapeError("there are no curves to draw; give at least one")
    styles = method_styles(m.name for m in methods)
    rows, columns = grid_shape(len(kinds), 2)
    figure, grid = new_figure(rows, columns, cell=(4.6, 2.9), sharex=True)
    for axis, kind in zip(hide_unused(grid, len(kinds)), kinds, strict=True):
        for m in methods:
            if kind in m.curves:
                look = styles[m.name] | ({"marker": ""} if comparison.n_frames > _MARKED else {})
                axis.plot(range(comparison.n_frames), m.curves[kind], **look, markersize=2.5, label=m.name)
        title, label = _PANELS[kind]
        axis.set_title(title)
        axis.set(xlabel="frame", ylabel=label)
        axis.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
        if kind in ("bias", "lag"):
            axis.axhline(0, color="0.6", linewidth=0.8, zorder=1)
        else:
            axis.set_ylim(0, None)
        if comparison.cut is not None:
            axis.axvline(comparison.cut, color="0.6", linewidth=0.8, linestyle=":", zorder=1)
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure
