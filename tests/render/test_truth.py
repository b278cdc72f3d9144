"""Ray-traced visibility against closed forms."""

import math

import numpy as np
import pytest

from gtao import ConfigError, GBuffer, SceneError, render
from gtao.render import chunks

import drjit as dr  # isort: skip
import mitsuba as mi  # isort: skip

from _statistics import assert_mean_is, assert_no_excess

import _scenes as S


def down():
    return S.perspective((0, 0, 3), (0, 0, 0), up=(0, 1, 0), fov=60.0, size=(16, 16))


def groove_view():
    return S.perspective((0, 0, 1), (0, 0, 0), up=(0, 1, 0), fov=30.0, size=(16, 16))


def load(scene):
    return render.load_scene(scene)


@pytest.mark.parametrize("tilt", [0, 45, 80])
def test_open_plane_is_fully_visible(tilt):
    d = S.plane(down())
    d["floor"]["to_world"] = S.transform().rotate([1, 0, 0], tilt) @ d["floor"]["to_world"]
    v = render.visibility(load(d), spp=64)
    assert np.all(v.mean.numpy() == 1)
    assert np.all(v.variance.numpy() == 0)


def test_closed_box_is_dark_and_its_bent_normal_is_the_normal():
    scene = load(S.closed_box(S.perspective((0.5, 0.3, -0.2), (-1, -0.8, 0.3), fov=70.0, size=(16, 16))))
    g = render.gbuffer(scene)
    v = render.visibility(scene, g, spp=64)
    assert np.all(v.mean.numpy() == 0)
    assert np.all(v.mean_direction.numpy() == 0)
    np.testing.assert_allclose(v.bent_normal.numpy(), g.normal_v.numpy(), atol=1e-6)


@pytest.mark.parametrize("degrees", [40, 90, 150])
def test_groove(degrees):
    """Two half planes: (1 - cos α)/2 at every point of them."""
    alpha = math.radians(degrees)
    v = render.visibility(load(S.groove(alpha, groove_view())), spp=512, seed=degrees)
    # Half planes of length L = 1e4 instead of endless ones: less than x / (2 L) for points x < 2 from the seam.
    assert_mean_is(v.mean.numpy().ravel(), (1 - math.cos(alpha)) / 2, allowance=1e-4)


@pytest.mark.parametrize("degrees", [40, 90, 150])
def test_groove_by_solid_angle(degrees):
    """Uniform weighting: between two half planes a lune of the angle α is open, α/π of the hemisphere."""
    alpha = math.radians(degrees)
    v = render.visibility(load(S.groove(alpha, groove_view())), spp=512, seed=degrees, weighting="uniform")
    assert v.weighting == "uniform"
    # Directions within x / L = 2e-4 of the far ends of the half planes are open too, over their width of π.
    assert_mean_is(v.mean.numpy().ravel(), alpha / math.pi, allowance=1e-4)


def test_weighting_is_one_of_two():
    with pytest.raises(ConfigError, match="weighting must be 'cosine' or 'uniform', got 'angle'"):
        render.visibility(load(S.groove(1.0, groove_view())), weighting="angle")


def test_bent_normal_of_a_right_angle():
    """On the floor before an endless wall: mean direction (2/(3π), 0, 1/3), away from the wall and up."""
    view = S.perspective((0.3, -0.5, 1), (0, 0.1, 0), up=(0.2, 0.3, 1), fov=25.0, size=(16, 16))
    scene = load(S.groove(math.pi / 2, view))
    g = render.gbuffer(scene)
    v = render.visibility(scene, g, spp=1024, seed=1)
    n, b = g.normal_v.numpy().reshape(-1, 3), v.mean_direction.numpy().reshape(-1, 3)
    out_of_the_groove = render.camera_from_sensor(scene.sensors()[0])[1][2, :3]
    across = out_of_the_groove - (n @ out_of_the_groove)[:, None] * n
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    along = np.cross(n, across)
    for axis, expected in ((n, 1 / 3), (across, 2 / (3 * math.pi)), (along, 0.0)):
        assert_mean_is((b * axis).sum(1), expected, allowance=1e-4)
    unit = v.bent_normal.numpy().reshape(-1, 3)
    np.testing.assert_allclose(unit, b / np.linalg.norm(b, axis=1, keepdims=True), atol=1e-5)


def test_nothing_beyond_max_distance_occludes():
    """A floor under a ceiling at height h: rays of length D reach it within cos θ > h/D, so V = (h/D)²."""
    h = 0.5
    d = S.plane(S.perspective((0, 0, 0.4), (0, 0, 0), up=(0, 1, 0), fov=60.0, size=(16, 16)))
    d["ceiling"] = S.rectangle(S.transform().translate([0, 0, h]) @ S.transform().scale([S.FAR, S.FAR, 1]))
    scene = load(d)
    for reach in (0.6, 1.0, 3.0):
        v = render.visibility(scene, max_distance=reach, spp=256, seed=2)
        # Rays start some 1e-4 above the floor.
        assert_mean_is(v.mean.numpy().ravel(), (h / reach) ** 2, allowance=1e-3)
    assert np.all(render.visibility(scene, max_distance=0.49, spp=16).mean.numpy() == 1)
    # Only directions below atan(h / FAR) escape between the plates.
    assert render.visibility(scene, spp=16).mean.numpy().max() == 0


def test_background_is_open():
    d = S.scene(S.perspective((0, 0, 4), (0, 0, 0), up=(0, 1, 0)), ball={"type": "sphere"})
    scene = load(d)
    g = render.gbuffer(scene)
    v = render.visibility(scene, g, spp=16)
    background = ~g.mask.numpy()
    assert background.any()
    assert np.all(v.mean.numpy()[background] == 1)
    assert np.all(v.variance.numpy()[background] == 0)
    assert np.all(v.bent_normal.numpy()[background] == [0, 0, 1])
    assert np.all(v.mean_direction.numpy()[background] == 0)
    np.testing.assert_allclose(np.linalg.norm(v.bent_normal.numpy(), axis=-1), 1, atol=1e-6)


def test_an_empty_view():
    scene = load(S.scene(S.perspective((0, 0, 4), (0, 0, 8), up=(0, 1, 0)), ball={"type": "sphere"}))
    v = render.visibility(scene, spp=16)
    assert np.all(v.mean.numpy() == 1)
    assert v.bent_normal.shape == (32, 32, 3)


def test_variance_is_that_of_the_mean():
    """Two seeds differ by as much as their variances say."""
    scene = load(S.stairs(32))
    a, b = (render.visibility(scene, spp=64, seed=s, bent_normal=False) for s in (1, 2))
    assert a.bent_normal is None
    difference = a.mean.numpy().astype(np.float64) - b.mean.numpy()
    assert_no_excess(difference, a.variance.numpy().astype(np.float64) + b.variance.numpy())


def test_directions_are_about_the_normals_of_the_buffer():
    """A plane whose buffer claims leaning normals loses the directions below the plane: V = (1 + cos lean)/2."""
    scene = load(S.plane(down()))
    lean = 0.7
    g = render.gbuffer(scene)
    normal = np.tile([math.sin(lean), 0.0, math.cos(lean)], (*g.shape, 1)).astype(np.float32)
    v = render.visibility(scene, GBuffer(g.view_z, normal, g.camera), spp=256)
    assert_mean_is(v.mean.numpy().ravel(), (1 + math.cos(lean)) / 2)


def test_shading_and_geometric_truth_differ_on_a_coarse_mesh():
    vertices, faces = S.sphere_grid(8, 12)
    d = S.scene(S.perspective((0, -4, 1), (0, 0, 0), size=(32, 32)), ball=S.mesh(vertices, faces, normals=vertices))
    scene = load(d)
    geometric = render.visibility(scene, normals="geometric", spp=64)
    shading = render.visibility(scene, normals="shading", spp=64)
    # A convex body hides nothing from its faces; smooth normals lean below them.
    assert np.all(geometric.mean.numpy() == 1)
    assert shading.mean.numpy().min() < 0.99
    own = render.visibility(scene, render.gbuffer(scene, normals="geometric"), spp=64)
    np.testing.assert_array_equal(own.mean.numpy(), geometric.mean.numpy())


def test_same_seed_same_bits_however_the_work_is_cut(monkeypatch):
    scene = load(S.stairs(32))
    first = render.visibility(scene, spp=32, seed=9)
    monkeypatch.setattr(chunks, "PATHS_PER_CHUNK", 1000)
    steps = []
    second = render.visibility(scene, spp=32, seed=9, progress=lambda done, total: steps.append((done, total)))
    for name in ("mean", "variance", "bent_normal", "mean_direction"):
        np.testing.assert_array_equal(getattr(first, name).numpy(), getattr(second, name).numpy())
    assert not np.array_equal(first.mean.numpy(), render.visibility(scene, spp=32, seed=10).mean.numpy())
    total = steps[0][1]
    assert total > 8
    assert steps == [(i, total) for i in range(1, total + 1)]


def test_another_seed_compiles_nothing():
    scene = load(S.stairs(16))
    render.visibility(scene, spp=16, seed=0, max_distance=1.0)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history()
        render.visibility(scene, spp=32, seed=77, max_distance=2.0)
        history = [k for k in dr.kernel_history() if "cache_hit" in k]
    assert history
    assert all(k["cache_hit"] for k in history)


def test_buffer_of_another_scene_or_sensor():
    scene = load(S.stairs(32))
    other = render.gbuffer(load(S.cornell(32)))
    with pytest.raises(SceneError, match="not of this scene and sensor: its depth differs at"):
        render.visibility(scene, other)
    small = render.gbuffer(load(S.stairs(16)))
    with pytest.raises(SceneError, match="the G-buffer is 16x16 pixels, the sensor 32x32"):
        render.visibility(scene, small)


@pytest.mark.parametrize("distance", [0, -1.0, math.nan])
def test_bad_distance(distance):
    with pytest.raises(ConfigError, match="max_distance must be positive"):
        render.visibility(load(S.plane(down())), max_distance=distance)


def test_repr():
    v = render.visibility(load(S.plane(down())), spp=16)
    assert repr(v) == "Visibility(16x16, 16 rays per pixel, max_distance=inf)"
    assert v._repr_png_().startswith(b"\x89PNG")
    assert isinstance(v.mean, mi.TensorXf)
