"""Rows of images and error maps."""

import io

import numpy as np
import pytest

from gtao import plot
from gtao.errors import ShapeError


def pixels(figure, index=0):
    return np.asarray(figure.axes[index].get_images()[0].get_array())


def test_images_are_encoded_for_display():
    shown = pixels(plot.visibility_image(np.array([[0.0, 0.002, 0.5, 1.0, -1.0, 7.0]])))
    # IEC 61966-2-1: 0.002 lies on the straight part, 0.5 encodes to 0.7354.
    assert shown[0, :, 0].tolist() == [0, round(255 * 12.92 * 0.002), round(255 * 0.7354), 255, 0, 255]
    assert np.all(shown[..., :1] == shown)


def test_limits_and_colour():
    image = np.zeros((2, 2, 3))
    image[0, 0] = (2.0, 4.0, 3.0)
    shown = pixels(plot.image_row([image], limits=(2.0, 4.0)))
    assert shown[0, 0].tolist() == [0, 255, round(255 * 0.7354)]


@pytest.mark.parametrize("broken", [np.nan, np.inf])
def test_pixels_without_value_are_neutral(broken):
    shown = pixels(plot.visibility_image(np.array([[broken, 1.0]])))
    assert shown[0].tolist() == [[0xC9, 0xD3, 0xDE], [255, 255, 255]]


def test_a_row_keeps_order_titles_and_proportions():
    figure = plot.image_row([np.zeros((4, 8)), np.ones((4, 4, 3))], ["left", "right"])
    assert [a.get_title(loc="left") for a in figure.axes] == ["left", "right"]
    assert pixels(figure, 0).shape == (4, 8, 3)
    assert pixels(figure, 1).min() == 255
    figure.savefig(io.BytesIO(), format="png")
    widths = [a.get_position().width for a in figure.axes]
    # Constrained layout pads both alike.
    assert widths[0] / widths[1] == pytest.approx(2, rel=0.05)


def test_long_rows_are_broken():
    figure = plot.image_row([np.zeros((2, 2))] * 5, list("abcde"), columns=3)
    shown = [a for a in figure.axes if a.get_images()]
    assert [a.get_title(loc="left") for a in shown] == list("abcde")
    assert [a.get_subplotspec().rowspan.start for a in shown] == [0, 0, 0, 1, 1]


def test_error_map_is_symmetric_about_zero():
    error = np.array([[-0.1, 0.3], [np.nan, 0.0]])
    image = plot.error_map(error, "estimate − truth").axes[0].get_images()[0]
    assert image.get_clim() == (-0.3, 0.3)
    assert np.ma.getmaskarray(image.get_array()).tolist() == [[False, False], [True, False]]
    assert plot.error_map(error, limit=0.05).axes[0].get_images()[0].get_clim() == (-0.05, 0.05)
    # Nothing wrong anywhere still makes a scale.
    assert plot.error_map(np.zeros((2, 2))).axes[0].get_images()[0].get_clim() == (-1, 1)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: plot.image_row([]), "no image"),
        (lambda: plot.image_row([np.zeros((2, 2))], ["a", "b"]), "2 titles for 1 images"),
        (lambda: plot.image_row([np.zeros(3)]), r"\(H, W\) or \(H, W, 3\), got \(3,\)"),
        (lambda: plot.image_row([np.zeros((2, 2, 4))]), r"got \(2, 2, 4\)"),
        (lambda: plot.error_map(np.zeros(3)), r"got shape \(3,\)"),
        (lambda: plot.error_map(np.full((2, 2), np.nan)), "finite"),
    ],
)
def test_refusals(call, message):
    with pytest.raises(ShapeError, match=message):
        call()
