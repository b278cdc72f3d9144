"""Ray-traced reflection of an environment against quadrature: radiance with what occludes it and without."""

from _statistics import assert_mean_is, assert_no_excess

import _lights as L
import _scenes as S
import numpy as np
import pytest
from _openings import shell
from oracles import glossy

from gtao import render


def float64(tensor):
    return tensor.numpy().astype(np.float64)


@pytest.mark.parametrize("roughness", [0.0, 0.4, 1.0])
def test_constant_light_on_open_ground(roughness):
    """L (F0 A + B) of every colour."""
    colour, f0 = np.array([0.5, 1.0, 3.0]), np.float32([0.9, 0.5, 0.04])
    scene = render.load_scene(S.plane(S.perspective((0, -3, 1), (0, 0, 0), fov=60.0, size=(12, 12))))
    s = render.specular(scene, roughness=roughness, f0=f0, spp=256, environment=L.constant(*colour))
    A, B = np.moveaxis(float64(s.hemisphere)[s.terms.mask], -1, 0)[..., None]
    expected = colour * (f0 * A + B)
    for found in (s.radiance, s.unoccluded):
        relative = float64(found.mean)[s.terms.mask] / expected - 1
        for k in range(3):
            # Of a lobe of 1e-4, single precision leaves as much, and no noise.
            assert_mean_is(relative[:, k], 0, allowance=2e-4 if roughness == 0 else 0)
        assert not found.mean.numpy()[~s.terms.mask].any()
    np.testing.assert_array_equal(s.radiance.mean.numpy(), s.unoccluded.mean.numpy())


THETA_O, ALPHA_V = 0.9, 0.8
V, B = glossy.frame(THETA_O, 0.4, 1.0)


@pytest.mark.parametrize("roughness", [0.25, 0.5, 0.9])
@pytest.mark.parametrize("kind", ["rough", "sunny"])
def test_light_through_an_opening(kind, roughness):
    """A map, random or with a sun at the opening's edge, that lobes of any width reflect."""
    light = L.rough(8, seed=4) if kind == "rough" else L.sunny(B + 0.5 * np.array([0.3, -0.2, 0.4]))
    s = render.specular(
        render.load_scene(shell(THETA_O, B, ALPHA_V)), roughness=roughness, f0=0.3, spp=512, environment=light
    )
    open_cone = glossy.in_cone(B, ALPHA_V, V, roughness**2, light=light.lookup)
    # The whole sky, but for what lies below the horizon.
    whole = glossy.in_cone(np.array([0, 0, 1.0]), np.pi / 2, V, roughness**2, n_polar=800, light=light.lookup)
    for found, terms in ((s.radiance, open_cone), (s.unoccluded, whole)):
        expected = 0.3 * terms[0] + terms[1]
        for k in range(3):
            values = float64(found.mean)[..., k].ravel()
            # Creases of the map between the oracle's points, and the polygon that the rim is.
            assert_mean_is(values, expected[k], allowance=2e-3 * expected[k])
            # Neither kind of ray alone keeps the noise that low: the sun is found by 1 in 2000 of the lobe's.
            assert values.std() < 0.12 * expected[k]


def test_radiance_of_any_reflectance():
    scene, light = render.load_scene(S.stairs(16)), L.rough(8)
    first = render.specular(scene, f0=0.04, spp=16, environment=light)
    f0 = np.float32([1.0, 0.5, 0.1])
    again = render.specular(scene, f0=f0, spp=16, environment=light)
    for name in ("occlusion", "radiance", "unoccluded"):
        for a, b in zip(getattr(first.with_f0(f0), name), getattr(again, name), strict=True):
            np.testing.assert_array_equal(a.numpy(), b.numpy())
    plain = render.specular(scene, f0=f0, spp=16)
    np.testing.assert_array_equal(plain.lobes.numpy(), again.lobes.numpy())
    assert plain.radiance is None
    assert repr(again) == "Specular(16x16, 16 samples per pixel, with an environment)"


def test_variance_of_radiance():
    scene, light = render.load_scene(S.balls(32)), L.sunny((0.3, -0.5, 1))
    a, b = (render.specular(scene, roughness=0.5, f0=0.5, spp=64, seed=s, environment=light) for s in (1, 2))
    for name in ("radiance", "unoccluded"):
        one, two = getattr(a, name), getattr(b, name)
        for k in range(3):
            difference = float64(one.mean)[..., k] - float64(two.mean)[..., k]
            assert_no_excess(difference, float64(one.variance)[..., k] + float64(two.variance)[..., k])


def test_a_black_map():
    s = render.specular(render.load_scene(S.stairs(16)), spp=16, environment=L.constant(0, 0, 0))
    assert not s.radiance.mean.numpy().any()
    assert not s.unoccluded.mean.numpy().any()
    assert 0.2 < s.occlusion.mean.numpy().mean() < 1
