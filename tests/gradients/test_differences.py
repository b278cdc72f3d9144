"""The differences that gradients are held to: right where there is a derivative, and silent where there is none."""

import numpy as np
import pytest
from oracles import gradients

SMOOTH = {
    "sine": (np.sin, 1.0),
    "steep": (lambda t: np.exp(300 * t), 300.0),
    "flat": (lambda t: 4.0 + 0.0 * t, 0.0),
    "no slope but a curve": (np.cos, 0.0),
    "large offset": (lambda t: 1e3 + np.sin(2 * t), 2.0),
    "a kink farther away": (lambda t: abs(t - 1e-3) + 3 * t, 2.0),
    "a kink that a narrower step escapes": (lambda t: abs(t - 3e-6) + 3 * t, 2.0),
    "a jump that a narrower step escapes": (lambda t: np.sin(t) + (t > 2e-6), 1.0),
}
ROUGH = {
    "kink": (abs, False),
    "kink on a slope": (lambda t: max(2 * t, 2.1 * t), False),
    "jump": (lambda t: float(t > 0), False),
    "small jump": (lambda t: np.sin(t) + 1e-3 * (t > 0), False),
    "root": (lambda t: np.sqrt(abs(t)), False),
}


@pytest.mark.parametrize("name", SMOOTH)
def test_smooth(name):
    f, expected = SMOOTH[name]
    found = gradients.derivative(f)
    assert found.resolved
    assert abs(found.value - expected) <= 1e-6 * abs(expected) + found.noise
    assert found.agrees(np.float64(expected))


@pytest.mark.parametrize("name", ROUGH)
def test_rough(name):
    found = gradients.derivative(ROUGH[name][0])
    assert not found.resolved
    assert abs(found.right - found.left) > 0.05


@pytest.mark.parametrize("error", [2e-4, -2e-4, 1.0, -2.0])
def test_wrong_gradients_are_found(error):
    found = gradients.derivative(np.sin)
    assert not gradients.disagreements(np.float64(1.0), found)
    assert gradients.disagreements(np.float64(1 + error), found)


def test_every_output_on_its_own():
    found = gradients.derivative(lambda t: np.array([np.sin(t), abs(t), 2 * t]))
    assert found.resolved.tolist() == [True, False, True]
    assert found.value[[0, 2]] == pytest.approx([1, 2])
    weighted = found.weighted(np.array([3.0, 0.0, 1.0]))
    assert weighted.resolved
    assert weighted.value == pytest.approx(5)
    assert not found.weighted(np.ones(3)).resolved


@pytest.mark.parametrize(("f", "slope"), [(np.sqrt, None), (lambda t: np.exp(2 * t), 2), (lambda t: t**1.5, None)])
def test_from_one_side(f, slope):
    def only_above(t):
        assert t >= 0
        return f(t)

    found = gradients.derivative(only_above, one_sided=True)
    assert found.resolved == (slope is not None)
    if slope:
        assert found.value == pytest.approx(slope, rel=1e-6)
