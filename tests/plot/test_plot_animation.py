"""Pictures of videos are what they say, curves hold their numbers, and the report plays the videos beside it."""

import math
from html.parser import HTMLParser

import numpy as np
import pytest

from gtao import plot
from gtao.errors import ConfigError, ShapeError

RNG = np.random.default_rng(4)
TRUTH = RNG.random((6, 8))
MASK = TRUTH > 0.3


def method(name, **options):
    nan = math.nan
    curves = {"rmse": [0.3, 0.2, 0.1], "bias": [0.1, -0.1, 0.0], "step": [nan, 0.05, 0.02], "lag": [nan] * 3}
    numbers = {"rmse": 0.2, "last_rmse": 0.1, "bias": -0.0123, "flicker": 0.03, "step": None, "lag": None}
    given = {"video": f"{name}.mp4", "curves": curves, "numbers": numbers | {"convergence": 2}, "settings": "{}"}
    return plot.AnimatedMethod(name=name, **given | options)


def comparison(**options):
    given = {"methods": [method("a & b"), method("c", curves=method("c").curves | {"lag": [0.0, 0.1, 0.2]})], "cut": 2}
    given |= {"name": "walk", "description": "someone <walks>", "n_frames": 3, "fps": 24.0, "radius": 0.5}
    return plot.AnimationComparison(**given | options)


def test_pixels_of_visibility_are_in_display_encoding():
    values = np.array([[0.0, 0.5, 1.0, 1.5, np.nan]])
    pixels = plot.visibility_pixels(values, [[True, True, True, True, False]])
    # sRGB: half the light is 188 of 255.
    assert pixels[0, :, 0].tolist()[:4] == [0, 188, 255, 255]
    assert len(set(pixels[0, 4].tolist())) > 1  # no grey, so that it is not taken for a value


def test_pixels_of_errors_are_on_a_scale_of_brightness():
    image = TRUTH + np.linspace(-0.3, 0.3, TRUTH.size).reshape(TRUTH.shape)
    pixels = plot.error_pixels(image, TRUTH, np.ones(TRUTH.shape, bool), 0.2).astype(float) @ [0.2126, 0.7152, 0.0722]
    error = np.abs(image - TRUTH).ravel()
    order = np.argsort(error)
    assert (np.diff(pixels.ravel()[order]) >= -1).all()
    assert pixels.ravel()[order[0]] < 10
    assert np.ptp(pixels.ravel()[error > 0.2]) == 0
    masked = plot.error_pixels(np.where(MASK, image, np.nan), TRUTH, MASK, 0.2)
    background = plot.visibility_pixels(TRUTH, MASK)[~MASK]
    assert np.array_equal(masked[~MASK], background)


def test_a_frame_holds_three_pictures_side_by_side_and_words():
    truth, result = (plot.visibility_pixels(image, MASK) for image in (TRUTH, 1 - TRUTH))
    error = plot.error_pixels(1 - TRUTH, TRUTH, MASK, 0.25)
    given = {"name": "a method", "frame": 3, "rmse": 0.1, "limit": 0.25}
    shown = plot.video_frame(truth, result, error, **given)
    # 8 pixels become 240; a gap of 4 between two.
    factor, width, height = 30, 240, 180
    assert shown.shape == (40 + height, 3 * width + 8, 3)
    assert shown.dtype == np.uint8
    for i, picture in enumerate((truth, result, error)):
        left = i * (width + 4)
        part = shown[40:, left : left + width]
        assert np.array_equal(part[factor // 2 :: factor, factor // 2 :: factor], picture)
    strip = shown[:40]
    assert (strip.max(axis=(0, 2)).reshape(-1, 1) > 100).sum() > 100
    # What changes from frame to frame is written there.
    for change in ({"frame": 4}, {"rmse": 0.2}, {"name": "another"}, {"limit": 0.5}):
        other = plot.video_frame(truth, result, error, **given | change)
        assert not np.array_equal(other[:40], strip)
        assert np.array_equal(other[40:], shown[40:])


def test_large_pictures_stay_as_they_are_and_long_names_within_their_panel():
    pixels = np.zeros((20, 300, 3), np.uint8)
    shown = plot.video_frame(pixels, pixels, pixels, name="x" * 200 + "," + "y" * 200, frame=0, rmse=0, limit=1)
    assert shown.shape == (60, 908, 3)
    # The gap before the third panel stays free.
    assert (shown[:40, 604:608] == 24).all()


def test_pictures_of_different_sizes_are_told():
    with pytest.raises(ShapeError, match="different shapes"):
        plot.video_frame(*(np.zeros((h, 9, 3), np.uint8) for h in (4, 4, 5)), name="", frame=0, rmse=0, limit=1)


def test_the_palette_of_gifs_holds_every_second_grey_and_the_errors():
    palette = plot.ANIMATION_PALETTE
    assert palette.shape == (256, 3)
    assert palette.dtype == np.uint8
    greys = np.arange(256)
    assert np.abs(greys[:, None, None] - palette[None]).sum(-1).min(axis=1).max() <= 3
    errors = plot.error_pixels(np.linspace(0, 1, 500)[None], np.zeros((1, 500)), np.ones((1, 500), bool), 1.0)[0]
    assert np.abs(errors[:, None].astype(int) - palette[None]).max(-1).min(axis=1).max() <= 2


def test_curves_hold_every_number():
    figure = plot.animation_curves(comparison())
    axes = {axis.get_title(loc="left"): axis for axis in figure.axes}
    assert len(axes) == 4
    lines = {line.get_label(): line for line in figure.axes[0].get_lines()}
    assert lines["a & b"].get_xydata().tolist() == [[0, 0.3], [1, 0.2], [2, 0.1]]
    # The cut is marked everywhere.
    marked = [[list(line.get_xdata()) == [2, 2] for line in axis.get_lines()] for axis in figure.axes]
    assert all(map(any, marked))


@pytest.mark.parametrize("n_frames", [1, 2, 3])
def test_frames_are_counted_in_whole_numbers(n_frames):
    curves = {"rmse": [0.3, 0.2, 0.1][:n_frames]}
    figure = plot.animation_curves(comparison(methods=[method("a", curves=curves)], n_frames=n_frames, cut=None))
    ticks = figure.axes[0].get_xticks()
    assert len(ticks)
    assert ticks.tolist() == np.round(ticks).tolist()


def test_quantities_that_nobody_has_have_no_panel():
    figure = plot.animation_curves(comparison(methods=[method("a")]))
    assert sum(axis.axison for axis in figure.axes) == 3
    with pytest.raises(ShapeError, match="no curves"):
        plot.animation_curves(comparison(methods=[method("a", curves={})]))
    with pytest.raises(ConfigError, match="no method"):
        comparison(methods=[])


class Parser(HTMLParser):
    VOID = ("meta", "img", "br", "wbr")

    def __init__(self):
        super().__init__()
        self.open, self.videos, self.images = [], [], []

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        if tag == "video":
            assert {"controls", "loop", "muted"} <= values.keys()
            self.videos.append(values["src"])
        if tag == "img":
            self.images.append(values["src"])
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_the_report_plays_what_lies_beside_it():
    methods = [method("a & b", video="a-b.mp4"), method("c,d=1", video="c.gif")]
    shown = comparison(
        methods=methods,
        notes=["Mind <this>: give --radius."],
        command="gtao animate walk",
        record={"kind": "animation"},
    )
    page = plot.animation_report(shown)
    parser = Parser()
    parser.feed(page)
    assert parser.open == []
    assert parser.videos == ["a-b.mp4"]
    assert parser.images[1] == "c.gif"
    assert parser.images[0].startswith("data:image/png;base64,iVBOR")
    for words in (
        "a &amp; b",
        "<td>c,<wbr>d=1</td>",
        "someone &lt;walks&gt;",
        # Browsers break lines behind hyphens.
        "Mind &lt;this&gt;: give <code>--radius</code>.",
        "code { white-space: nowrap",
        # Else the last column lies beyond the page.
        "th { white-space: normal",
        "−0.0123",
        "gtao animate walk",
        "within 0.5",
    ):
        assert words in page, words
    # What no method has a number for has no column.
    assert "lag of ghosts" not in page
    assert "flicker at rest" in page
