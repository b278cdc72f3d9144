"""Synthetic lights: their moments against integrals of their profiles, and their maps against their moments."""

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import eval_legendre

from gtao import lighting
from gtao.errors import ConfigError, ShapeError

AXIS = [1, 2, -0.5]
LIGHTS = {
    "constant": lighting.constant([1, 2, 3]),
    "wide": lighting.von_mises_fisher(AXIS, 4, [1, 2, 3]),
    "sharp": lighting.von_mises_fisher(AXIS, 200.0),
    "almost constant": lighting.von_mises_fisher(AXIS, 1e-7),
    "sky": lighting.gradient_sky([0, 1, 0], [0.2, 0.4, 1], 1.0, 0.1),
    "sun": lighting.disc(AXIS, 0.3, [3, 2, 1]),
    "half": lighting.disc(AXIS, math.pi / 2),
    "all": lighting.disc(AXIS, math.pi),
}
#: Where profiles jump or bend.
BREAKS = {"sky": [0.0], "sun": [math.cos(0.3)], "half": [0.0], "sharp": [0.9, 0.98]}


@pytest.mark.parametrize("name", LIGHTS)
def test_moments(name):
    light = LIGHTS[name]
    edges = [-1.0, *BREAKS.get(name, []), 1.0]
    for band in range(7):
        for channel in range(3):
            expected = sum(
                quad(lambda x: light.profile(np.array(x))[channel] * eval_legendre(band, x), a, b, epsabs=1e-12)[0]  # noqa: B023  (called at once)
                for a, b in itertools.pairwise(edges)
            )
            assert light.kernel(6)[band, channel] == pytest.approx(2 * math.pi * expected, abs=1e-9)


@pytest.mark.parametrize("name", ["constant", "wide", "sharp", "almost constant"])
def test_radiance_is_the_mean(name):
    mean = LIGHTS[name].project(0)[0] / math.sqrt(4 * math.pi)
    np.testing.assert_allclose(mean, [1, 2, 3] if name in ("constant", "wide") else [1, 1, 1], rtol=1e-12)


def test_concentrations_that_would_overflow():
    light = lighting.von_mises_fisher(AXIS, 1e5)
    assert light.radiance(AXIS)[0] == pytest.approx(2e5)
    # K_l = 4π (1 - l (l + 1)/2κ + …)
    np.testing.assert_allclose(light.kernel(3)[:, 0] / (4 * math.pi), [1, 1 - 1e-5, 1 - 3e-5, 1 - 6e-5], atol=1e-8)


@pytest.mark.parametrize("name", LIGHTS)
def test_projection_and_maps_agree(name):
    """Averages over texels, interpolated, are a blur by about a texel: l (l + 1) (1/24 + 1/12) h² of each band."""
    light, height = LIGHTS[name], 96
    expected = light.project(3)
    blur = 12 * (math.pi / height) ** 2 / 8
    # The disc's rim is sampled: 16 points in a texel know it to a quarter of a texel.
    rim = 0.02 if name in ("sun", "half", "all") else 0
    np.testing.assert_allclose(light.map(height).project(3), expected, atol=(2 * blur + rim) * np.abs(expected).max())


def test_light_comes_from_the_axis():
    light = lighting.von_mises_fisher(AXIS, 30.0, [1, 0.5, 0])
    axis = np.array(AXIS) / np.linalg.norm(AXIS)
    side = np.cross(axis, [0, 0, 1.0])
    np.testing.assert_allclose(light.radiance(axis), 30 / math.sinh(30) * math.exp(30) * np.array([1, 0.5, 0]))
    tilted = math.cos(0.2) * axis + math.sin(0.2) * side / np.linalg.norm(side)
    expected = light.radiance(axis) * math.exp(30 * (math.cos(0.2) - 1))
    np.testing.assert_allclose(light.radiance(5 * tilted), expected)
    brightest = np.unravel_index(light.map(32).radiance[..., 0].argmax(), (32, 64))
    # Within the half diagonal of a texel.
    assert light.map(32).directions()[brightest] @ axis > math.cos(0.75 * math.pi / 32)


def test_the_sky():
    sky = LIGHTS["sky"]
    np.testing.assert_allclose(sky.radiance([0, 1, 0]), [0.2, 0.4, 1])
    np.testing.assert_allclose(sky.radiance([1, 0, 0]), [1, 1, 1])
    np.testing.assert_allclose(sky.radiance([1, 1, 0]), 1 + math.sqrt(0.5) * (np.array([0.2, 0.4, 1]) - 1))
    np.testing.assert_allclose(sky.radiance([[1, -0.1, 0], [0, -1, 0]]), 0.1)


def test_half_of_the_light():
    """As the docstring says, to a tenth."""
    for kappa in (10.0, 100.0, 1000.0):
        inside = quad(lambda x, k=kappa: k * math.exp(k * (x - 1)), math.cos(1.18 / math.sqrt(kappa)), 1)[0]
        assert inside == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: lighting.von_mises_fisher(AXIS, 0), ConfigError, "kappa must be a finite positive number"),
        (lambda: lighting.von_mises_fisher(AXIS, math.inf), ConfigError, "kappa"),
        (lambda: lighting.von_mises_fisher([0, 0, 0], 1), ShapeError, "the axis must not be zero"),
        (lambda: lighting.von_mises_fisher([1, 0], 1), ShapeError, "the axis must be"),
        (lambda: lighting.constant(-1), ConfigError, "radiance must be one or three finite numbers"),
        (lambda: lighting.constant([1, 2]), ConfigError, "radiance"),
        (lambda: lighting.gradient_sky([0, 1, 0], 1, math.nan), ConfigError, "horizon"),
        (lambda: lighting.disc(AXIS, 4.0), ConfigError, "radius must be at most π.*radians"),
    ],
)
def test_refusals(call, error, words):
    with pytest.raises(error, match=words):
        call()
