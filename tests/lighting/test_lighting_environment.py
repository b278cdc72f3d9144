"""Environment maps: which texel is where, and integrals against brute force and against Mitsuba."""

import math

import numpy as np
import pytest
from _sphere import cell_nodes, directions, harmonics, local_direction, rotation

from gtao import lighting
from gtao.errors import ConfigError, ShapeError
from gtao.lighting import EnvironmentMap

HEIGHT, WIDTH = 9, 14


@pytest.fixture(scope="module")
def image():
    return np.random.default_rng(6).random((HEIGHT, WIDTH, 3)).astype(np.float32)


@pytest.fixture(scope="module")
def turned(image):
    return EnvironmentMap(image, rotation(2))


def test_texel_centres(image, turned):
    np.testing.assert_allclose(turned.lookup(turned.directions()), image, atol=1e-12)
    theta, phi = math.pi * 2.5 / HEIGHT, 2 * math.pi * 3.5 / WIDTH
    np.testing.assert_allclose(turned.directions()[2, 3], rotation(2) @ local_direction(theta, phi), atol=1e-14)


def test_between_centres(image):
    env = EnvironmentMap(image)
    theta, phi = math.pi * (2.5 + 0.25) / HEIGHT, 2 * math.pi * (3.5 + 0.4) / WIDTH
    i = image.astype(np.float64)
    expected = 0.75 * (0.6 * i[2, 3] + 0.4 * i[2, 4]) + 0.25 * (0.6 * i[3, 3] + 0.4 * i[3, 4])
    np.testing.assert_allclose(env.lookup(7 * local_direction(theta, phi)), expected, atol=1e-6)


def test_the_seam_and_the_poles(image):
    env = EnvironmentMap(image)
    seam = local_direction(math.pi * 4.5 / HEIGHT, 0.0)
    np.testing.assert_allclose(env.lookup(seam), (image[4, 0] + image[4, -1]) / 2, atol=1e-6)
    for theta, row in ((1e-3, 0), (math.pi - 1e-3, HEIGHT - 1)):
        near_pole = local_direction(theta, 2 * math.pi * 5.5 / WIDTH)
        np.testing.assert_allclose(env.lookup(near_pole), image[row, 5], atol=1e-6)
    assert np.isfinite(env.lookup([[0, 1, 0], [0, -1, 0]])).all()


def test_many_lookups_are_as_few(turned):
    d = directions(3 * HEIGHT * WIDTH)
    np.testing.assert_allclose(turned.lookup(d)[:5], [turned.lookup(each) for each in d[:5]], atol=1e-6)


def test_mitsuba_puts_texels_there(image):
    """Its columns are ours; its rows begin and end on the poles, where ours have their edges."""
    from gtao.render.variant import ensure_variant

    ensure_variant()
    import drjit as dr
    import mitsuba as mi

    to_world = np.eye(4)
    to_world[:3, :3] = rotation(2)
    emitter = mi.load_dict(
        {
            "type": "scene",
            "sky": {"type": "envmap", "bitmap": mi.Bitmap(image), "to_world": mi.ScalarTransform4f(to_world)},
        }
    ).environment()
    theta = math.pi * np.arange(1, HEIGHT - 1) / (HEIGHT - 1)
    phi = 2 * math.pi * (np.arange(WIDTH) + 0.5) / WIDTH
    d = np.array([[rotation(2) @ local_direction(t, p) for p in phi] for t in theta]).reshape(-1, 3)
    si = dr.zeros(mi.SurfaceInteraction3f, len(d))
    si.wi = -mi.Vector3f(*d.T)
    theirs = np.array(emitter.eval(si)).T.reshape(HEIGHT - 2, WIDTH, 3)
    # Single precision angles times differences of texels.
    np.testing.assert_allclose(theirs, image[1:-1], atol=1e-5)
    theta = math.pi * (np.arange(1, HEIGHT - 1) + 0.5) / HEIGHT
    ours = np.array([[rotation(2) @ local_direction(t, p) for p in phi] for t in theta])
    np.testing.assert_allclose(EnvironmentMap(image, to_world).lookup(ours), image[1:-1], atol=1e-5)


def test_solid_angles(turned):
    edges = math.pi * np.arange(HEIGHT + 1) / HEIGHT
    expected = 2 * math.pi / WIDTH * (np.cos(edges[:-1]) - np.cos(edges[1:]))
    np.testing.assert_allclose(turned.solid_angles, expected, atol=1e-15)
    assert WIDTH * turned.solid_angles.sum() == pytest.approx(4 * math.pi, rel=1e-14)


def test_projection_is_the_integral_of_the_lookup(turned):
    local, weights = cell_nodes(HEIGHT, WIDTH, 8)
    d = local @ rotation(2).T
    expected = harmonics(d, 6).T @ (weights[:, None] * turned.lookup(d))
    # A node at the rounded edge of a cell is read from either side of it.
    np.testing.assert_allclose(turned.project(6), expected, atol=1e-6)


def test_high_bands_of_few_texels():
    """Harmonics that oscillate between two rows."""
    env = EnvironmentMap(np.random.default_rng(1).random((2, 4, 3)))
    local, weights = cell_nodes(2, 4, 40)
    expected = harmonics(local, 24).T @ (weights[:, None] * env.lookup(local))
    np.testing.assert_allclose(env.project(24), expected, atol=1e-6)


def test_projection_of_what_is_band_limited():
    """Interpolation blurs a fine map by the order of its squared step only."""
    c = lighting.von_mises_fisher([1, 2, -0.5], 2.0, [1, 0.5, 0.2]).project(4)
    errors = []
    for height in (32, 64):
        grid = EnvironmentMap(np.zeros((height, 2 * height, 3))).directions()
        env = EnvironmentMap(np.maximum(lighting.evaluate(c, grid), 0))
        errors.append(np.abs(env.project(4) - c).max())
    assert errors[1] < 2e-3
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.1)


def test_energy(turned):
    local, weights = cell_nodes(HEIGHT, WIDTH, 8)
    expected = weights @ turned.lookup(local @ rotation(2).T) ** 2
    np.testing.assert_allclose(lighting.energy(turned), expected, rtol=1e-6)


def test_fit_quality():
    shares = lighting.fit_quality(EnvironmentMap(np.random.default_rng(0).random((3, 6, 3))), 24)
    assert (np.diff(shares) >= 0).all()
    # The kinks of interpolation, and the jumps at the poles, leave little to higher bands.
    assert 0.99 < shares[-1] <= 1
    lobe = lighting.von_mises_fisher([0, 0, 1], 4.0)
    squares = (lobe.kernel(6)[:, 0] ** 2) * (2 * np.arange(7) + 1) / (4 * math.pi)
    # ∫ f² dω of the lobe with mean 1: 4π κ coth κ.
    expected = np.cumsum(squares) / (4 * math.pi * 4 / math.tanh(4))
    # The map is blurred by its texels, h²/4 along each axis with h = π/128: of a band l (l + 1) times that is lost.
    np.testing.assert_allclose(lighting.fit_quality(lobe.map(128), 6), expected, atol=4e-4)
    np.testing.assert_array_equal(lighting.fit_quality(EnvironmentMap(np.zeros((2, 4, 3))), 2), 1)


def test_irradiance_is_the_integral(turned):
    n = directions(5, seed=8)
    local, weights = cell_nodes(HEIGHT, WIDTH, 24)
    d = local @ rotation(2).T
    expected = np.maximum(n @ d.T, 0) @ (weights[:, None] * turned.lookup(d))
    # Texels of 1.3° cut by the plane: a share of the order of their squared width is lost.
    np.testing.assert_allclose(turned.irradiance(n), expected, rtol=5e-4)
    assert turned.irradiance(n.reshape(5, 1, 3)).shape == (5, 1, 3)


def test_irradiance_of_one_texel():
    """Wholly above the plane, wide in azimuth, it is exact."""
    image = np.zeros((130, 8, 3))
    image[40, 2] = 5
    env = EnvironmentMap(image)
    local, weights = cell_nodes(130, 8, 8)
    n = env.directions()[40, 2]
    expected = (n @ local.T * weights) @ env.lookup(local)
    np.testing.assert_allclose(env.irradiance(n), expected, rtol=1e-6)


def test_irradiance_converges():
    """To that of the harmonics, with the square of the resolution."""
    lobe = lighting.von_mises_fisher([0.3, 1, -0.2], 6.0, [1, 2, 0.5])
    n = directions(12, seed=4)
    expected = lighting.evaluate(lighting.convert(lobe.project(24), "gtao", "irradiance"), n)
    errors = [np.abs(lobe.map(height).irradiance(n) - expected).max() for height in (32, 64)]
    assert errors[1] < 0.01
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.15)


def test_irradiance_in_parts(turned, monkeypatch):
    """A few normals at a time, as large maps need it."""
    n = directions(7)
    whole = turned.irradiance(n)
    monkeypatch.setattr("gtao.lighting.environment.CHUNK", 150_000)
    np.testing.assert_allclose(turned.irradiance(n), whole, rtol=1e-13)


def test_irradiance_of_an_even_light():
    """At the resolutions just below and above which a map is interpolated before."""
    for height in (2, 43, 127, 128, 129):
        env = EnvironmentMap(np.ones((height, 2 * height, 3)))
        np.testing.assert_allclose(env.irradiance(directions(5)), math.pi, rtol=2e-4)


def test_an_odd_multiple_is_the_same_map(turned):
    """What irradiance of small maps rests on."""
    fine = turned.resized(5 * HEIGHT)
    # Texels are rounded to single precision.
    np.testing.assert_allclose(fine.lookup(directions(200)), turned.lookup(directions(200)), atol=1e-6)


@pytest.mark.parametrize("height", [2, 4, 5, 8])
def test_smaller_maps_keep_the_light(turned, height):
    small = turned.resized(height)
    assert small.shape == (height, max(2, round(WIDTH * height / HEIGHT)))
    for channel in range(3):
        light = [(env.solid_angles @ env.radiance[..., channel].astype(float)).sum() for env in (small, turned)]
        assert light[0] == pytest.approx(light[1], rel=1e-6)
    np.testing.assert_array_equal(small.to_world, turned.to_world)


def test_smaller_maps_by_hand():
    """Half the size: each texel the mean of four, weighted by solid angle."""
    image = np.random.default_rng(1).random((4, 8, 3))
    env = EnvironmentMap(image)
    w = env.solid_angles
    pairs = (image[:, 0::2] + image[:, 1::2]) / 2
    expected = (w[0::2, None, None] * pairs[0::2] + w[1::2, None, None] * pairs[1::2]) / (w[0::2] + w[1::2])[
        :, None, None
    ]
    np.testing.assert_allclose(env.resized(2).radiance, expected, rtol=1e-6)


def test_larger_maps_are_looked_up(turned):
    large = turned.resized(27)
    assert large.shape == (27, 42)
    np.testing.assert_allclose(large.radiance, turned.lookup(large.directions()), atol=1e-6)
    assert turned.resized(HEIGHT) is turned


def test_it_is_read_only_and_single(turned, image):
    assert turned.radiance.dtype == np.float32
    with pytest.raises(ValueError, match="read-only"):
        turned.radiance[0, 0, 0] = 1
    with pytest.raises(ValueError, match="read-only"):
        turned.to_world[0, 0] = 1
    copied = image.copy()
    env = EnvironmentMap(copied)
    copied[:] = 0
    np.testing.assert_array_equal(env.radiance, image)


def _with(value):
    image = np.ones((4, 8, 3))
    image[1, 2, 0] = value
    return image


@pytest.mark.parametrize(
    ("radiance", "to_world", "error", "words"),
    [
        (np.ones((4, 8)), np.eye(3), ShapeError, r"\(H, W, 3\).*got shape \(4, 8\)"),
        (np.ones((1, 8, 3)), np.eye(3), ShapeError, "2x2 texels"),
        (np.ones((4, 8, 3), complex), np.eye(3), ShapeError, "real numbers"),
        (_with(np.nan), np.eye(3), ShapeError, "of 32 texels 1 are NaN or infinite and 0 negative; repair"),
        (_with(1e39), np.eye(3), ShapeError, "1 are NaN or infinite"),
        (_with(-1.0), np.eye(3), ShapeError, "0 are NaN or infinite and 1 negative"),
        (np.ones((4, 8, 3)), 2 * np.eye(3), ConfigError, "to_world must be a rotation"),
        (np.ones((4, 8, 3)), np.eye(2), ShapeError, "to_world must be a 3x3 or 4x4 matrix"),
    ],
)
def test_refusals(radiance, to_world, error, words):
    with pytest.raises(error, match=words):
        EnvironmentMap(radiance, to_world)


@pytest.mark.parametrize("height", [0, 1, 2.5, True])
def test_refused_heights(turned, height):
    with pytest.raises(ConfigError, match="must be an integer"):
        turned.resized(height)
    with pytest.raises(ConfigError, match="must be an integer"):
        lighting.constant().map(height)


def test_refused_directions(turned):
    with pytest.raises(ShapeError, match="directions must be"):
        turned.lookup([1, 0])
    with pytest.raises(ShapeError, match="normals must not be zero"):
        turned.irradiance([0, 0, 0])
