"""The BSDF of composites: its definition, its sampling, and path tracing against the traced parts of the composite."""

import math
from _statistics import assert_mean_is

import _lights as lights
import _scenes as S
import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from _openings import shell
from oracles import glossy

from gtao import render


def float64(tensor):
    return tensor.numpy().astype(np.float64)


def side(bsdf, theta_o, n):
    """The BSDF, and n interactions that see it from one direction."""
    wo = glossy.frame(theta_o, 0, 0)[0]
    si = dr.zeros(mi.SurfaceInteraction3f, n)
    si.wi = mi.Vector3f(*map(float, wo))
    si.n = mi.Normal3f(0, 0, 1)
    si.sh_frame = mi.Frame3f(mi.Normal3f(0, 0, 1))
    return mi.load_dict(bsdf), si, wo


def uniform_points(n, seed):
    return mi.Point2f(np.random.default_rng(seed).random((2, n), dtype=np.float32))


@pytest.mark.parametrize("theta_o", [0.05, 0.7, 1.4])
@pytest.mark.parametrize(("roughness", "f0"), [(0.3, 0.04), (0.55, 0.9), (1.0, 0.0)])
def test_definition(roughness, f0, theta_o):
    bsdf, si, wo = side(render.coated(0.6, roughness, f0), theta_o, 4000)
    wi = mi.warp.square_to_uniform_hemisphere(uniform_points(4000, 1))
    found = bsdf.eval(mi.BSDFContext(), si, wi, True).numpy()
    directions = wi.numpy().T.astype(np.float64)
    a, b = glossy.split_brdf(directions, wo, roughness**2)
    A, B = glossy.whole(theta_o, roughness**2)
    expected = f0 * a + b + (1 - f0 * A - B) * 0.6 / math.pi * directions[:, 2]
    # Single precision where peaks are, and what a bilinear table of A and B loses.
    for channel in found:
        np.testing.assert_allclose(channel, expected, rtol=2e-4, atol=0.6 / math.pi * 1e-3)


@pytest.mark.parametrize("theta_o", [0.1, 1.0, 1.45])
def test_samples_are_of_the_density_and_the_weights_of_the_integral(theta_o):
    n, roughness = 1 << 18, 0.4
    bsdf, si, _ = side(render.coated(0.7, roughness, 0.3), theta_o, n)
    context, points = mi.BSDFContext(), uniform_points(n, 2)
    choice = mi.Float(np.random.default_rng(3).random(n, dtype=np.float32))
    drawn, weight = bsdf.sample(context, si, choice, points, True)
    value, pdf = bsdf.eval_pdf(context, si, drawn.wo, True)
    kept = drawn.pdf.numpy() > 0
    np.testing.assert_allclose(drawn.pdf.numpy()[kept], pdf.numpy()[kept], rtol=1e-5)
    np.testing.assert_allclose((weight * pdf).numpy()[:, kept], value.numpy()[:, kept], rtol=1e-4, atol=1e-6)
    # What it reflects of a white dome: F + (1 - F) ρ.
    A, B = glossy.whole(theta_o, roughness**2)
    F = 0.3 * A + B
    assert_mean_is(weight.numpy()[0].astype(np.float64), F + (1 - F) * 0.7, allowance=1e-3)
    # Mean of 1/pdf over drawn directions above the surface is the hemisphere, where the density is not 0.
    assert_mean_is(np.where(kept, 1 / np.where(kept, pdf.numpy(), 1), 0).astype(np.float64), 2 * math.pi)


def test_textures_and_the_albedo_of_frames():
    checker = {"type": "checkerboard", "color0": 0.2, "color1": 0.8, "to_uv": S.transform().scale([4, 4, 1])}
    rectangle = S.rectangle(S.transform().scale([2, 2, 1]))
    sensor = S.perspective((0, 0, 3), (0, 0, 0), up=(0, 1, 0), fov=40.0, size=(12, 12))
    albedo = {}
    for name, bsdf in (("coated", render.coated(checker, 0.3)), ("matte", {"type": "diffuse", "reflectance": checker})):
        scene = render.load_scene(S.scene(sensor, floor={**rectangle, "bsdf": bsdf}))
        albedo[name] = float64(render.gbuffer(scene).albedo)
    assert set(np.unique(albedo["matte"].round(4))) == {0.2, 0.8}
    np.testing.assert_allclose(albedo["coated"], albedo["matte"], atol=1e-6)


def test_light_from_below_and_other_variants():
    bsdf, si, _ = side(render.coated(), 0.5, 8)
    below = -mi.warp.square_to_uniform_hemisphere(uniform_points(8, 4))
    assert not bsdf.eval(mi.BSDFContext(), si, below, True).numpy().any()
    # Twice over: a plugin is registered once.
    assert render.coated(0.1)["bsdf"]["albedo"] == 0.1
    assert "Coated" in str(mi.load_dict(render.coated()["bsdf"]))


def test_path_tracing_finds_the_parts_of_the_composite():
    """Direct light of the path tracer through an opening, against irradiance and glossy reflection on their own."""
    albedo, roughness, f0 = 0.6, 0.5, 0.3
    theta_o = 0.8
    env = lights.rough(8, seed=1)
    described = shell(theta_o, glossy.frame(theta_o, 0.3, 0.9)[1], 0.9)
    described["speck"]["bsdf"] = render.coated(albedo, roughness, f0)
    described |= {"dome": render.environment_emitter(env), "integrator": {"type": "path", "max_depth": 2}}
    scene = render.load_scene(described)
    seen = float64(mi.render(scene, spp=1024))
    E = float64(render.irradiance(scene, spp=1024, environment=env).mean)
    glossy_part = render.specular(scene, roughness=roughness, f0=f0, spp=1024, environment=env)
    A, B = np.moveaxis(float64(glossy_part.hemisphere), -1, 0)
    below = (1 - f0 * A - B)[..., None] * albedo / math.pi * E
    composite = below + float64(glossy_part.radiance.mean)
    for channel in range(3):
        # Pixels see the speck under angles that differ by a thousandth; the table of A and B.
        allowance = 2e-3 * below[..., channel].mean()
        assert_mean_is((seen - composite)[..., channel].ravel(), 0.0, allowance)
