"""Ray-traced factors of split integrals against quadrature, golden values, pre-filtered maps and their own batches."""

import math
from _statistics import assert_mean_is, assert_no_excess

import _scenes as S
import numpy as np
import pytest
from _openings import shell
from oracles import glossy, golden

import gtao
from gtao import ConfigError, SceneError, ShapeError, lighting, render
from gtao.render.split import _integral


def float64(tensor):
    return tensor.numpy().astype(np.float64)


def lobe(cos_t, alpha):
    """D(cos t/2) ⟨cos t⟩₊ from its definition."""
    cos_h = np.sqrt((1 + cos_t) / 2)
    return alpha**2 / (np.pi * (cos_h**2 * (alpha**2 - 1) + 1) ** 2) * np.maximum(cos_t, 0)


def sphere(alpha, n_azimuths=2000):
    """Directions (…, 3) about z and weights of the lobe, which sum to its integral."""
    edges = np.concatenate([[0.0], np.geomspace(alpha / 8, math.pi / 2, 30)])
    x, w = np.polynomial.legendre.leggauss(12)
    half = np.diff(edges)[:, None] / 2
    t, w = (edges[:-1, None] + half * (x + 1)).ravel(), (half * w).ravel()
    phi = 2 * math.pi * (np.arange(n_azimuths) + 0.5) / n_azimuths
    s = np.sin(t)[:, None]
    d = np.stack(np.broadcast_arrays(s * np.cos(phi), s * np.sin(phi), np.cos(t)[:, None]), -1)
    return d, np.broadcast_to((lobe(np.cos(t), alpha) * np.sin(t) * w * 2 * math.pi / n_azimuths)[:, None], d.shape[:2])


@pytest.mark.parametrize("alpha", [1e-3, 0.05, 0.3, 0.8, 0.99, 0.9995, 0.99999, 1.0])
def test_integral_of_the_lobe(alpha):
    np.testing.assert_allclose(_integral(np.array([alpha])), sphere(alpha, 4)[1].sum(), rtol=1e-9)


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("E.cone_lobe"))
def test_a_cone_of_visibility(inputs, outputs):
    """Golden values of cone and lobe; seen along the normal, the whole opening is above the surface."""
    beta = inputs["beta"]
    scene = render.load_scene(shell(0.0, np.array([math.sin(beta), 0, math.cos(beta)]), inputs["alpha_v"]))
    s = render.split_integrals(scene, roughness=math.sqrt(inputs["alpha"]), spp=256, seed=1)
    # The rim is a polygon, 2.5e-5 of its radius too narrow on average, and pixels see slightly different points.
    assert_mean_is(float64(s.visibility.mean).ravel(), outputs["ggx"], allowance=1e-4)
    assert_mean_is(float64(s.above.mean).ravel(), sphere_above(0.0, inputs["alpha"]), allowance=1e-5)


def sphere_above(theta_o, alpha):
    """Share of the lobe above a plane whose normal is ``theta_o`` from its axis."""
    d, w = sphere(alpha)
    return w[d @ [math.sin(theta_o), 0, math.cos(theta_o)] > 0].sum() / w.sum()


@pytest.mark.parametrize("roughness", [0.05, 0.4, 0.9])
def test_open_surfaces_at_an_angle(roughness):
    scene = render.load_scene(S.plane(S.perspective((0, -3, 1), (0, 0, 0), fov=4.0, size=(12, 12))))
    s = render.split_integrals(scene, roughness=roughness, spp=256, seed=2)
    np.testing.assert_array_equal(float64(s.visibility.mean), float64(s.above.mean))
    # Over the field of view of 4° the share changes linearly but for 1e-3 of itself.
    expected = sphere_above(math.atan2(3, 1), roughness**2)
    assert_mean_is(float64(s.above.mean).ravel(), expected, allowance=1e-3)


@pytest.mark.parametrize(("row", "column"), [(3, 17), (2, 16), (8, 5)])
def test_open_surfaces_see_what_the_probe_holds(row, column):
    """Seen along the normal, with a texel of the map straight above."""
    image = np.random.default_rng(4).random((12, 24, 3))
    image[3, 17] = 30
    above = lighting.EnvironmentMap(image).directions()[row, column]
    across = np.cross(above, [0.0, 1, 0])
    across /= np.linalg.norm(across)
    env = lighting.EnvironmentMap(image, np.stack([across, np.cross(above, across), above]))
    scene = render.load_scene(S.plane(S.perspective((0, 0, 3), (0, 0, 0), up=(0, 1, 0), fov=0.2, size=(16, 16))))
    s = render.split_integrals(scene, roughness=0.35, environment=env, spp=512, seed=3)
    level = lighting.prefilter(env, [0.35]).levels[0].radiance
    for channel in range(3):
        # The quadrature of the level, and a tenth of a degree.
        values = float64(s.radiance.mean)[..., channel].ravel()
        assert_mean_is(values, level[row, column, channel], allowance=2e-4 * level.max())


def test_light_through_a_cone():
    """Light and visibility in one integral, against quadrature about the axis."""
    alpha, theta_o = 0.4, 0.5
    v, b = glossy.frame(theta_o, 0.3, 0.7)
    env = lighting.EnvironmentMap(np.random.default_rng(5).random((8, 16, 3)))
    s = render.split_integrals(
        render.load_scene(shell(theta_o, b, 0.8)), roughness=math.sqrt(alpha), environment=env, spp=256, seed=4
    )
    d, w = sphere(alpha)
    axis = np.array([-v[0], 0, v[2]])
    world = d @ np.stack([np.cross([0.0, 1, 0], axis), [0.0, 1, 0], axis])
    open_ = (world @ b > math.cos(0.8)) & (world[..., 2] > 0)
    share = (w * open_) / w.sum()
    assert_mean_is(float64(s.visibility.mean).ravel(), share.sum(), allowance=5e-4)
    expected = np.einsum("ij,ijc->c", share, env.lookup(world))
    for channel in range(3):
        values = float64(s.radiance.mean)[..., channel].ravel()
        assert_mean_is(values, expected[channel], allowance=5e-4)


def test_constant_light_is_visibility():
    """Where normals lean away from the surface, too: what is below either counts as blocked."""
    scene = render.load_scene(S.stairs(16))
    g = render.gbuffer(scene)
    leaning = float64(g.normal_v) + np.array([1.0, 0, 0])
    g = gtao.GBuffer(g.view_z, leaning / np.linalg.norm(leaning, axis=-1, keepdims=True), g.camera)
    env = lighting.constant(1.0).map(4)
    s = render.split_integrals(scene, g, roughness=0.8, environment=env, spp=256)
    difference = float64(s.radiance.mean)[..., 1] - float64(s.visibility.mean)
    assert float64(s.above.mean)[g.mask.numpy()].min() < 0.7
    # The same rays of the lobe are in both, those of the light only in one.
    assert_mean_is(difference[g.mask.numpy()], 0.0)


def test_variance_is_that_of_the_mean():
    scene = render.load_scene(S.stairs(16))
    env = lighting.von_mises_fisher([0.2, 0.3, 1], 50).map(16)
    options = {"roughness": 0.6, "environment": env}
    a, b = (render.split_integrals(scene, spp=64, n_batches=16, seed=k, **options) for k in (1, 2))
    for name in ("visibility", "above", "radiance"):
        x, y = getattr(a, name), getattr(b, name)
        difference = float64(x.mean) - float64(y.mean)
        assert_no_excess(difference, float64(x.variance) + float64(y.variance))


def test_roughness_of_every_pixel():
    scene = render.load_scene(S.plane(S.perspective((0, -3, 1), (0, 0, 0), fov=30.0, size=(4, 4))))
    image = np.full((4, 4), 0.3, np.float32)
    image[1, 2] = 0.8
    together = render.split_integrals(scene, roughness=image, spp=16, n_batches=2)
    for roughness in (0.3, 0.8):
        alone = render.split_integrals(scene, roughness=roughness, spp=16, n_batches=2)
        same = image == np.float32(roughness)
        np.testing.assert_array_equal(together.above.mean.numpy()[same], alone.above.mean.numpy()[same])
    assert repr(together) == "SplitIntegrals(4x4, 16 samples per pixel)"


def test_in_words():
    scene = render.load_scene(S.plane(S.perspective((0, -3, 1), (0, 0, 0), fov=30.0, size=(4, 4))))
    for wrong in ({"spp": 3}, {"max_distance": 0}, {"environment": "sky"}):
        with pytest.raises(ConfigError):
            render.split_integrals(scene, **wrong)
    with pytest.raises(ShapeError, match="roughness"):
        render.split_integrals(scene, roughness=1.5)
    with pytest.raises(SceneError):
        render.split_integrals(scene, sensor=7)
