"""Curves over frames hold the numbers that they are given, with levels, marks and gaps."""

import numpy as np
import pytest

from gtao import ShapeError, plot

PANELS = {
    "stairs": {"published": [0.3, 0.2, 0.1], "no clamp": [0.3, None, 0.05]},
    "arcade": {"published": [0.4, 0.3, 0.2]},
}


def test_curves_hold_every_number():
    figure = plot.settling_curves(PANELS, levels={"stairs": {"single": 0.15}}, title="still", ylabel="error")
    stairs, arcade = figure.axes
    assert [axis.get_title(loc="left") for axis in figure.axes] == ["stairs", "arcade"]
    lines = {line.get_label(): line for line in stairs.get_lines()}
    assert lines["published"].get_xydata().tolist() == [[1, 0.3], [2, 0.2], [3, 0.1]]
    assert np.isnan(lines["no clamp"].get_ydata()).tolist() == [False, True, False]
    assert list(lines["single"].get_ydata()) == [0.15, 0.15]
    (line,) = arcade.get_lines()
    assert line.get_label() == "published"
    assert line.get_color() == lines["published"].get_color()
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["published", "no clamp", "single"]
    assert stairs.get_ylabel() == "error"
    assert arcade.get_ylabel() == ""


def test_places_marks_and_logarithms():
    figure = plot.settling_curves(PANELS, at=[0, 2, 4], marks={"arcade": 3.5}, log=True)
    stairs, arcade = figure.axes
    assert stairs.get_lines()[0].get_xdata().tolist() == [0, 2, 4]
    assert list(arcade.get_lines()[1].get_xdata()) == [3.5, 3.5]
    assert {stairs.get_xscale(), stairs.get_yscale()} == {"log"}


def test_curves_refuse():
    with pytest.raises(ShapeError, match="at least one"):
        plot.settling_curves({})
    with pytest.raises(ShapeError, match="published has 3 values at 2 places"):
        plot.settling_curves(PANELS, at=[1, 2])
