"""Occlusion of reflections by Mitsuba's own BSDFs: against its path tracer, and against ours where both agree."""

from _statistics import assert_mean_is, assert_no_excess

import _lights as L
import _path
import _scenes as S
import numpy as np
import pytest
from oracles import glossy

from gtao import ConfigError, render

import drjit as dr  # isort: skip
import drjit.llvm.ad as ad  # isort: skip
import mitsuba as mi  # isort: skip


def float64(tensor):
    return tensor.numpy().astype(np.float64)


BLACK = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
COPPER = {"type": "roughconductor", "material": "Cu", "distribution": "ggx"}
BSDFS = {
    "conductor": {**COPPER, "alpha": 0.3},
    "brushed": {**COPPER, "alpha_u": 0.5, "alpha_v": 0.1},
    "mirror": {"type": "conductor", "material": "Cu"},
    "checkered": {
        "type": "principled",
        "base_color": {
            "type": "checkerboard",
            "color0": {"type": "rgb", "value": [0.9, 0.5, 0.1]},
            "color1": {"type": "rgb", "value": [0.1, 0.2, 0.7]},
        },
        "roughness": 0.4,
        "metallic": 0.3,
    },
}


def ground(bsdf, light=None, size=20):
    """A floor of a material that reflects a black block."""
    d = S.scene(S.perspective((0.5, -3, 1.2), (0, 0, 0), fov=50.0, size=(size, size)))
    turned = S.transform().rotate([0, 0, 1], 25) @ S.transform().scale([2, 2, 1])
    d["floor"] = {"type": "rectangle", "to_world": turned, "bsdf": dict(bsdf)}
    d["block"] = {**S.cube([-0.5, 0.2, 0], [0.5, 1.0, 0.8]), "bsdf": BLACK}
    if light is not None:
        d["dome"] = render.environment_emitter(light)
    return render.load_scene(d)


def on_floor(scene):
    """Where the floor is seen."""
    g, m = render.gbuffer(scene), render.view_to_world(scene)
    height = (float64(g.position_v) @ m[:3, :3].T + m[:3, 3])[..., 2]
    return g.mask.numpy() & (np.abs(np.where(g.mask.numpy(), height, 1)) < 1e-3)


@pytest.mark.parametrize("name", list(BSDFS))
@pytest.mark.parametrize("kind", ["white", "rough", "sunny"])
def test_the_path_tracer_sees_it(name, kind):
    """Light of one reflection, of what is straight from the dome: its radiance, and its occlusion under a white one."""
    light = {"white": None, "rough": L.rough(8, seed=7), "sunny": L.sunny((0.3, 0.9, 0.6))}[kind]
    scene, batches = ground(BSDFS[name], light), 16
    mask = on_floor(scene)
    assert mask.sum() > 100
    stock = _path.radiance(scene, 1, 512, batches, seed=3).astype(np.float64)[:, mask]
    ours = render.specular(
        scene, bsdf=BSDFS[name], spp=256, seed=5, n_batches=batches, environment=light or L.constant(1, 1, 1)
    )
    mean, variance = (float64(x)[mask] for x in ours.radiance)
    difference = stock.mean(0) - mean
    noise = stock.var(0, ddof=1) / batches + variance
    for k in range(3):
        # In units of the light, so that no pixel that the sun is mirrored to speaks for all.
        scale = 1 / np.maximum(mean[:, k].mean(), mean[:, k])
        assert_mean_is(difference[:, k] * scale, 0, allowance=1e-6)
        if name != "mirror":
            assert_no_excess(difference[:, k] * scale, noise[:, k] * scale**2)
    assert np.abs(mean - float64(ours.unoccluded.mean)[mask]).max() > 0.1 * np.median(mean)
    if kind == "white":
        # What a white dome reflects, with and without occlusion, by rays that differ in nothing but the light's own.
        ratio = mean / float64(ours.unoccluded.mean)[mask]
        spread = (ratio - float64(ours.occlusion.mean)[mask]).mean(0)
        np.testing.assert_allclose(spread, 0, atol=5e-3)


def test_one_bsdf_that_we_have():
    """Straight down there is no masking, and shadowing is the same: a conductor without Fresnel's colours is ours."""
    d = S.plane(S.perspective((0, 0, 3), (0, 0, 0), up=(0, 1, 0), fov=0.1, size=(16, 16)))
    d["block"] = S.cube([0.3, -9, -1], [9, 9, 1])
    scene = render.load_scene(d)
    white = {"type": "roughconductor", "material": "none", "alpha": 0.25, "distribution": "ggx"}
    theirs, ours = (render.specular(scene, spp=256, f0=1.0, **x) for x in ({"bsdf": white}, {"roughness": 0.5}))
    for k in range(3):
        difference = float64(theirs.occlusion.mean)[..., k] - float64(ours.occlusion.mean)
        assert_mean_is(difference.ravel(), 0)
    assert 0.2 < ours.occlusion.mean.numpy().mean() < 0.8
    assert theirs.occlusion.mean.shape == (16, 16, 3)


def test_variance_of_a_ratio():
    scene = ground(BSDFS["conductor"], size=32)
    a, b = (render.specular(scene, bsdf=BSDFS["conductor"], spp=128, seed=s) for s in (1, 2))
    for k in range(3):
        difference = float64(a.occlusion.mean)[..., k] - float64(b.occlusion.mean)[..., k]
        assert_no_excess(difference, float64(a.occlusion.variance)[..., k] + float64(b.occlusion.variance)[..., k])


def test_nothing_reflected_is_nothing_occluded():
    s = render.specular(ground(BLACK), bsdf=BLACK, spp=16, environment=L.rough(8))
    assert np.all(s.occlusion.mean.numpy() == 1)
    assert not s.radiance.mean.numpy().any()


def test_what_is_transmitted_does_not_count():
    scene = ground(BLACK, size=12)
    s = render.specular(scene, bsdf={"type": "dielectric"}, spp=64, environment=L.constant(1, 1, 1))
    mask = on_floor(scene)
    unoccluded = s.unoccluded.mean.numpy()[mask]
    # Fresnel's reflection of glass at 30 to 80 degrees, chosen by chance.
    assert 0.03 < np.median(unoccluded) < unoccluded.max() < 0.6
    assert set(np.unique(s.occlusion.mean.numpy())) <= {0.0, 1.0}


def test_terms_are_ours_alone():
    s = render.specular(ground(BLACK), bsdf=BSDFS["conductor"], spp=16)
    for what in (lambda: s.with_f0(0.5), lambda: s.lobes, lambda: s.hemisphere):
        with pytest.raises(ConfigError, match="no terms that hold for every F0"):
            what()
    assert s.radiance is None


def directions(n=2000, seed=1):
    w = np.random.default_rng(seed).normal(size=(3, n))
    return w / np.linalg.norm(w, axis=0)


@pytest.mark.parametrize("Array", ["mi", "float32", "float64"])
def test_functions_of_two_directions(Array):
    """Of a conductor with separable masking, and of matte paint."""
    kind = {"mi": mi.Vector3f, "float32": ad.Array3f, "float64": ad.Array3f64}[Array]
    wi, wo = directions(), directions(seed=2)
    above = (wi[2] > 0) & (wo[2] > 0)
    matte = render.brdf({"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.2, 0.6, 0.4]}})
    found = matte(kind(wi), kind(wo)).numpy()
    luminance = np.dot([0.212671, 0.715160, 0.072169], [0.2, 0.6, 0.4])
    np.testing.assert_allclose(found, np.where(above, luminance * wi[2] / np.pi, 0), rtol=1e-5, atol=1e-7)

    alpha = 0.3
    rough = render.brdf(
        mi.load_dict({"type": "roughconductor", "material": "none", "alpha": alpha, "distribution": "ggx"})
    )
    found = rough(kind(wi), kind(wo)).numpy()
    ours = np.array([glossy.split_brdf(i, o, alpha).sum() if o[2] > 0 else 0 for i, o in zip(wi.T, wo.T, strict=True)])
    # G₂ / (4 cos cos) is 1 / (1 + Λ + Λ) over that with correlated heights, 1 / ((1 + Λ)(1 + Λ)) without.
    Λi, Λo = (0.5 * (np.sqrt(1 + alpha**2 * (1 / w[2] ** 2 - 1)) - 1) for w in (wi, wo))
    np.testing.assert_allclose(
        found, np.where(above, ours * (1 + Λi + Λo) / ((1 + Λi) * (1 + Λo)), 0), rtol=2e-4, atol=1e-6
    )
    assert dr.width(rough(kind([0, 0, 1]), kind(wo))) == wo.shape[1]

    # What glass lets through is no reflection.
    glass = render.brdf({"type": "roughdielectric", "alpha": 0.5})(kind(wi), kind(wo)).numpy()
    assert not glass[~above].any()
    assert (glass[above] > 0).mean() > 0.9


def test_bad_bsdfs():
    scene = ground(BLACK)
    for bad, match in (
        ({"type": "sphere"}, "got Shape"),
        ({"type": "nonesuch"}, "does not load"),
        (3, "got int"),
    ):
        with pytest.raises(ConfigError, match=match):
            render.specular(scene, bsdf=bad, spp=16)
        with pytest.raises(ConfigError, match=match):
            render.brdf(bad)
