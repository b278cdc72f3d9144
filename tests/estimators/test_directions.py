"""Bent normals and harmonics as an estimate gives them: what they are, in which arrays, and what leaves them alone."""

import math

import numpy as np
import pytest

import drjit as dr  # isort: skip

import gtao
from gtao.planes import Planes

HEIGHT, WIDTH = 24, 32
EXACT = {"atol": 1e-12, "rtol": 0}


def frame(dtype=np.float64, seed=0):
    rng = np.random.default_rng(seed)
    z = 3 + 0.5 * rng.random((HEIGHT, WIDTH))
    z[5:9, 6:12] = np.inf
    return gtao.GBuffer(z.astype(dtype), None, gtao.PerspectiveCamera(WIDTH, HEIGHT, fov_y=1.2))


def facing(tilt, dtype=np.float64):
    """An open plane that is tilted to the right, seen along the optical axis; its normal."""
    n = np.array([math.sin(tilt), 0, math.cos(tilt)])
    camera = gtao.OrthographicCamera(WIDTH, HEIGHT, view_height=0.2)
    x = (np.arange(WIDTH) + 0.5 - WIDTH / 2) * 0.2 / HEIGHT
    z = np.broadcast_to(5 + np.tan(tilt) * x, (HEIGHT, WIDTH))
    normal = np.broadcast_to(n, (HEIGHT, WIDTH, 3))
    return gtao.GBuffer(z.astype(dtype), np.ascontiguousarray(normal, dtype), camera), n


def estimate(g, **options):
    return gtao.ambient_occlusion(g, gtao.GTAO(**({"radius": 1.0} | options)))


def test_directions_come_when_they_are_asked_for():
    g = frame()
    plain, bent, harmonics = (estimate(g, **o) for o in ({}, {"bent_normal": True}, {"directional": True}))
    assert plain.mean_direction is plain.visibility_sh is plain.bent_normal is plain.normal_v is None
    assert bent.visibility_sh is None
    assert tuple(harmonics.visibility_sh.shape) == (HEIGHT, WIDTH, 9)
    assert np.array_equal(bent.visibility, plain.visibility)
    np.testing.assert_allclose(harmonics.visibility, plain.visibility, **EXACT)
    np.testing.assert_allclose(harmonics.mean_direction, bent.mean_direction, **EXACT)


@pytest.mark.parametrize(("weighting", "unit"), [("cosine", math.pi), ("uniform", 2 * math.pi)])
def test_the_lower_bands_are_visibility_and_mean_direction(weighting, unit):
    ao = estimate(frame(), directional=True, weighting=weighting)
    sh, B, surface = np.array(ao.visibility_sh), np.array(ao.mean_direction), np.array(frame().mask)
    visibility = np.array(ao.visibility)
    np.testing.assert_allclose(sh[surface, 0], (unit / math.sqrt(4 * math.pi) * visibility)[surface], **EXACT)
    np.testing.assert_allclose(sh[..., 1:4], math.sqrt(3 / (4 * math.pi)) * unit * B[..., [1, 2, 0]], **EXACT)


def test_the_background_sees_nothing_and_its_bent_normal_looks_back():
    g = frame()
    ao, background = estimate(g, directional=True), ~np.array(g.mask)
    assert background.sum() == 24
    assert np.all(np.array(ao.mean_direction)[background] == 0)
    assert np.all(np.array(ao.visibility_sh)[background] == 0)
    assert np.all(np.array(ao.bent_normal)[background] == [0, 0, 1])
    assert np.all(np.array(ao.visibility)[background] == 1)


def test_where_nothing_is_visible_the_bent_normal_is_the_normal():
    g = frame()
    closed = gtao.AmbientOcclusion(
        visibility=g.types.Tensor(np.zeros(g.shape)),
        mean_direction=g.types.Tensor(np.zeros((*g.shape, 3))),
        normal_v=g.normal_v,
    )
    assert np.array_equal(closed.bent_normal, g.normal_v)


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
@pytest.mark.parametrize("n_slices", [1, 2, 5])
def test_power_floor_and_ceiling_leave_directions_alone(weighting, n_slices):
    g, options = frame(), {"directional": True, "weighting": weighting, "n_slices": n_slices}
    plain, shaped = estimate(g, **options), estimate(g, **options, power=2.0, floor=0.3, ceiling=1.0)
    assert np.abs(np.array(shaped.visibility) - np.array(plain.visibility)).max() > 0.05
    for name in ("mean_direction", "visibility_sh", "bent_normal"):
        assert np.array_equal(getattr(shaped, name), getattr(plain, name))


def test_unit_bent_normals():
    bent = np.array(estimate(frame(np.float32), bent_normal=True).bent_normal)
    assert np.linalg.norm(bent, axis=-1) == pytest.approx(1, abs=1e-6)


# The angles that the slides' average gives on an open plane instead of its own, in degrees.
AVERAGED = {15: 7.6, 30: 15.6, 45: 24.6, 60: 35.7, 75: 52.2}


@pytest.mark.parametrize("degrees", AVERAGED)
def test_average_horizons_lean_to_the_viewer(degrees):
    g, n = facing(math.radians(degrees))
    options = {"radius": math.inf, "n_slices": 64, "noise": "none", "fetch": "linear"}
    averaged = np.array(estimate(g, bent_normal="average_horizon", **options).bent_normal)[12, 16]
    assert np.degrees(np.arctan2(averaged[0], averaged[2])) == pytest.approx(AVERAGED[degrees], abs=0.06)
    exact = np.array(estimate(g, bent_normal=True, **options).bent_normal)[12, 16]
    assert exact == pytest.approx(n, abs=1e-9)


def test_bands_of_rows_give_the_same():
    g, method = frame(), gtao.GTAO(radius=1.0, directional=True)
    whole, parts = gtao.ambient_occlusion(g, method), gtao.ambient_occlusion(g, method, max_pixels=100)
    for name in ("visibility", "mean_direction", "visibility_sh"):
        assert np.array_equal(getattr(whole, name), getattr(parts, name))


def test_one_kernel_with_everything():
    g, method = frame(np.float32), gtao.GTAO(radius=1.0, directional=True)
    g.normal_v  # noqa: B018  (derived before)
    dr.eval(g.normal_v)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        ao = gtao.ambient_occlusion(g, method)
        dr.eval(ao.visibility, ao.planes("visibility_sh").arrays)
        assert len([k for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT]) == 1


def test_planes_and_tensors_are_the_same_numbers():
    ao = estimate(frame(), directional=True)
    planes = ao.planes("visibility_sh")
    assert planes.shape == (HEIGHT, WIDTH)
    flat = np.stack([np.array(a) for a in planes.arrays], axis=-1).reshape(HEIGHT, WIDTH, 9)
    assert np.array_equal(flat, ao.visibility_sh)
    again = gtao.AmbientOcclusion(visibility=ao.visibility, visibility_sh=ao.visibility_sh)
    for a, b in zip(again.planes("visibility_sh").arrays, planes.arrays, strict=True):
        assert np.array_equal(a, b)
    assert again.planes("mean_direction") is None


def test_crop():
    ao = estimate(frame(), directional=True)
    part = ao.crop(3, 2, 10, 8)
    for name in ("visibility", "mean_direction", "visibility_sh", "bent_normal"):
        assert np.array_equal(getattr(part, name), np.array(getattr(ao, name))[2:10, 3:13])
    assert part.config == ao.config


def test_single_precision_agrees_with_double():
    double, single = (estimate(frame(dtype), directional=True, n_slices=3) for dtype in (np.float64, np.float32))
    # A sample may pick the other of two texels: the mean says more than the largest difference.
    for name in ("mean_direction", "visibility_sh"):
        difference = np.abs(np.array(getattr(double, name)) - np.array(getattr(single, name), np.float64))
        assert np.median(difference) < 1e-6
        assert difference.mean() < 1e-3


@pytest.mark.parametrize("arccosine", ["two_term", "bit_trick"])
def test_approximate_arc_cosines_are_near(arccosine):
    g = frame()
    near, exact = (estimate(g, directional=True, arccosine=a) for a in (arccosine, "exact"))
    for name in ("mean_direction", "visibility_sh"):
        difference = np.array(getattr(near, name)) - np.array(getattr(exact, name))
        # Angles are off by up to 0.01 and 0.06.
        assert 0 < np.abs(difference).max() < (0.05 if arccosine == "two_term" else 0.2)


def test_a_pipeline_filters_directions():
    g = frame()
    pipeline = gtao.Pipeline(
        occlusion=gtao.GTAO(radius=1.0, n_slices=1, directional=True), spatial=gtao.SpatialFilter()
    )
    ao = pipeline.step(g)
    assert isinstance(vars(ao)["visibility_sh"], Planes)
    raw = gtao.ambient_occlusion(g, pipeline.occlusion)
    surface = np.array(g.mask)
    assert np.array(ao.visibility_sh)[surface].std() < np.array(raw.visibility_sh)[surface].std()
    assert np.linalg.norm(np.array(ao.bent_normal), axis=-1) == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"bent_normal": "mean"}, "average_horizon"),
        ({"bent_normal": 1}, "bent_normal must be"),
        ({"directional": "yes"}, "directional must be"),
        ({"directional": True, "bent_normal": "average_horizon"}, "leave bent_normal out"),
    ],
)
def test_refusals(options, words):
    with pytest.raises(gtao.ConfigError, match=words):
        gtao.GTAO(**options)


def test_the_configuration_keeps_its_directions():
    method = gtao.GTAO(directional=True, bent_normal=True)
    assert gtao.method_from_dict(method.to_dict()) == method


SHAPES = {
    "power": {"power": 2.2},
    "floor": {"floor": 0.5},
    "ceiling": {"ceiling": 1.0, "n_slices": 1},
    "fade": {"small_radius_fade": True, "falloff": gtao.NoCut(), "radius": 0.05},
}


@pytest.mark.parametrize("name", SHAPES)
def test_light_by_moments_takes_the_visibility_that_belongs_to_them(name):
    """A zonal function is made of visibility and mean direction: shaped, the one does not belong to the other."""
    g, sh = frame(), np.random.default_rng(2).standard_normal(9)
    options = SHAPES[name]
    plain = {"power": 1.0, "floor": 0.0, "ceiling": math.inf, "small_radius_fade": False}
    unshaped = estimate(g, directional=True, **(options | {k: v for k, v in plain.items() if k in options}))
    shaped = estimate(g, directional=True, **options)
    assert np.abs(np.array(shaped.visibility) - np.array(unshaped.visibility)).max() > 0.01
    for order in (2, 4):
        method = gtao.MomentZH(order=order)
        want = gtao.irradiance(np.resize(sh, 25), g, unshaped, method)
        bent = estimate(g, bent_normal=True, **options)
        for ao in (shaped, bent, bent.crop(0, 0, WIDTH, HEIGHT)):
            np.testing.assert_allclose(gtao.irradiance(np.resize(sh, 25), g, ao, method), want, **EXACT)


def test_so_it_is_after_a_pipeline():
    """A filter averages what belongs together alike, and the clamp leaves it alone."""
    g, sh = frame(), np.random.default_rng(2).standard_normal(25)
    plain = {"radius": 1.0, "n_slices": 1}
    for spatial in (None, gtao.SpatialFilter()):
        want = gtao.ambient_occlusion(g, gtao.GTAO(bent_normal=True, **plain))
        want = want if spatial is None else gtao.denoise(want, g, spatial)
        assert np.array(want.visibility).max() > 1.01
        for power in (1.0, 2.0):
            occlusion = gtao.GTAO(bent_normal=True, power=power, **plain)
            ao = gtao.Pipeline(occlusion=occlusion, spatial=spatial).step(g)
            assert np.array(ao.visibility).max() <= 1
            got, expected = (gtao.irradiance(sh, g, a, gtao.MomentZH()) for a in (ao, want))
            np.testing.assert_allclose(got, expected, **EXACT)


def test_the_fade_of_small_radii_leaves_directions_alone():
    g, options = frame(), {"falloff": gtao.NoCut(), "radius": 0.05, "directional": True}
    faded, plain = estimate(g, small_radius_fade=True, **options), estimate(g, **options)
    assert np.array_equal(faded.visibility_sh, plain.visibility_sh)
    assert not np.array_equal(faded.visibility, plain.visibility)
