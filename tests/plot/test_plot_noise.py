"""Figures of noise show its numbers."""

from types import SimpleNamespace

import numpy as np
import pytest

from gtao import ShapeError, plot

RNG = np.random.default_rng(4)


def spectrum():
    power = RNG.random((8, 8))
    return SimpleNamespace(power=power, frequency=np.arange(1, 5) / 8, radial=RNG.random(4) + 0.1)


def test_patterns_show_a_corner_and_the_power_in_decades():
    tiles, spectra = {"one_two": RNG.random((8, 8))}, {"one_two": spectrum(), "left out": spectrum()}
    upper, lower = plot.noise_patterns(tiles, spectra, shown=4).axes
    assert upper.get_title(loc="left") == "one two"
    assert np.array_equal(upper.get_images()[0].get_array(), tiles["one_two"][:4, :4])
    assert np.asarray(lower.get_images()[0].get_array()) == pytest.approx(np.log10(spectra["one_two"].power).clip(-3))


def test_spectra_hold_every_number():
    spectra = {"a": spectrum(), "b": spectrum()}
    (axis,) = plot.noise_spectra(spectra).axes
    lines = {line.get_label(): line.get_xydata() for line in axis.get_lines()}
    for name, found in spectra.items():
        assert np.array_equal(lines[name], np.stack([found.frequency, found.radial], axis=-1))


def test_errors_hold_every_number_in_the_order_of_frames():
    curves = {"none": {"a": {"24": 0.1, "2": 0.3}, "b": {"1": 0.5}}, "some": {"a": {"1": 0.2}}}
    first, second = plot.noise_errors(curves).axes
    assert [axis.get_title(loc="left") for axis in (first, second)] == ["none", "some"]
    lines = {line.get_label(): line.get_xydata().tolist() for line in first.get_lines()}
    assert lines == {"a": [[2, 0.3], [24, 0.1]], "b": [[1, 0.5]]}
    (only,) = plot.noise_errors(curves, shown=["b"]).axes[0].get_lines()
    assert only.get_label() == "b"


def test_nothing_to_draw_is_refused():
    for draw in (
        lambda: plot.noise_patterns({}, {}),
        lambda: plot.noise_patterns({"a": np.zeros((4, 4))}, {}),
        lambda: plot.noise_spectra({}),
        lambda: plot.noise_errors({}),
        lambda: plot.noise_errors({"none": {"a": {1: 0.0}}}),
    ):
        with pytest.raises(ShapeError):
            draw()
