"""``gtao.shade`` and ``gtao.specular_radiance``: their definitions in NumPy, in all shapes; limits; gradients."""

import math

import drjit as dr
import numpy as np
import pytest
from oracles.slice_oracle import unit
from oracles.specular_frames import view_directions

import gtao
from gtao import ConfigError, ShapeError

CAMERA = gtao.PerspectiveCamera(6, 4, 1.0)
SHAPE = CAMERA.shape
BACKGROUND = (1, 2)
UNIFORM = gtao.GTAO(weighting="uniform", bent_normal=True)


def image(seed, channels=3, low=0.0, high=1.0):
    return np.random.default_rng(seed).uniform(low, high, (*SHAPE, channels) if channels else SHAPE)


def frame(dtype=np.float64, albedo=None, config=None):
    """A frame of directions toward the viewer with a pixel of background, and an estimate with cones."""
    rng = np.random.default_rng(1)
    n = unit(view_directions(CAMERA) + 0.7 * unit(rng.standard_normal((*SHAPE, 3))))
    b = unit(n + 0.3 * rng.standard_normal((*SHAPE, 3)))
    z, A = np.full(SHAPE, 2.0), image(2, 0, 0.1, 0.9)
    z[BACKGROUND] = np.inf
    g = gtao.GBuffer(z.astype(dtype), n.astype(dtype), CAMERA, None if albedo is None else albedo.astype(dtype))
    T = g.types.Tensor
    ao = gtao.AmbientOcclusion(
        visibility=T(A.astype(dtype)),
        mean_direction=T((b * 0.7 * A[..., None]).astype(dtype)),
        normal_v=g.normal_v,
        config=config or gtao.GTAO(bent_normal=True),
    )
    return g, ao


def colours(value):
    """Anything that stands for three channels as (H, W, 3)."""
    value = np.asarray(value, dtype=np.float64)
    return np.broadcast_to(value[..., None] if value.shape == SHAPE else value, (*SHAPE, 3))


def reflectance(g, roughness, f0):
    A, B = np.moveaxis(gtao.environment_brdf(g, roughness).numpy(), -1, 0)[..., None]
    return colours(f0) * A + B


F0 = {"number": 0.3, "colour": np.array([0.9, 0.5, 0.1]), "grey": image(3, 0), "image": image(4)}
LIGHT = {"number": 2.5, "grey": image(5, 0, 0, 9), "image": image(6, 3, 0, 9)}
ALBEDO = {"number": 0.6, "colour": np.array([0.2, 0.5, 1.0]), "grey": image(7, 0), "image": image(8)}


@pytest.mark.parametrize("f0", F0)
@pytest.mark.parametrize("light", LIGHT)
@pytest.mark.parametrize("occlusion", [1.0, 0.4, image(9, 0), image(10)], ids=["none", "number", "grey", "image"])
def test_specular_radiance(occlusion, light, f0):
    g, _ = frame()
    roughness = image(11, 0)
    found = gtao.specular_radiance(occlusion, LIGHT[light], g, roughness, F0[f0]).numpy()
    expected = colours(occlusion) * reflectance(g, roughness, F0[f0]) * colours(LIGHT[light])
    expected[BACKGROUND] = 0
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("method", [gtao.ConeCone(), gtao.VisibilityAsSpecular()], ids=["cones", "visibility"])
@pytest.mark.parametrize("albedo", ALBEDO)
@pytest.mark.parametrize("f0", F0)
def test_shade(f0, albedo, method):
    g, ao = frame()
    roughness, E, L = 0.4, LIGHT["image"], LIGHT["grey"]
    found = gtao.shade(ao, g, E, L, roughness, F0[f0], albedo=ALBEDO[albedo], method=method).numpy()
    F, rho = reflectance(g, roughness, F0[f0]), colours(ALBEDO[albedo])
    S = gtao.specular_occlusion(ao, g, roughness, 0.5, method).numpy()[..., None]
    G = gtao.multibounce(ao.visibility, g.types.Tensor(np.ascontiguousarray(rho))).numpy()
    expected = (1 - F) * rho / math.pi * E * G + F * S * colours(L)
    expected[BACKGROUND] = 0
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-13)
    # Irradiance that knows its occlusion is taken as it is.
    directly = gtao.shade(ao, g, E * G, L, roughness, F0[f0], albedo=ALBEDO[albedo], method=method, fit=None).numpy()
    np.testing.assert_allclose(directly, expected, rtol=1e-10, atol=1e-13)


def test_it_is_the_sum_of_its_parts_by_the_table():
    """The default method, whose occlusion depends on F0."""
    g, ao = frame()
    f0, L = F0["image"], LIGHT["image"]
    black = gtao.shade(ao, g, 1.0, L, 0.3, f0, albedo=0.0).numpy()
    S = gtao.specular_occlusion(ao, g, 0.3, f0)
    np.testing.assert_allclose(black, gtao.specular_radiance(S, L, g, 0.3, f0).numpy(), rtol=1e-10, atol=1e-14)


def test_the_albedo_of_the_frame():
    g, ao = frame(albedo=ALBEDO["image"])
    own = gtao.shade(ao, g, 2.0, 1.0, 0.5, method=gtao.ConeCone()).numpy()
    given = gtao.shade(ao, g, 2.0, 1.0, 0.5, albedo=ALBEDO["image"], method=gtao.ConeCone()).numpy()
    np.testing.assert_array_equal(own, given)


def test_nothing_outshines_a_white_dome():
    """Open and white, a surface is the dome; else darker."""
    g, ao = frame()
    bright = gtao.shade(ao, g, math.pi, 1.0, 0.5, 0.04, albedo=1.0, method=gtao.ConeCone()).numpy()
    assert bright.max() <= 1
    T = g.types.Tensor
    open_ = gtao.AmbientOcclusion(visibility=T(np.ones(SHAPE)))
    whole = gtao.shade(open_, g, math.pi, 1.0, 0.5, F0["image"], albedo=1.0, method=gtao.VisibilityAsSpecular()).numpy()
    whole[BACKGROUND] = 1
    np.testing.assert_allclose(whole, 1, rtol=1e-12)


def test_uniform_estimates_know_the_diffuse_visibility():
    g, ao = frame(config=UNIFORM)
    found = gtao.shade(ao, g, 3.0, 0.0, 0.5, albedo=0.8, method=gtao.ConeCone()).numpy()
    F = reflectance(g, 0.5, 0.04)
    G = gtao.multibounce(ao.cosine_visibility, 0.8).numpy()[..., None]
    expected = (1 - F) * 0.8 / math.pi * 3.0 * G
    expected[BACKGROUND] = 0
    np.testing.assert_allclose(found, expected, rtol=1e-10)
    assert np.abs(ao.cosine_visibility.numpy() - ao.visibility.numpy()).max() > 0.05


def test_precision_and_arrays_of_others():
    """The frame's precision, whatever the light came in."""
    g, ao = frame(np.float32)
    found = gtao.shade(ao, g, LIGHT["image"], LIGHT["image"], 0.4, albedo=0.5, method=gtao.ConeCone())
    assert dr.type_v(found) is dr.VarType.Float32
    g64, ao64 = frame(np.float64)
    exact = gtao.shade(ao64, g64, LIGHT["image"], LIGHT["image"], 0.4, albedo=0.5, method=gtao.ConeCone())
    # Angles of single precision, where cones barely overlap.
    np.testing.assert_allclose(found.numpy(), exact.numpy(), rtol=2e-4, atol=1e-5)


def test_gradients_are_differences():
    g, ao = frame()
    T = g.types.Tensor
    start = {
        "irradiance": image(20, 3, 1, 2),
        "light": image(21, 3, 1, 2),
        "roughness": image(22, 0, 0.3, 0.7),
        "f0": image(23, 3, 0.1, 0.9),
        "albedo": image(24, 3, 0.3, 0.7),
        "visibility": image(25, 0, 0.3, 0.7),
    }
    weights = image(26, 3, -1, 1)

    def loss(values):
        estimate = gtao.AmbientOcclusion(
            visibility=values["visibility"], mean_direction=ao.mean_direction, normal_v=g.normal_v, config=ao.config
        )
        names = ("irradiance", "light", "roughness", "f0")
        shaded = gtao.shade(
            estimate, g, *(values[n] for n in names), albedo=values["albedo"], method=gtao.ConeCone(aperture="seed")
        )
        return dr.sum(shaded.array * T(weights).array)

    values = {name: T(v) for name, v in start.items()}
    dr.enable_grad(list(values.values()))
    dr.backward(loss(values))
    step = 1e-6
    for name, v in start.items():
        direction = image(27, 3 if v.ndim == 3 else 0, -1, 1)
        ends = [loss({**{k: T(x) for k, x in start.items()}, name: T(v + s * step * direction)}) for s in (1, -1)]
        difference = (ends[0] - ends[1])[0] / (2 * step)
        reverse = float((values[name].grad.numpy() * direction).sum())
        assert reverse == pytest.approx(difference, rel=1e-6, abs=1e-7), name


@pytest.mark.parametrize("camera", [CAMERA, gtao.OrthographicCamera(6, 4, 2.0)], ids=["perspective", "orthographic"])
def test_reflected_directions(camera):
    rng = np.random.default_rng(30)
    v = view_directions(camera)
    n = unit(v + 0.6 * unit(rng.standard_normal((*SHAPE, 3))))
    z = np.full(SHAPE, 2.0)
    z[BACKGROUND] = np.inf
    g = gtao.GBuffer(z, n, camera)
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    mirrored = 2 * (n * v).sum(-1, keepdims=True) * n - v
    surface = np.isfinite(z)
    np.testing.assert_allclose(gtao.reflected_directions(g).numpy()[surface], mirrored[surface], atol=1e-12)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, 7
    for given in (turn, matrix):
        found = gtao.reflected_directions(g, given).numpy()
        np.testing.assert_allclose(found[surface], (mirrored @ turn.T)[surface], atol=1e-12)
        # Light can be looked up everywhere.
        np.testing.assert_allclose(np.linalg.norm(found, axis=-1), 1, atol=1e-12)
    for wrong in (np.eye(2), "world"):
        with pytest.raises(ShapeError, match="view_to_world must be a 3x3 or 4x4"):
            gtao.reflected_directions(g, wrong)


def test_in_words():
    g, ao = frame()
    with pytest.raises(ConfigError, match="no albedo"):
        gtao.shade(ao, g, 1.0, 1.0, 0.5, method=gtao.ConeCone())
    with pytest.raises(ShapeError, match="albedo must be in"):
        gtao.shade(ao, g, 1.0, 1.0, 0.5, albedo=1.5, method=gtao.ConeCone())
    for name, arguments in (("irradiance", (np.ones((2, 2)), 1.0)), ("prefiltered_radiance", (1.0, np.ones(3)))):
        with pytest.raises(ShapeError, match=f"{name} must be a number or have shape"):
            gtao.shade(ao, g, *arguments, 0.5, albedo=0.5, method=gtao.ConeCone())
    with pytest.raises(ShapeError, match=r"prefiltered_radiance .* got str"):
        gtao.specular_radiance(1.0, "white", g, 0.5)
    with pytest.raises(ShapeError, match=r"occlusion .* got bool"):
        gtao.specular_radiance(True, 1.0, g, 0.5)
    with pytest.raises(ShapeError, match="roughness must be in"):
        gtao.specular_radiance(1.0, 1.0, g, 1.5)
    with pytest.raises(ShapeError, match="f0 must"):
        gtao.specular_radiance(1.0, 1.0, g, 0.5, np.ones(4))
    with pytest.raises(ConfigError, match="GBuffer"):
        gtao.specular_radiance(1.0, 1.0, "frame", 0.5)
    with pytest.raises(ConfigError, match="fit must be"):
        gtao.shade(ao, g, 1.0, 1.0, 0.5, albedo=0.5, fit="cubic", method=gtao.ConeCone())
    blind = gtao.AmbientOcclusion(visibility=ao.visibility, config=gtao.GTAO(weighting="uniform"))
    with pytest.raises(ConfigError, match="multi-bounce visibility needs cosine-weighted"):
        gtao.shade(blind, g, 1.0, 1.0, 0.5, albedo=0.5, method=gtao.VisibilityAsSpecular())


@pytest.mark.parametrize("one", [np.float64(0.5), np.float32(0.5), np.array(0.5), np.array([0.5])])
def test_numbers_of_numpy_are_numbers(one):
    g, ao = frame()
    method = gtao.Lagarde2014()
    for of in (
        lambda x: gtao.specular_occlusion(ao, g, x, x, method),
        lambda x: gtao.specular_radiance(x, x, g, x, x),
        lambda x: gtao.shade(ao, g, x, x, x, x, albedo=x, method=method),
    ):
        assert np.array_equal(of(one).numpy(), of(0.5).numpy())
