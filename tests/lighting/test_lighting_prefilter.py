"""Pre-filtered maps against quadrature and random rays about each axis, against irradiance, and the errors that the
docstring states."""

import math

import numpy as np
import pytest
from _sphere import directions, rotation

from gtao import lighting
from gtao.errors import ConfigError, ShapeError
from gtao.lighting import EnvironmentMap, PrefilteredEnvironment, prefilter
from gtao.lighting._lobe import lobe, texel_weights

LEVELS = (0.0, 0.1, 0.3, 0.6, 1.0)


def _map(height, seed=0, sun=60.0):
    image = np.random.default_rng(seed).random((height, 2 * height, 3))
    image[height // 3, height // 2] = sun
    return EnvironmentMap(image, rotation(3))


def _ggx(cos_h, alpha):
    return alpha**2 / (math.pi * (cos_h**2 * (alpha**2 - 1) + 1) ** 2)


def _polar_mean(env, axis, alpha, n_azimuths=1500):
    """Mean radiance in the lobe, by rings about the axis."""
    edges = np.concatenate([[0.0], np.geomspace(alpha / 8, math.pi / 2, 40)])
    x, w = np.polynomial.legendre.leggauss(12)
    half = np.diff(edges)[:, None] / 2
    t, weight = (edges[:-1, None] + half * (x + 1)).ravel(), (half * w).ravel()
    psi = 2 * math.pi * (np.arange(n_azimuths) + 0.5) / n_azimuths
    s = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    s /= np.linalg.norm(s)
    ring = np.cos(psi)[:, None] * s + np.sin(psi)[:, None] * np.cross(axis, s)
    weight = weight * _ggx(np.cos(t / 2), alpha) * np.cos(t) * np.sin(t)
    total = sum(w * env.lookup(np.cos(a) * axis + np.sin(a) * ring).mean(0) for a, w in zip(t, weight, strict=True))
    return total / weight.sum()


@pytest.mark.parametrize("height", [8, 24])
def test_levels_are_means_in_the_lobe(height):
    """Random texels and the brightest of each level."""
    env = _map(height)
    pre = prefilter(env, LEVELS)
    rng = np.random.default_rng(1)
    for roughness, level in zip(LEVELS[1:], pre.levels[1:], strict=True):
        axes, values = level.directions().reshape(-1, 3), level.radiance.reshape(-1, 3)
        for k in (*rng.integers(0, len(axes), 4), 0, int(np.argmax(values[:, 0]))):
            expected = _polar_mean(env, axes[k], roughness**2)
            # What the docstring says of the quadrature; the rings themselves are right to a third of it.
            np.testing.assert_allclose(values[k], expected, rtol=0, atol=1e-4 * values.max())


def test_levels_are_means_of_random_rays():
    """Microfacets drawn about the axis and mirrored, weighed by the cosine: no quadrature, no density."""
    env, roughness = _map(16, seed=2), 0.5
    level = prefilter(env, [roughness]).levels[0]
    u, v = np.random.default_rng(3).random((2, 400_000))
    cos2 = (1 - u) / (1 + (roughness**4 - 1) * u)
    cos_t, sin_t = 2 * cos2 - 1, 2 * np.sqrt(cos2 * (1 - cos2))
    local = np.stack([sin_t * np.cos(2 * math.pi * v), sin_t * np.sin(2 * math.pi * v), cos_t], axis=-1)
    weight = np.maximum(cos_t, 0)[:, None]
    for row, column in ((5, 8), (0, 3), (12, 30)):
        axis = level.directions()[row, column]
        s = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        s /= np.linalg.norm(s)
        seen = env.lookup(local @ np.stack([s, np.cross(axis, s), axis]))
        expected = (weight * seen).sum(0) / weight.sum()
        error = np.sqrt(((weight * (seen - expected)) ** 2).sum(0)) / weight.sum()
        assert (np.abs(level.radiance[row, column] - expected) < 4.5 * error).all()


def test_the_roughest_level_is_irradiance_over_pi():
    env = _map(64, seed=4)
    level = prefilter(env, [1.0]).levels[0]
    # Irradiance has an error of 1e-4 of its own, from the texels that the tangent plane cuts.
    expected = env.irradiance(level.directions()) / math.pi
    np.testing.assert_allclose(level.radiance, expected, rtol=0, atol=2e-4 * expected.max())


@pytest.mark.parametrize("shape", [(2, 2), (7, 10), (64, 128)])
def test_constant_maps_stay_constant(shape):
    env = EnvironmentMap(np.broadcast_to([0.7, 0.1, 12.0], (*shape, 3)))
    pre = prefilter(env, (0.0, 0.01, 0.2, 0.5, 1.0))
    for level in pre.levels:
        np.testing.assert_allclose(level.radiance, np.broadcast_to([0.7, 0.1, 12.0], level.radiance.shape), rtol=2e-7)
    np.testing.assert_allclose(pre.lookup([1, 2, 3], 0.37), [0.7, 0.1, 12.0], rtol=2e-7)


def test_level_zero_is_the_map_at_its_own_size():
    env = _map(32)
    pre = prefilter(env, (0.0, 0.5), height=8)
    assert pre.levels[0] is env
    assert pre.levels[1].shape == (8, 16)
    d = directions(50)
    np.testing.assert_allclose(pre.lookup(d, 0), env.lookup(d), rtol=1e-12)


def test_narrow_lobes_give_the_map_back():
    env = _map(12)
    level = prefilter(env, [0.02]).levels[0]
    # Half of the lobe lies within 1/600 of a texel: a hat loses its slope times that, and what the tails take.
    np.testing.assert_allclose(level.radiance, env.radiance, atol=0.01 * 60)
    sun = env.shape[0] // 3, env.shape[0] // 2
    assert 0.99 * 60 < level.radiance[*sun].min() < 60


def test_turned_maps_give_turned_levels():
    image = _map(16).radiance
    turn = rotation(7)
    upright, turned = (prefilter(EnvironmentMap(image, m), (0.0, 0.4)) for m in (np.eye(3), turn))
    d = directions(40)
    np.testing.assert_allclose(turned.lookup(d @ turn.T, 0.3), upright.lookup(d, 0.3), rtol=1e-6)


def test_levels_shrink_where_lobes_are_wide():
    pre = prefilter(_map(64), (0.1, 0.5, 1.0))
    assert [level.shape for level in pre.levels] == [(64, 128), (64, 128), (32, 64)]
    # Sides that cannot be halved stay.
    assert prefilter(EnvironmentMap(np.ones((66, 99, 3))), [1.0]).levels[0].shape == (66, 99)


def test_small_levels_hold_what_large_ones_do():
    """Halved levels stand at other axes, half a texel away."""
    glow = lighting.von_mises_fisher([0.3, 0.8, 0.2], 30).map(64)
    d = directions(500)
    small = prefilter(glow, [0.9])
    assert small.levels[0].shape == (32, 64)
    expected = np.array([_polar_mean(glow, axis, 0.81, 200) for axis in d[:40]])
    np.testing.assert_allclose(small.lookup(d[:40], 0.9), expected, rtol=0, atol=0.01 * small.levels[0].radiance.max())


def test_roughness_between_levels():
    sky = lighting.gradient_sky([0, 1, 0], [0.3, 0.5, 1.0], [1, 1, 1], [0.2, 0.15, 0.1]).map(32)
    pre, d = prefilter(sky), directions(300)
    for roughness in (0.09, 0.22, 0.47, 0.72):
        exact = prefilter(sky, [roughness]).lookup(d, roughness)
        error = np.sqrt(np.mean((pre.lookup(d, roughness) - exact) ** 2))
        assert error < 0.01 * exact.std()
    middle = prefilter(sky, (0.25, 0.5))
    a, b = (middle.levels[k].lookup(d) for k in (0, 1))
    np.testing.assert_allclose(middle.lookup(d, 0.3), 0.8 * a + 0.2 * b, rtol=1e-12)


def test_roughness_of_every_direction():
    pre, d = prefilter(_map(16), LEVELS), directions(12).reshape(3, 4, 3)
    roughness = np.linspace(0, 1, 12).reshape(3, 4)
    together = pre.lookup(d, roughness)
    assert together.shape == (3, 4, 3)
    assert together.dtype == np.float64
    for i, j in ((0, 0), (1, 2), (2, 3)):
        np.testing.assert_allclose(together[i, j], pre.lookup(d[i, j], float(roughness[i, j])), rtol=1e-12)
    np.testing.assert_allclose(pre.lookup(d, roughness[0])[1], pre.lookup(d[1], roughness[0]), rtol=1e-12)


def test_dark_texels_beside_a_sun_are_not_negative():
    image = np.zeros((16, 32, 3))
    image[4, 5] = 1e6
    assert all(level.radiance.min() >= 0 for level in prefilter(EnvironmentMap(image), LEVELS).levels)


def test_light_is_kept():
    """The lobe is symmetric, so that the mean over all axes is the mean of the light, but for sampling it at texels."""
    env = _map(32, sun=20.0)
    for level in prefilter(env, (0.4, 0.7, 1.0)).levels:
        np.testing.assert_allclose(level.project(0), env.project(0), rtol=2e-3)


@pytest.mark.parametrize("alpha", [0.01, 0.3, 1.0])
def test_weights_of_texels(alpha):
    weights = texel_weights((12, 24), 0.9, 3.25, alpha)
    assert weights.shape == (12, 24)
    assert weights.min() >= 0
    assert weights.sum() == pytest.approx(1, abs=1e-14)
    # Symmetric about the axis' meridian: column 3.25 + k sees what 3.25 - k does.
    np.testing.assert_allclose(
        texel_weights((12, 24), 0.9, 3.0, alpha), np.roll(texel_weights((12, 24), 0.9, 3.0, alpha)[:, ::-1], 7, axis=1),
        atol=1e-12,
    )  # fmt: skip


def test_the_lobe_is_of_the_half_vector():
    t = np.linspace(0, math.pi, 50)
    expected = _ggx(np.cos(t / 2), 0.4) / _ggx(1.0, 0.4) * np.maximum(np.cos(t), 0)
    np.testing.assert_allclose(lobe(np.sin(t / 2) ** 2, 0.4), expected, atol=1e-14)


def test_in_words():
    env = _map(8)
    for wrong in ((0.5, 0.5), (0.5, 0.2), (-0.1,), (0.2, 1.1), (), (math.nan,), "rough", (True,), (0.2, "a")):
        with pytest.raises(ConfigError, match="increasing numbers"):
            prefilter(env, wrong)
    with pytest.raises(ConfigError, match="EnvironmentMap"):
        prefilter(np.ones((4, 8, 3)))
    for wrong in (1, 2.5, -3):
        with pytest.raises(ConfigError, match="integer"):
            prefilter(env, height=wrong)
    with pytest.raises(ConfigError, match="as many levels"):
        PrefilteredEnvironment((0.1, 0.2), (env,))
    pre = prefilter(env, (0.2, 0.6))
    for wrong in (0.1, 0.7, math.nan, [0.3, 0.9]):
        with pytest.raises(ConfigError, match=r"\[0.2, 0.6\]"):
            pre.lookup(directions(2), wrong)
    with pytest.raises(ShapeError, match="broadcast"):
        pre.lookup(directions(5), np.full(3, 0.3))
    with pytest.raises(ShapeError, match="broadcast"):
        pre.lookup(np.eye(3)[0], np.full(3, 0.3))
    with pytest.raises(ShapeError, match="zero"):
        pre.lookup([0, 0, 0], 0.3)
    assert repr(pre) == "PrefilteredEnvironment(0.2: 16x8, 0.6: 16x8)"
    assert prefilter(env, 0.5).roughness == (0.5,)
