"""Ray-traced irradiance against closed forms, the stock path tracer, and light in spherical harmonics."""

import math

import numpy as np
import pytest

from gtao import ConfigError, GBuffer, SceneError, lighting, render
from gtao.lighting import EnvironmentMap
from gtao.render import chunks

import drjit as dr  # isort: skip

from _statistics import assert_mean_is, assert_no_excess

import _lights as L
import _path
import _scenes as S

WHITE = EnvironmentMap(np.ones((4, 8, 3), np.float32))


def down(size=12):
    return S.perspective((0, 0, 3), (0, 0, 0), up=(0, 1, 0), fov=60.0, size=(size, size))


def load(scene):
    return render.load_scene(scene)


def float64(tensor):
    return tensor.numpy().astype(np.float64)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_open_plane_under_a_rough_map(seed):
    """Three colours of texels, turned by any rotation, integrated against the cosine."""
    light = L.rough(8, seed=seed)
    e = render.irradiance(load(S.plane(down())), environment=light, spp=256, seed=seed)
    assert e.mean.shape == e.variance.shape == (12, 12, 3)
    # The map's own integral misses what the plane's horizon cuts from a texel: compared with a finer one below.
    fine = [light.resized(64).irradiance([0, 0, 1]), light.resized(128).irradiance([0, 0, 1])]
    allowance = 2 * np.abs(fine[1] - fine[0])
    for k in range(3):
        assert_mean_is(float64(e.mean)[..., k].ravel(), fine[1][k], allowance=allowance[k])


def test_white_light_is_visibility():
    """E = π V, of the constant emitter and of a white map alike."""
    scene = load(S.stairs(24))
    v = float64(render.visibility(scene, spp=256, seed=1, max_distance=2.0).mean)
    mask = render.gbuffer(scene).mask.numpy()
    for light in (None, WHITE):
        e = render.irradiance(scene, environment=light, spp=256, seed=2, max_distance=2.0)
        difference = float64(e.mean)[mask].mean(-1) / math.pi - v[mask]
        assert_mean_is(difference, 0)
        # Four standard errors of two indicators by 256 independent rays each; stratified ones have less.
        np.testing.assert_allclose(difference, 0, atol=4 * math.sqrt(2 * 0.25 / 256))
        assert not e.mean.numpy()[~mask].any()
        assert not e.variance.numpy()[~mask].any()


def test_a_sun_converges():
    """One texel of 8e4 over a sky of less than 1: the light's sampling finds it, and its neighbours are no outliers."""
    towards = np.array([0.3, 0.4, 0.8])
    light = L.sunny(towards)
    e = render.irradiance(load(S.plane(down())), environment=light, spp=64, seed=3)
    expected = light.irradiance([0, 0, 1])
    sky = math.pi * np.array([0.3, 0.5, 1.0])
    assert np.all(expected > 100 * sky)
    for k in range(3):
        values = float64(e.mean)[..., k].ravel()
        # The sky is constant but for the sun: what the horizon cuts from a texel cancels to 1e-3 of it.
        assert_mean_is(values, expected[k], allowance=1e-3 * sky[k])
        # With directions by the cosine alone, 64 of which would hit the sun 0.03 times, the spread is 500 %.
        assert values.std() < 0.05 * expected[k]


def test_a_sun_casts_a_shadow():
    """A wall 1 high and a sun 45 degrees above it: what lies within 1 of the wall has the sky only."""
    scene = load(render.scenes.build("wall", width=32, height=32))
    light = L.sunny((1, 0, 1))
    e = render.irradiance(scene, environment=light, spp=64, seed=1)
    g = render.gbuffer(scene)
    m = render.view_to_world(scene)
    x, _, z = np.moveaxis(float64(g.position_v) @ m[:3, :3].T + m[:3, 3], -1, 0)
    ground, sky = np.abs(z) < 1e-3, math.pi
    # The sun's texel and the slopes to its neighbours are 11 degrees wide: a penumbra of 0.2 on either side.
    lit, shaded = ground & (x < -0.3), ground & (x > 0.3) & (x < 0.95)
    assert lit.sum() > 20
    assert shaded.sum() > 20
    red = e.mean.numpy()[..., 0]
    full = light.irradiance([0, 0, 1])[0]
    assert red[shaded].max() < sky
    assert full > 100 * sky
    # The sky is a thousandth of it.
    np.testing.assert_allclose(red[lit].mean(), full, rtol=0.01)


@pytest.mark.parametrize("name", ["stairs", "balls"])
@pytest.mark.parametrize("kind", ["rough", "sunny"])
def test_the_path_tracer_reflects_it(name, kind):
    """Of direct light, a diffuse surface reflects ρ/π times the irradiance."""
    light = L.rough(8, seed=7) if kind == "rough" else L.sunny((-0.3, -0.6, 0.5))
    d = {"stairs": S.stairs, "balls": S.balls}[name](24)
    d["dome"] = render.environment_emitter(light)
    scene, batches = load(d), 16
    mask = render.gbuffer(scene).mask.numpy()
    stock = math.pi * _path.reflected(scene, 0.6, 1, 256, batches, seed=3).astype(np.float64)[:, mask]
    e = render.irradiance(scene, environment=light, spp=256, seed=5, n_batches=batches)
    ours, variance = float64(e.mean)[mask][:, 0], float64(e.variance)[mask][:, 0]
    assert mask.sum() > 300
    assert_mean_is(stock.mean(0) - ours, 0)
    assert_no_excess(stock.mean(0) - ours, stock.var(0, ddof=1) / batches + variance)
    own = render.irradiance(scene, spp=256, seed=5, n_batches=batches)
    np.testing.assert_array_equal(own.mean.numpy(), e.mean.numpy())


@pytest.mark.parametrize("sensor", [0, 1])
def test_smooth_light_is_a_sum_over_harmonics(sensor):
    """For light of bands 0 to 2, E = Σ L V' with the traced coefficients of visibility, in the view frame."""
    scene = load(render.scenes.build("stairs", width=24, height=24))
    rng = np.random.default_rng(5)
    sh = np.concatenate([[[8.0, 9.0, 10.0]], rng.normal(size=(8, 3))])
    texels = lighting.evaluate(sh, WHITE.resized(64).directions().reshape(-1, 3)).reshape(64, 128, 3)
    light = EnvironmentMap(texels.astype(np.float32), L.rotation(3))
    e = render.irradiance(scene, environment=light, spp=256, seed=1, sensor=sensor)
    v = render.directional(scene, spp=256, seed=2, sensor=sensor)
    turned = lighting.to_view(light.project(2), render.view_to_world(scene, sensor))
    expected = float64(v.mean) @ turned
    difference = (float64(e.mean) - expected)[v.mask.numpy()]
    for k in range(3):
        # Between texels of 3 degrees, interpolation is off by an eighth of the step squared times the curvature.
        assert_mean_is(difference[:, k], 0, allowance=4e-4 * expected[..., k].max())
    wrong = float64(v.mean) @ light.project(2)
    assert np.abs(wrong - expected)[v.mask.numpy()].mean() > 20 * np.abs(difference.mean(0)).max()


def test_a_map_takes_the_place_of_the_scenes_own_light():
    scene = load(S.stairs(16))
    own, other = (render.irradiance(scene, environment=light, spp=16) for light in (None, L.rough(8)))
    assert not np.allclose(own.mean.numpy(), other.mean.numpy(), atol=0.1)
    np.testing.assert_array_equal(float64(own.mean)[..., 0], float64(own.mean)[..., 2])


def test_lamps_occlude_and_give_no_light():
    d = S.plane(down())
    free = render.irradiance(load(d), environment=WHITE, spp=64).mean.numpy()
    lamp = S.rectangle(S.transform().translate([0, 0, 5]) @ S.transform().rotate([1, 0, 0], 180))
    d["lamp"] = {**lamp, "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 9.0}}}
    covered = render.irradiance(load(d), environment=WHITE, spp=64).mean.numpy()
    assert np.all(covered < free + 0.1)
    # A square of side 2 at height 5 takes 4/25 of the light below its middle, a little less for its width.
    centre = (covered / free)[5:7, 5:7].mean()
    assert 0.84 < centre < 1 - 0.9 * 4 / (25 * math.pi)


def test_directions_are_about_the_normals_of_the_buffer():
    """Above a plane whose buffer claims leaning normals: E = π (1 + cos lean)/2 of white light."""
    scene = load(S.plane(down()))
    lean = 0.7
    g = render.gbuffer(scene)
    normal = np.tile([math.sin(lean), 0.0, math.cos(lean)], (*g.shape, 1)).astype(np.float32)
    e = render.irradiance(scene, g=GBuffer(g.view_z, normal, g.camera), environment=WHITE, spp=256)
    values, expected = float64(e.mean)[..., 1].ravel(), math.pi * (1 + math.cos(lean)) / 2
    assert_mean_is(values, expected)
    # Between plane and horizon the light's sampling draws directions whose cosine to the normal is negative.
    assert values.std() < 0.05 * expected


def test_a_black_map_and_a_closed_box():
    scene = load(S.stairs(16))
    black = EnvironmentMap(np.zeros((4, 8, 3), np.float32))
    assert not render.irradiance(scene, environment=black, spp=16).mean.numpy().any()
    box = load(S.closed_box(S.perspective((0.5, 0.3, -0.2), (-1, -0.8, 0.3), fov=70.0, size=(16, 16))))
    assert not render.irradiance(box, environment=L.sunny((0, 0, 1)), spp=16).mean.numpy().any()


def test_an_empty_view():
    scene = load(S.scene(S.perspective((0, 0, 4), (0, 0, 8), up=(0, 1, 0)), ball={"type": "sphere"}))
    e = render.irradiance(scene, environment=WHITE, spp=16)
    assert e.mean.shape == (32, 32, 3)
    assert not e.mean.numpy().any()


def test_variance_is_that_of_the_mean():
    scene, light = load(S.stairs(32)), L.rough(8)
    a, b = (render.irradiance(scene, environment=light, spp=64, seed=s) for s in (1, 2))
    for k in range(3):
        difference = float64(a.mean)[..., k] - float64(b.mean)[..., k]
        assert_no_excess(difference, float64(a.variance)[..., k] + float64(b.variance)[..., k])


def test_same_seed_same_bits_however_the_work_is_cut(monkeypatch):
    scene, light = load(S.stairs(24)), L.rough(8)
    first = render.irradiance(scene, environment=light, spp=32, seed=9)
    monkeypatch.setattr(chunks, "PATHS_PER_CHUNK", 1000)
    steps = []
    second = render.irradiance(scene, environment=light, spp=32, seed=9, progress=lambda *s: steps.append(s))
    for name in ("mean", "variance"):
        np.testing.assert_array_equal(getattr(first, name).numpy(), getattr(second, name).numpy())
    assert len(steps) > 8
    assert steps == [(i, len(steps)) for i in range(1, len(steps) + 1)]
    assert not np.array_equal(
        first.mean.numpy(), render.irradiance(scene, environment=light, spp=32, seed=10).mean.numpy()
    )


def test_another_seed_compiles_nothing():
    scene, light = load(S.stairs(16)), L.rough(8)
    render.irradiance(scene, environment=light, spp=16, seed=0, max_distance=1.0)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history()
        render.irradiance(scene, environment=light, spp=32, seed=77, max_distance=2.0)
        history = [k for k in dr.kernel_history() if "cache_hit" in k]
    assert history
    assert all(k["cache_hit"] for k in history)


def test_bad_requests():
    d = S.plane(down())
    scene = load(d)
    with pytest.raises(ConfigError, match="max_distance must be positive"):
        render.irradiance(scene, environment=WHITE, max_distance=0)
    with pytest.raises(ConfigError, match="spp must be a multiple of n_batches"):
        render.irradiance(scene, environment=WHITE, spp=100)
    with pytest.raises(ConfigError, match="normals must be one of"):
        render.irradiance(scene, environment=WHITE, normals="none")
    with pytest.raises(ConfigError, match=r"environment must be a gtao.lighting.EnvironmentMap, got GBuffer"):
        render.irradiance(scene, environment=render.gbuffer(scene))
    with pytest.raises(SceneError, match="there is no sensor 3"):
        render.irradiance(scene, environment=WHITE, sensor=3)
    del d["dome"]
    dark = load(d)
    with pytest.raises(SceneError, match="the scene has no environment light"):
        render.irradiance(dark)
    e = render.irradiance(dark, environment=WHITE, spp=16)
    assert repr(e) == "Irradiance(12x12, 16 samples per pixel, max_distance=inf)"
