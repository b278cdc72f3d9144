"""Windows: their factors, what they keep, and how much is needed against negative light."""

import math

import numpy as np
import pytest
from _sphere import directions, harmonics, rotation
from scipy.integrate import lebedev_rule

from gtao import lighting
from gtao.errors import ConfigError, ShapeError

#: The search for the minimum ends at a reach of 2π/40/3¹⁴ radians, and the minimum is flat.
MINIMUM = 1e-12


def test_factors_by_hand():
    third = math.sin(math.pi / 3) / (math.pi / 3)
    expected = {
        "hanning": [1, 0.75, 0.25, 0, 0],
        "lanczos": [1, third, third / 2, 0, 0],
        "gauss": [1, math.exp(-1 / 9), math.exp(-1 / 3), math.exp(-2 / 3), math.exp(-10 / 9)],
        "laplacian": [1, 81 / 85, 81 / 117, 81 / 225, 81 / 481],
    }
    assert set(expected) == set(lighting.WINDOWS)
    for kind, factors in expected.items():
        np.testing.assert_allclose(lighting.window_factors(kind, 4, 3.0), factors, atol=1e-15)


def test_laplacian_minimises_its_penalty():
    """‖f - g‖² + λ‖Δg‖² with λ = width⁻⁴: no other factor does better in any band."""
    width = 2.5
    f = np.repeat(np.random.default_rng(0).normal(size=5), 1)
    band = np.arange(5.0)

    def penalised(factors):
        return (f - factors * f) ** 2 + width**-4 * (band * (band + 1) * factors * f) ** 2

    best = lighting.window_factors("laplacian", 4, width)
    for step in (-1e-3, 1e-3):
        assert (penalised(best + step) > penalised(best)).all()


def test_gauss_is_as_wide_as_it_says():
    """The mean of 1 - cos θ under the blur is its variance along one axis."""
    assert 1 - lighting.window_factors("gauss", 1, 50.0)[1] == pytest.approx(50.0**-2, rel=1e-3)


def test_window_multiplies_bands():
    sh = np.random.default_rng(1).normal(size=(16, 3))
    windowed = lighting.window(sh, "lanczos", 5.0)
    factors = lighting.window_factors("lanczos", 3, 5.0)
    np.testing.assert_array_equal(windowed, sh * np.repeat(factors, [1, 3, 5, 7])[:, None])
    np.testing.assert_array_equal(lighting.window(sh[:, 0]), lighting.window(sh, "hanning", 4.0)[:, 0])


def test_minimum_of_a_quadratic_form():
    """Bands 0 and 2 are a symmetric matrix, whose lowest eigenvalue is the minimum."""
    for seed in range(5):
        r, values = rotation(seed), np.random.default_rng(seed).normal(size=3)
        q = r @ np.diag(values) @ r.T
        d, w = lebedev_rule(9)
        f = np.einsum("ik,ij,jk->k", d, q, d)
        sh = harmonics(d.T, 2).T @ (w * f)
        assert lighting.minimum(sh) == pytest.approx(values.min(), abs=MINIMUM)


def test_minimum_of_many():
    sh = np.random.default_rng(2).normal(size=(25, 3))
    lowest = lighting.minimum(sh)
    sampled = (harmonics(directions(40000, seed=9), 4) @ sh).min(axis=0)
    assert lowest.shape == (3,)
    # The directions lie about 0.02 apart: beside a minimum a form of degree 4 rises by less than 20 · 0.02²/2 of it.
    assert (lowest <= sampled).all()
    np.testing.assert_allclose(lowest, sampled, atol=5e-3)


@pytest.mark.parametrize("kind", lighting.WINDOWS)
def test_no_more_than_needed(kind):
    sun = lighting.von_mises_fisher([1, 2, -0.5], 80.0, [1, 0.7, 0.2]).project(2)
    assert (lighting.minimum(sun) < 0).all()
    windowed, width = lighting.non_negative(sun, kind)
    assert (lighting.minimum(windowed) >= 0).all()
    np.testing.assert_allclose(windowed, lighting.window(sun, kind, width))
    assert (lighting.minimum(lighting.window(sun, kind, 1.001 * width)) < 0).any()
    np.testing.assert_array_equal(windowed[0], sun[0])


def test_none_needed():
    glow = lighting.von_mises_fisher([0, 1, 0], 0.5).project(2)
    windowed, width = lighting.non_negative(glow)
    assert width == math.inf
    np.testing.assert_array_equal(windowed, glow)


def test_one_bad_channel_decides_for_all():
    sh = np.zeros((9, 3))
    sh[0] = 1
    sh[2, 1] = 3
    windowed, width = lighting.non_negative(sh)
    assert width < 2
    assert lighting.minimum(windowed)[1] == pytest.approx(0, abs=1e-4)


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: lighting.window(np.zeros(9), "hamming"), ConfigError, "kind must be one of hanning, .*'hamming'"),
        (
            lambda: lighting.window(np.zeros(9), "gauss", 0),
            ConfigError,
            "width must be a finite positive number, got 0",
        ),
        (lambda: lighting.non_negative(np.zeros(9), "none"), ConfigError, "kind must be one of"),
        (lambda: lighting.non_negative(-np.ones(4)), ShapeError, "no window can help"),
        (lambda: lighting.window(np.zeros(5)), ShapeError, "got 5"),
    ],
)
def test_refusals(call, error, words):
    with pytest.raises(error, match=words):
        call()
