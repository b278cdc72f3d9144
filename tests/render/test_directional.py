"""Ray-traced spherical harmonics of visibility against closed forms, quadrature and the ray-traced visibility."""

import math

import numpy as np
import pytest

from gtao import ConfigError, GBuffer, SceneError, render
from gtao.render import chunks
from tests.oracles import harmonics

import drjit as dr  # isort: skip

from _statistics import assert_mean_is, assert_no_excess

import _scenes as S

#: Single precision: sums of up to 64 rays of monomials, whose coefficients reach 10.
ROUNDING = 1e-5


def down():
    return S.perspective((0, 0, 3), (0, 0, 0), up=(0, 1, 0), fov=60.0, size=(12, 12))


def groove_view():
    return S.perspective((0.3, -0.5, 1), (0, 0.1, 0), up=(0.2, 0.3, 1), fov=25.0, size=(16, 16))


def load(scene):
    return render.load_scene(scene)


def float64(tensor):
    return tensor.numpy().astype(np.float64)


def ball():
    return load(S.scene(S.perspective((0, 0, 4), (0, 0, 0), up=(0, 1, 0)), ball={"type": "sphere"}))


def wedge(normal, up, angle, weighting, order):
    """Coefficients of a wedge that opens by ``angle`` from a plane with this normal and across it towards ``up``.

    Gauss-Legendre in the angle from the wedge's edge and in the angle about it: the integrand is smooth in both.
    """
    across = up - (up @ normal) * normal
    across /= np.linalg.norm(across)
    node, weight = np.polynomial.legendre.leggauss(24)
    polar, around = 0.5 * math.pi * (node + 1), 0.5 * angle * (node + 1)
    sine = np.sin(polar)[:, None, None]
    plane = np.cos(around)[:, None] * across + np.sin(around)[:, None] * normal
    w = np.cos(polar)[:, None, None] * np.cross(across, normal) + sine * plane
    density = 0.25 * math.pi * angle * weight[:, None] * weight * sine[..., 0]
    if weighting == "cosine":
        density = density * (w @ normal)
    return np.einsum("ij,ijk->k", density, harmonics.basis(w, order))


def assert_coefficients(v, expected, allowance):
    """Pooled over all pixels, every coefficient is as expected, (N, n)."""
    difference = float64(v.mean).reshape(-1, v.mean.shape[-1]) - expected
    for k in range(difference.shape[1]):
        assert_mean_is(difference[:, k], 0, allowance=allowance)


@pytest.mark.parametrize("order", [0, 1, 2, 3, 4])
@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
def test_open_plane_is_the_kernel_about_the_normal(weighting, order):
    """K_l Y_lm(N) with the zonal kernel of the clamped cosine, or of the hemisphere."""
    lean = 0.6
    scene = load(render.scenes.build("open_plane", width=12, height=12, tilt=lean))
    v = render.directional(scene, spp=256, order=order, weighting=weighting, seed=5)
    assert v.mask.numpy().all()
    kernel = {
        "cosine": (math.pi, 2 * math.pi / 3, math.pi / 4, 0.0, -math.pi / 24),
        "uniform": (2 * math.pi, math.pi, 0.0, -math.pi / 4, 0.0),
    }[weighting]
    band = np.repeat(np.arange(order + 1), 2 * np.arange(order + 1) + 1)
    assert v.mean.shape == v.variance.shape == (12, 12, (order + 1) ** 2)
    # The camera looks straight down, +y up: its frame is the world's.
    expected = np.asarray(kernel)[band] * harmonics.basis([0, -math.sin(lean), math.cos(lean)], order)
    assert_coefficients(v, expected, ROUNDING)
    np.testing.assert_allclose(v.visibility.numpy(), 1, atol=ROUNDING)


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
@pytest.mark.parametrize("degrees", [40, 90, 150])
def test_groove(degrees, weighting):
    """Each face of a groove sees the wedge between itself and the other one."""
    alpha = math.radians(degrees)
    scene = load(S.groove(alpha, groove_view()))
    v = render.directional(scene, spp=512, seed=degrees, order=4, weighting=weighting)
    up = render.camera_from_sensor(scene.sensors()[0])[1][2, :3]
    expected = np.stack([wedge(n, up, alpha, weighting, 4) for n in float64(v.normal_v).reshape(-1, 3)])
    # Directions within x / L = 2e-4 of the far ends of the half planes are open too, over their width of 2; values
    # of the basis are at most 1.1 there.
    assert_coefficients(v, expected, 5e-4)


@pytest.mark.parametrize("sensor", [0, 1])
def test_ground_before_a_wall(sensor):
    """The wall's rim leaves a wedge open, of another angle at every pixel."""
    scene = load(render.scenes.build("wall", width=24, height=24))
    g = render.gbuffer(scene, sensor)
    v = render.directional(scene, g, spp=256, seed=1, order=4, sensor=sensor)
    to_world = render.camera_from_sensor(scene.sensors()[sensor])[1]
    position = to_world[:3, :3] @ np.moveaxis(float64(g.position_v), -1, 0).reshape(3, -1) + to_world[:3, 3:]
    before = (np.abs(position[2]) < 1e-3) & (position[0] < 0.98)  # the wall stands at x = 1 and is 1 high
    assert before.sum() > 50
    normal, away = to_world[2, :3], -to_world[0, :3]
    angle = math.pi - np.arctan(1 / (1 - position[0, before]))
    expected = np.stack([wedge(normal, away, a, "cosine", 4) for a in angle])
    difference = float64(v.mean).reshape(-1, 25)[before] - expected
    for k in range(25):
        # The wall ends far away, and rays start 1e-4 above the ground.
        assert_mean_is(difference[:, k], 0, allowance=5e-4)
    assert_no_excess(difference, float64(v.variance).reshape(-1, 25)[before])


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
@pytest.mark.parametrize("order", [0, 1, 2, 4])
def test_first_bands_are_the_visibility_and_its_direction(order, weighting):
    scene = load(S.balls(24))
    options = {"max_distance": 1.0, "spp": 64, "seed": 4, "weighting": weighting}
    v, d = render.visibility(scene, **options), render.directional(scene, order=order, **options)
    np.testing.assert_allclose(d.visibility.numpy(), v.mean.numpy(), atol=ROUNDING)
    factor = 4 * math.pi / (math.pi if weighting == "cosine" else 2 * math.pi) ** 2
    np.testing.assert_allclose(factor * d.variance.numpy()[..., 0], v.variance.numpy(), atol=ROUNDING**2, rtol=1e-3)
    if order == 0:
        assert d.mean_direction is None
        assert d.bent_normal is None
        return
    np.testing.assert_allclose(d.mean_direction.numpy(), v.mean_direction.numpy(), atol=ROUNDING)
    length = np.linalg.norm(v.mean_direction.numpy(), axis=-1)
    assert (length > 0.02).mean() > 0.8
    difference = np.where(length[..., None] > 0.02, d.bent_normal.numpy() - v.bent_normal.numpy(), 0)
    np.testing.assert_allclose(difference, 0, atol=ROUNDING / 0.02)


def test_closed_box_is_dark_and_its_bent_normal_is_the_normal():
    scene = load(S.closed_box(S.perspective((0.5, 0.3, -0.2), (-1, -0.8, 0.3), fov=70.0, size=(16, 16))))
    g = render.gbuffer(scene)
    v = render.directional(scene, g, spp=64, order=4)
    assert not v.mean.numpy().any()
    assert not v.variance.numpy().any()
    assert not v.visibility.numpy().any()
    np.testing.assert_allclose(v.bent_normal.numpy(), g.normal_v.numpy(), atol=1e-6)


def test_background():
    scene = ball()
    v = render.directional(scene, spp=16)
    background = ~render.gbuffer(scene).mask.numpy()
    assert background.any()
    np.testing.assert_array_equal(v.mask.numpy(), ~background)
    assert not v.mean.numpy()[background].any()
    assert not v.variance.numpy()[background].any()
    assert np.all(v.visibility.numpy()[background] == 1)
    assert not v.mean_direction.numpy()[background].any()
    assert np.all(v.normal_v.numpy()[background] == [0, 0, 1])
    assert np.all(v.bent_normal.numpy()[background] == [0, 0, 1])


def test_an_empty_view():
    scene = load(S.scene(S.perspective((0, 0, 4), (0, 0, 8), up=(0, 1, 0)), ball={"type": "sphere"}))
    v = render.directional(scene, spp=16)
    assert v.mean.shape == (32, 32, 9)
    assert not v.mean.numpy().any()
    assert np.all(v.visibility.numpy() == 1)


def test_variance_is_that_of_the_mean():
    scene = load(S.stairs(32))
    a, b = (render.directional(scene, spp=64, seed=s, order=4) for s in (1, 2))
    for k in range(25):
        difference = float64(a.mean)[..., k] - float64(b.mean)[..., k]
        assert_no_excess(difference, float64(a.variance)[..., k] + float64(b.variance)[..., k])


def test_directions_are_about_the_normals_of_the_buffer():
    """A plane whose buffer claims leaning normals: what is open is the wedge above the plane."""
    scene = load(S.plane(down()))
    lean = 0.7
    g = render.gbuffer(scene)
    normal = np.array([math.sin(lean), 0.0, math.cos(lean)])
    turned = GBuffer(g.view_z, np.tile(normal, (*g.shape, 1)).astype(np.float32), g.camera)
    v = render.directional(scene, turned, spp=512, order=4)
    np.testing.assert_allclose(v.normal_v.numpy(), turned.normal_v.numpy(), atol=1e-6)
    # Of the hemisphere about the normal, what is below the plane is missing on the side that the normal leans to.
    expected = wedge(normal, np.array([0.0, 0.0, 1.0]), math.pi - lean, "cosine", 4)
    assert_coefficients(v, expected, ROUNDING)


def test_lower_orders_are_the_first_of_higher_ones():
    scene = load(S.balls(24))
    high = render.directional(scene, spp=32, seed=2, order=4).mean.numpy()
    for order in range(4):
        low = render.directional(scene, spp=32, seed=2, order=order).mean.numpy()
        np.testing.assert_allclose(low, high[..., : (order + 1) ** 2], atol=ROUNDING)


def test_same_seed_same_bits_however_the_work_is_cut(monkeypatch):
    scene = load(S.stairs(24))
    first = render.directional(scene, spp=32, seed=9)
    monkeypatch.setattr(chunks, "PATHS_PER_CHUNK", 1000)
    steps = []
    second = render.directional(scene, spp=32, seed=9, progress=lambda *s: steps.append(s))
    for name in ("mean", "variance", "normal_v"):
        np.testing.assert_array_equal(getattr(first, name).numpy(), getattr(second, name).numpy())
    assert len(steps) > 8
    assert steps == [(i, len(steps)) for i in range(1, len(steps) + 1)]
    assert not np.array_equal(first.mean.numpy(), render.directional(scene, spp=32, seed=10).mean.numpy())


def test_another_seed_compiles_nothing():
    scene = load(S.stairs(16))
    render.directional(scene, spp=16, seed=0, max_distance=1.0)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history()
        render.directional(scene, spp=32, seed=77, max_distance=2.0)
        history = [k for k in dr.kernel_history() if "cache_hit" in k]
    assert history
    assert all(k["cache_hit"] for k in history)


def test_bad_requests():
    scene = load(S.plane(down()))
    for order in (-1, 5, 2.0, True):
        with pytest.raises(ConfigError, match="order must be an integer from 0 to 4, got"):
            render.directional(scene, order=order)
    with pytest.raises(ConfigError, match="weighting must be 'cosine' or 'uniform', got 'angle'"):
        render.directional(scene, weighting="angle")
    with pytest.raises(ConfigError, match="max_distance must be positive"):
        render.directional(scene, max_distance=0)
    with pytest.raises(ConfigError, match="spp must be a multiple of n_batches"):
        render.directional(scene, spp=100)
    with pytest.raises(ConfigError, match="normals must be one of"):
        render.directional(scene, normals="none")
    with pytest.raises(SceneError, match="there is no sensor 3"):
        render.directional(scene, sensor=3)
    v = render.directional(scene, spp=16)
    assert repr(v) == "DirectionalVisibility(12x12, order 2, 16 rays per pixel)"
    assert v._repr_png_().startswith(b"\x89PNG")
