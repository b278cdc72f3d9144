"""Ray-traced occlusion of glossy reflections against quadrature, closed forms and its own batches."""

import math
from _statistics import assert_mean_is, assert_no_excess

import _scenes as S
import numpy as np
import pytest
from _openings import shell
from oracles import glossy, golden

from gtao import ConfigError, GBuffer, SceneError, ShapeError, render
from gtao.lighting import EnvironmentMap
from gtao.render import chunks
from gtao.render.specular_hemisphere import hemisphere_terms
from gtao.tables import brdf

import drjit as dr  # isort: skip
import mitsuba as mi  # isort: skip


def float64(tensor):
    return tensor.numpy().astype(np.float64)


def aslant(size=12):
    """A view along the ground, at angles from 45 degrees to 85."""
    return S.perspective((0, -3, 1), (0, 0, 0), fov=60.0, size=(size, size))


def load(scene):
    return render.load_scene(scene)


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("E.full_brdf"))
def test_a_cone_of_visibility(inputs, outputs):
    """Golden values of the split reflection of a cone, in and out of the plane of incidence."""
    f0, alpha = inputs["F0"], inputs["alpha"]
    _, b = glossy.frame(inputs["theta_o"], inputs["beta"], inputs["chi"])
    scene = load(shell(inputs["theta_o"], b, inputs["alpha_v"]))
    s = render.specular(scene, roughness=math.sqrt(alpha), f0=f0, spp=256, seed=1)
    lobes, whole = float64(s.lobes).reshape(-1, 2), float64(s.hemisphere).reshape(-1, 2)
    # Points off the middle of the speck appear under angles that differ by up to 1e-3.
    np.testing.assert_allclose(whole, [[outputs["A"], outputs["B"]]] * len(whole), rtol=0, atol=1e-3)
    # The rim of the opening is a polygon: a hundredth of a degree.
    for k, name in enumerate(("A_V", "B_V")):
        assert_mean_is(lobes[:, k], outputs[name], allowance=1e-4 * outputs[name])
    expected = (f0 * outputs["A_V"] + outputs["B_V"]) / (f0 * outputs["A"] + outputs["B"])
    assert_mean_is(float64(s.occlusion.mean).ravel(), expected, allowance=1e-4)
    mirror = float64(s.with_f0(1.0).occlusion.mean).ravel()
    assert_mean_is(mirror, outputs["S_F1"], allowance=1e-4)
    # A ray counts for at most 1 of A + B, which here are at least a half.
    assert mirror.std() < 2 * 0.5 / math.sqrt(256)


@pytest.mark.parametrize("roughness", [0.1, 0.45, 1.0])
@pytest.mark.parametrize(("theta_o", "beta", "chi", "alpha_v"), [(1.4, 0.2, 1.0, 0.9), (0.3, 1.1, 2.0, 1.3)])
def test_more_cones(roughness, theta_o, beta, chi, alpha_v):
    """Grazing views, and cones that the horizon cuts."""
    v, b = glossy.frame(theta_o, beta, chi)
    s = render.specular(load(shell(theta_o, b, alpha_v)), roughness=roughness, spp=256, seed=2)
    expected = glossy.in_cone(b, alpha_v, v, roughness**2)
    # The oracle's midpoints at a rim that the horizon cuts.
    for k in range(2):
        assert_mean_is(float64(s.lobes)[..., k].ravel(), expected[k], allowance=3e-4 * expected[k] + 1e-6)


@pytest.mark.parametrize("roughness", [0.0, 0.2, 0.5, 1.0])
def test_the_hemisphere_is_exact(roughness):
    scene = load(S.plane(aslant(8)))
    s = render.specular(scene, roughness=roughness, spp=8, n_batches=2)
    g = render.gbuffer(scene)
    n, p = float64(g.normal_v), float64(g.position_v)
    mask = g.mask.numpy()
    cosine = -(n * p).sum(-1)[mask] / np.linalg.norm(p[mask], axis=-1)
    for c, found in list(zip(cosine, float64(s.hemisphere)[mask], strict=True))[::17]:
        if roughness == 0:
            expected = np.array([1 - (1 - c) ** 5, (1 - c) ** 5])
        else:
            expected = glossy.whole(np.arccos(c), roughness**2)
        # Rounding of the cosine in single precision; the slopes by it are below 10.
        np.testing.assert_allclose(found, expected, rtol=0, atol=3e-6)


def test_the_hemisphere_of_the_tables():
    """Two quadratures on different variables, from mirrors to grazing views."""
    alpha, theta_o = (x.ravel() for x in np.meshgrid([0.001, 0.01, 0.1, 0.3, 1.0], [0.0, 0.5, 1.2, 1.5, 1.56]))
    ours = hemisphere_terms(mi.Float64(np.cos(theta_o)), mi.Float64(alpha))
    tables = brdf.hemisphere_terms(alpha, theta_o).values
    np.testing.assert_allclose(np.stack([x.numpy() for x in ours], -1), tables, rtol=0, atol=1e-6)


@pytest.mark.parametrize("roughness", [0.0, 0.3, 1.0])
def test_open_ground(roughness):
    """S = 1, without noise, and the lobes are those of the hemisphere."""
    s = render.specular(load(S.plane(aslant())), roughness=roughness, spp=16)
    mask = s.terms.mask
    assert mask.any()
    np.testing.assert_allclose(s.occlusion.mean.numpy(), 1, atol=1e-6)
    np.testing.assert_allclose(s.lobes.numpy()[mask], s.hemisphere.numpy()[mask], atol=1e-6)
    assert s.occlusion.variance.numpy().max() < 1e-12


def test_closed_box():
    box = S.closed_box(S.perspective((0.5, 0.3, -0.2), (-1, -0.8, 0.3), fov=70.0, size=(16, 16)))
    s = render.specular(load(box), spp=16)
    assert not s.occlusion.mean.numpy().any()
    assert not s.lobes.numpy().any()
    assert s.hemisphere.numpy().min() > 0


@pytest.mark.parametrize("seed", [0, 3])
def test_what_is_hidden_and_what_is_seen_make_the_whole(seed):
    """An opening, and the sphere's cap that would close it, of the same rays: A_V and its complement make A."""
    theta_o, alpha_v = 0.9, 0.8
    _, b = glossy.frame(theta_o, 0.3, 1.0)
    scene = load(shell(theta_o, b, alpha_v))
    capped = load(shell(theta_o, b, alpha_v, cap=True))
    light = EnvironmentMap(np.random.default_rng(1).exponential(size=(8, 16, 3)).astype(np.float32))
    s, c = (render.specular(x, roughness=0.6, spp=64, seed=seed, environment=light) for x in (scene, capped))
    np.testing.assert_allclose(s.lobes.numpy() + c.lobes.numpy(), s.hemisphere.numpy(), atol=1e-6)
    np.testing.assert_allclose(s.occlusion.mean.numpy() + c.occlusion.mean.numpy(), 1, atol=1e-5)
    np.testing.assert_array_equal(s.unoccluded.mean.numpy(), c.unoccluded.mean.numpy())
    np.testing.assert_allclose(s.radiance.mean.numpy() + c.radiance.mean.numpy(), s.unoccluded.mean.numpy(), rtol=1e-5)


def test_a_mirror_sees_one_point():
    """Ground before a wall: it mirrors either the wall or the sky."""
    d = S.plane(aslant(24))
    d["wall"] = S.cube([-50, 2, -1], [50, 3, 1])
    scene = load(d)
    s = render.specular(scene, roughness=0, spp=16)
    m, g = render.view_to_world(scene), render.gbuffer(scene)
    position = float64(g.position_v) @ m[:3, :3].T + m[:3, 3]
    up = float64(g.normal_v) @ m[:3, :3].T
    ground = g.mask.numpy() & (up[..., 2] > 0.9) & (position[..., 2] < 0.1)
    away = position - np.array([0, -3, 1.0])
    height = (2 - position[..., 1]) * -away[..., 2] / np.where(away[..., 1] == 0, 1, away[..., 1])
    found = s.occlusion.mean.numpy()
    hit, free = ground & (height < 0.999) & (position[..., 1] < 2), ground & (height > 1.001)
    assert hit.sum() > 20
    assert free.sum() > 20
    assert not found[hit].any()
    np.testing.assert_allclose(found[free], 1, atol=1e-6)


def test_any_reflectance_from_one_render():
    scene = load(S.stairs(16))
    first = render.specular(scene, f0=0.04, spp=16)
    for f0 in (0.7, np.float32([1.0, 0.3, 0.0]), np.full((16, 16), 0.2), np.full((16, 16, 3), 0.5, np.float32)):
        again = render.specular(scene, f0=f0, spp=16)
        for a, b in zip(first.with_f0(f0).occlusion, again.occlusion, strict=True):
            np.testing.assert_array_equal(a.numpy(), b.numpy())
        assert again.occlusion.mean.shape == ((16, 16, 3) if np.shape(f0)[-1:] == (3,) else (16, 16))
    coloured = first.with_f0(np.float32([1.0, 0.3, 0.0])).occlusion.mean.numpy()
    np.testing.assert_array_equal(coloured[..., 1], first.with_f0(np.float32(0.3)).occlusion.mean.numpy())


def test_without_reflectance_or_fresnel():
    """Seen straight down, a mirror of F0 = 0 reflects nothing: S is its limit, what the ray up sees."""
    for covered in (False, True):
        d = S.plane(S.perspective((0, 0, 3), (0, 0, 0), up=(0, 1, 0), fov=1e-3, size=(4, 4)))
        if covered:
            d["roof"] = S.cube([-1, -1, 4], [1, 1, 5])
        s = render.specular(load(d), roughness=0, f0=0.0, spp=8)
        np.testing.assert_allclose(s.occlusion.mean.numpy(), 0 if covered else 1, atol=1e-5)


def test_rough_images():
    """Every pixel has the roughness of its place."""
    scene = load(S.stairs(16))
    values = np.where(np.arange(16) < 8, 0.2, 0.7)[None, :].repeat(16, 0)
    mixed = render.specular(scene, roughness=values, spp=16)
    for columns, value in ((slice(8), 0.2), (slice(8, 16), 0.7)):
        plain = render.specular(scene, roughness=value, spp=16)
        np.testing.assert_array_equal(mixed.lobes.numpy()[:, columns], plain.lobes.numpy()[:, columns])
        np.testing.assert_array_equal(mixed.hemisphere.numpy()[:, columns], plain.hemisphere.numpy()[:, columns])


def leaning(g, normal_w, scene):
    normal = np.asarray(normal_w) @ render.view_to_world(scene)[:3, :3]
    return GBuffer(g.view_z, np.tile(normal, (*g.shape, 1)).astype(np.float32), g.camera)


def test_normals_of_the_buffer():
    """About a leaning normal, the plane is a horizon: half the sphere, about the true normal, is open."""
    sensor = S.perspective((0, 0, 3), (0, 0, 0), up=(0, 1, 0), fov=0.1, size=(16, 16))
    scene = load(S.plane(sensor))
    lean = 0.5
    g = leaning(render.gbuffer(scene), [math.sin(lean), 0, math.cos(lean)], scene)
    s = render.specular(scene, g, roughness=0.7, spp=256)
    # In the frame of the leaning normal the viewer and the true normal are in one direction.
    v, _ = glossy.frame(lean, 0, 0)
    expected = glossy.in_cone(v, math.pi / 2, v, 0.49)
    for k in range(2):
        assert_mean_is(float64(s.lobes)[..., k].ravel(), expected[k], allowance=3e-4 * expected[k])
    assert s.occlusion.mean.numpy().mean() < 0.97


def test_normals_that_face_away_are_turned_edge_on():
    sensor = S.perspective((0, 0, 3), (0, 0, 0), up=(0, 1, 0), fov=0.1, size=(8, 8))
    scene = load(S.plane(sensor))
    g = render.gbuffer(scene)
    away, edge = (
        render.specular(scene, leaning(g, [math.sin(t), 0, math.cos(t)], scene), roughness=0.5, spp=64)
        for t in (2.2, math.pi / 2 - 1e-3)
    )
    assert np.isfinite(away.occlusion.mean.numpy()).all()
    # Rounding turns the frames by 1e-7, and rays along the horizon with them.
    np.testing.assert_allclose(away.occlusion.mean.numpy(), edge.occlusion.mean.numpy(), atol=0.02)
    np.testing.assert_allclose(away.hemisphere.numpy(), edge.hemisphere.numpy(), atol=1e-3)


def test_distance_limits_occluders():
    scene = load(S.stairs(16))
    near, far = (render.specular(scene, max_distance=x, spp=16) for x in (0.3, math.inf))
    assert np.all(near.lobes.numpy().mean((0, 1)) > far.lobes.numpy().mean((0, 1)))


@pytest.mark.parametrize("f0", [0.04, 1.0])
def test_variance_is_that_of_the_mean(f0):
    scene = load(S.balls(48))
    for roughness in (0.15, 0.6, 1.0):
        # Few batches tell variance from the batches' mean square.
        a, b = (render.specular(scene, roughness=roughness, f0=f0, spp=32, seed=s, n_batches=4) for s in (1, 2))
        difference = float64(a.occlusion.mean) - float64(b.occlusion.mean)
        assert_no_excess(difference, float64(a.occlusion.variance) + float64(b.occlusion.variance))


def grazing(size):
    """A speck whose terms A and B are alike, half open."""
    return load(shell(1.3, glossy.frame(1.3, 0.3, 1.0)[1], 0.4, size=size))


def test_terms_are_correlated():
    scene = grazing(40)
    a, b = (render.specular(scene, roughness=0.5, f0=0.5, spp=32, seed=s, n_batches=4) for s in (1, 2))
    variance = float64(a.occlusion.variance) + float64(b.occlusion.variance)
    assert_no_excess(float64(a.occlusion.mean) - float64(b.occlusion.mean), variance)


def test_few_rays_are_unbiased():
    """Coefficients from the very rays that they correct would be off by the weights' noise."""
    scene = grazing(64)
    few, many = (render.specular(scene, roughness=0.8, spp=n, seed=3, n_batches=2) for n in (2, 512))
    for k in range(2):
        found, expected = (float64(x.lobes)[..., k] for x in (few, many))
        assert_mean_is((found - expected).ravel(), 0)
        assert found.std() > 0.2 * expected.mean()


def test_noise_of_weights_is_taken_out():
    """At most the noise of an indicator with what it is known to be from open surfaces; half of what it was."""
    scene = load(S.balls(24))
    s = render.specular(scene, roughness=0.6, f0=0.04, spp=256)
    mean, variance = (float64(x)[s.terms.mask] for x in s.occlusion)
    assert variance.mean() < 0.5 * np.clip(mean * (1 - mean), 0, None).mean() / 256
    # Blocks below: all of the dome or nothing of it, and no noise.
    assert variance[mean > 1 - 1e-6].max() < 1e-12


def test_same_seed_same_bits_however_the_work_is_cut(monkeypatch):
    scene = load(S.stairs(24))
    first = render.specular(scene, spp=32, seed=9)
    monkeypatch.setattr(chunks, "PATHS_PER_CHUNK", 1000)
    steps = []
    second = render.specular(scene, spp=32, seed=9, progress=lambda *s: steps.append(s))
    for a, b in zip(first.occlusion, second.occlusion, strict=True):
        np.testing.assert_array_equal(a.numpy(), b.numpy())
    assert len(steps) > 8
    assert steps == [(i, len(steps)) for i in range(1, len(steps) + 1)]
    other = render.specular(scene, spp=32, seed=10)
    assert not np.array_equal(first.lobes.numpy(), other.lobes.numpy())


def test_another_roughness_compiles_nothing():
    scene = load(S.stairs(16))
    render.specular(scene, spp=16)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history()
        render.specular(scene, roughness=0.9, f0=0.5, spp=32, seed=77, max_distance=2.0)
        history = [k for k in dr.kernel_history() if "cache_hit" in k]
    assert history
    assert all(k["cache_hit"] for k in history)


def test_an_empty_view():
    d = S.scene(S.perspective((0, 0, 4), (0, 0, 8), up=(0, 1, 0)), ball={"type": "sphere"})
    s = render.specular(load(d), spp=16)
    assert np.all(s.occlusion.mean.numpy() == 1)
    assert not s.occlusion.variance.numpy().any()
    assert not s.lobes.numpy().any()
    assert repr(s) == "Specular(32x32, 16 samples per pixel)"
    assert s._repr_png_().startswith(b"\x89PNG")


def test_bad_requests():
    scene = load(S.plane(aslant()))
    for bad, match in ((-0.1, "roughness must be in"), ([0.5] * 4, "roughness must be a number"), ("a", "roughness")):
        with pytest.raises(ShapeError, match=match):
            render.specular(scene, roughness=bad, spp=16)
    for bad, match in ((1.5, "f0 must be in"), ([0.5] * 4, "f0 must be a number"), (math.nan, "f0 must be in")):
        with pytest.raises(ShapeError, match=match):
            render.specular(scene, f0=bad, spp=16)
    with pytest.raises(ConfigError, match="max_distance must be positive"):
        render.specular(scene, max_distance=0)
    with pytest.raises(ConfigError, match="spp must be a multiple of n_batches"):
        render.specular(scene, spp=100)
    with pytest.raises(ConfigError, match="normals must be one of"):
        render.specular(scene, normals="none")
    with pytest.raises(ConfigError, match=r"environment must be a gtao.lighting.EnvironmentMap"):
        render.specular(scene, environment=3)
    with pytest.raises(SceneError, match="there is no sensor 3"):
        render.specular(scene, sensor=3)
