"""Environment light on its way between Mitsuba and maps."""

import numpy as np
import pytest

from gtao import ConfigError, SceneError, lighting, render
from gtao.lighting import EnvironmentMap
from gtao.render.environment import light_of, radiance

import mitsuba as mi  # isort: skip

import _lights as L
import _scenes as S


def directions(n=4000, seed=0):
    """Anywhere on the sphere, the axes among them."""
    w = np.random.default_rng(seed).normal(size=(n, 3))
    w = np.concatenate([w, np.eye(3), -np.eye(3)])
    return w / np.linalg.norm(w, axis=1, keepdims=True)


def seen(emitter, w):
    return radiance(emitter, mi.Vector3f(np.ascontiguousarray(w.T, dtype=np.float32))).numpy().T


def scene_with(emitter):
    d = S.plane(S.perspective((0, 0, 3), (0, 0, 0), up=(0, 1, 0), size=(8, 8)))
    if emitter is None:
        del d["dome"]
    else:
        d["dome"] = emitter
    return render.load_scene(d)


@pytest.mark.parametrize(("height", "width"), [(2, 2), (3, 5), (8, 16), (21, 40)])
def test_an_emitter_has_the_radiance_of_its_map(height, width):
    m = L.rough(height, seed=height, width=width)
    w = directions()
    # Texture coordinates of single precision, times the largest slope of a random map.
    np.testing.assert_allclose(seen(light_of(None, m), w), m.lookup(w), atol=1e-4, rtol=1e-5)


def test_a_reflection_of_the_map():
    m = EnvironmentMap(L.rough(8).radiance, L.rotation(4) @ np.diag([1.0, 1.0, -1.0]))
    w = directions()
    np.testing.assert_allclose(seen(light_of(None, m), w), m.lookup(w), atol=1e-4, rtol=1e-5)


def test_a_sun_keeps_its_radiance():
    m = L.sunny((0.3, 0.4, 0.8))
    w = np.array([[0.3, 0.4, 0.8]]) / np.linalg.norm([0.3, 0.4, 0.8])
    np.testing.assert_allclose(seen(light_of(None, m), w), m.lookup(w), rtol=1e-4)
    assert m.lookup(w).max() == pytest.approx(L.SUN, rel=1e-6)


@pytest.mark.parametrize("height", [5, 16])
def test_there_and_back(height):
    """Texels at their centres, where the interpolation is the texel."""
    m = L.rough(height, seed=3)
    back = render.environment(scene_with(render.environment_emitter(m)), height, samples=1)
    np.testing.assert_allclose(back.to_world, m.to_world, atol=1e-6)
    np.testing.assert_allclose(back.radiance, m.radiance, atol=1e-4)


def test_constant_light():
    emitter = {"type": "constant", "radiance": {"type": "rgb", "value": [0.2, 0.5, 2.0]}}
    m = render.environment(scene_with(emitter), 4)
    assert m.shape == (4, 8)
    np.testing.assert_allclose(m.radiance, np.tile([0.2, 0.5, 2.0], (4, 8, 1)), rtol=1e-6)
    np.testing.assert_array_equal(m.to_world, np.eye(3))


def test_texels_are_averages_over_the_solid_angle():
    """Coarse texels of a rough map add up to what its interpolation adds up to, and single samples do not."""
    fine = L.rough(32, seed=5)
    scene = scene_with(render.environment_emitter(fine))
    average, centres = (render.environment(scene, 4, samples=n).project(0) for n in (32, 1))
    # Per texel of the coarse map 1024 samples on a grid, of a function that is bilinear on 64 cells.
    total = fine.project(0)
    np.testing.assert_allclose(average, total, rtol=0.02)
    assert np.abs(centres / total - 1).max() > 0.05


def test_weights_within_a_texel():
    """Of a map that is white on one half of every coarse texel, the half nearer to the pole counts less."""
    texels = np.zeros((4, 8, 3), np.float32)
    texels[0] = texels[2] = 1
    m = EnvironmentMap(np.repeat(texels, 64, axis=0))  # rows of 1 and of 0, all but without a ramp between
    coarse = render.environment(scene_with(render.environment_emitter(m)), 2, samples=32).radiance[..., 0]
    quarter = np.cos(np.pi / 4)
    # The ramp is a 64th of a band wide.
    np.testing.assert_allclose(coarse[0], 1 - quarter, atol=0.02)
    np.testing.assert_allclose(coarse[1], quarter, atol=0.02)


def test_a_sky_with_a_sun():
    """The map lights an open plane as the emitter does, the half degree of its sun included."""
    emitter = {"type": "sunsky", "sun_direction": [0.5, 0.2, 0.8], "turbidity": 3.0}
    scene = scene_with(emitter)
    sun = np.array([0.5, 0.2, 0.8]) / np.linalg.norm([0.5, 0.2, 0.8])
    m = render.environment(scene, 64, samples=32)
    texel = np.unravel_index(m.radiance[..., 0].argmax(), m.shape)
    assert m.directions()[texel] @ sun > np.cos(1.5 * np.pi / 64)
    truth = render.irradiance(scene, spp=256).mean.numpy().reshape(-1, 3).mean(0)
    # Samples a 32nd of 2.8 degrees apart count a disc of half a degree to 5 %, and it gives most of the light.
    np.testing.assert_allclose(m.irradiance([0, 0, 1]), truth, rtol=0.05)
    # Without the sun the sky alone is far darker: the agreement is not one of skies.
    sky = render.environment(scene_with({**emitter, "sun_scale": 0.0}), 64)
    assert sky.irradiance([0, 0, 1]).max() < 0.5 * truth.max()


def test_a_scaled_frame_is_left():
    m = L.rough(8, seed=2)
    emitter = render.environment_emitter(m)
    turned = emitter["to_world"]
    emitter["to_world"] = turned @ S.transform().scale([1, 2, 1])
    scene = scene_with(emitter)
    back = render.environment(scene, 8, samples=1)
    np.testing.assert_array_equal(back.to_world, np.eye(3))
    w = back.directions().reshape(-1, 3)
    np.testing.assert_allclose(seen(scene.environment(), w), back.radiance.reshape(-1, 3), atol=1e-4)


def test_no_environment():
    with pytest.raises(SceneError, match="the scene has no environment light; add an emitter such as envmap"):
        render.environment(scene_with(None))
    with pytest.raises(SceneError, match=r"expected a mitsuba.Scene \(see gtao.render.load_scene\), got dict"):
        render.environment({})


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"height": 1}, "height must be an integer of at least 2, got 1"),
        ({"height": 8.0}, "height must be an integer of at least 2, got 8.0"),
        ({"height": True}, "height must be an integer of at least 2, got True"),
        ({"samples": 0}, "samples must be an integer of at least 1, got 0"),
    ],
)
def test_bad_sizes(options, message):
    with pytest.raises(ConfigError, match=message):
        render.environment(scene_with({"type": "constant"}), **options)


def test_not_a_map():
    with pytest.raises(ConfigError, match=r"environment must be a gtao.lighting.EnvironmentMap, got ndarray"):
        render.environment_emitter(np.ones((4, 8, 3)))


def test_view_to_world_takes_the_view_frame_there():
    origin, target = np.array([1.0, -2.0, 0.5]), np.array([0.3, 0.4, 0.1])
    scene = render.load_scene(S.plane(S.perspective(origin, target)))
    m = render.view_to_world(scene)
    assert m.shape == (4, 4)
    assert m.dtype == np.float64
    forward = (target - origin) / np.linalg.norm(target - origin)
    np.testing.assert_allclose(m @ [0, 0, -1, 0], [*forward, 0], atol=1e-6)
    np.testing.assert_allclose(m @ [0, 0, 0, 1], [*origin, 1], atol=1e-6)
    assert (m @ [0, 1, 0, 0])[2] > 0.9
    np.testing.assert_allclose(m[:3, :3] @ m[:3, :3].T, np.eye(3), atol=1e-6)
    # A light from the viewer's back comes from +z in the view frame.
    sh = lighting.to_view(lighting.basis(-forward, 1), m)
    np.testing.assert_allclose(sh, lighting.basis([0, 0, 1], 1), atol=1e-6)
    with pytest.raises(SceneError, match="there is no sensor 3"):
        render.view_to_world(scene, 3)
