"""What shaders compute in place of the exact forms: arc cosines, arcs from angles, horizons moved by a share."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from oracles import slice_oracle

import drjit as dr  # isort: skip

from gtao.kernels import arcs, bitmask, horizon, shaping
from gtao.kernels.accumulators import Horizon

X = np.concatenate([np.linspace(-1, 1, 2001), [0.361, -0.361]])


def shader_arccos(x, kind):
    """Theory, eq. (66), in NumPy's float32 bits."""
    below = 1 - np.abs(x)
    root = np.sqrt(below)
    if kind == "bit_trick":
        bits = below.astype(np.float32).view(np.int32)
        root = ((bits >> 1) + 0x1FBD1DF5).astype(np.int32).view(np.float32).astype(np.float64)
    p = (math.pi / 2 - 0.156583 * np.abs(x)) * root
    return np.where(x < 0, math.pi - p, p)


@pytest.mark.parametrize(("kind", "largest"), [("two_term", 0.00901), ("bit_trick", 0.055)])
def test_arc_cosines_are_those_of_shaders(precision, kind, largest):
    mine = np.array(arcs.fast_acos(precision.lanes(X), kind), dtype=np.float64)
    # 1 - |x| loses digits in float32, and its root below 1e-4 more than half of them.
    tolerance = 1e-9 if precision.name == "float64" else 3e-4
    exact_bits = X if precision.name == "float64" else X.astype(np.float32).astype(np.float64)
    assert mine == pytest.approx(shader_arccos(exact_bits, kind), abs=tolerance)
    assert np.max(np.abs(mine - np.arccos(X))) == pytest.approx(largest, rel=0.02)


def test_exact_is_exact(precision):
    mine = np.array(arcs.fast_acos(precision.lanes(X), "exact"), dtype=np.float64)
    assert mine == pytest.approx(np.arccos(X), abs=1e-12 if precision.name == "float64" else 4e-4)


def test_derivative_of_the_bit_trick_is_that_of_the_root(precision):
    x = precision.Float(0.3)
    dr.enable_grad(x)
    dr.backward(arcs.fast_acos(x, "bit_trick"))
    y, step = precision.Float(0.3), 1e-4
    dr.enable_grad(y)
    dr.backward(arcs.fast_acos(y, "two_term"))
    # One factor of the product is the approximate root, 4.5 % off at most.
    assert dr.grad(x)[0] == pytest.approx(dr.grad(y)[0], rel=0.045)
    difference = (shader_arccos(np.array(0.3 + step), "two_term") - shader_arccos(np.array(0.3 - step), "two_term")) / (
        2 * step
    )
    assert dr.grad(y)[0] == pytest.approx(difference, rel=1e-4)


@pytest.mark.parametrize(
    ("nV", "nT", "h0", "h1"), [(0.8, 0.2, -0.4, 0.9), (0.3, -0.9, -2.0, 0.3), (0.6, 0.5, -0.8, 2.2)]
)
def test_arc_from_exact_angles_is_the_integral(precision, nV, nT, h0, h1):
    Float = precision.Float
    mine = arcs.cosine_arc_from_angles(Float(nV), Float(nT), Float(math.atan2(nT, nV)), Float(h0), Float(h1))
    # The form divides nothing but subtracts cosines: float32 keeps six digits.
    tolerance = 1e-9 if precision.name == "float64" else 1e-6
    assert np.array(mine)[0] == pytest.approx(slice_oracle.arc(nV, nT, h0, h1).cosine, abs=tolerance)


def accumulate(precision, samples, **options):
    """Visibility of a slice whose +T side saw ``samples``, pairs of cosine and distance."""
    values = {"scale": 0.0, "offset": 0.0, "reach": 0.0, "tau": 0.0, "depth": 0.0, "stretch": 1.0, "blend": 0.0}
    switches = {
        "weighting": "cosine",
        "order": 0,
        "bent_normal": "exact",
        "falloff": "none",
        "toward": "tangent",
        "from_tangent": False,
        "thickness": "none",
        "stretched": False,
        "blended": False,
        "arccosine": "exact",
        "orthographic": False,
    }
    Float = precision.Float
    numbers = {name: Float(options.pop(name, value)) for name, value in values.items()}
    nV, nT = 0.9, 0.3
    low = nT / math.hypot(nV, nT)
    sl = SimpleNamespace(
        pixel=SimpleNamespace(V=(Float(0), Float(0), Float(1))),
        nV=Float(nV),
        nT=Float(nT),
        start=(Float(low), Float(-low)),
        inside=(True, True),
    )
    accumulator = Horizon(**(switches | options), **numbers)
    state = accumulator.begin(sl)
    for j, (c, d) in enumerate(samples):
        sample = SimpleNamespace(
            c=Float(c), d2=Float(d * d), D=(Float(0), Float(0), Float(0)), j=j, X=Float(0.5), Y=Float(0)
        )
        state = accumulator.add(state, 1, sample, sl)
    seen = float(np.array(state[1])[0])
    (value,) = accumulator.finish(state, sl)
    return seen, float(np.array(value)[0]), (nV, nT, -low)


SAMPLES = [(0.1, 0.2), (-0.4, 0.5), (0.6, 0.9), (0.3, 0.3), (0.7, 1.4)]


@pytest.mark.parametrize("start", ["nadir", "tangent"])
@pytest.mark.parametrize("tau", [0.0, 0.03])
@pytest.mark.parametrize("falloff", ["quadratic", "index"])
def test_a_horizon_rises_by_the_weight_and_sinks_by_the_share(precision, start, tau, falloff):
    """Theory, eq. (65), sample after sample with branches."""
    radius, strength = 1.0, 0.8
    _, _, (nV, nT, low) = accumulate(precision, [])
    H = low if start == "tangent" else -1.0
    for j, (c, d) in enumerate(SAMPLES):
        if falloff == "quadratic":
            w = min(max(1 - strength * d * d / radius**2, 0), 1)
        else:
            w = 1 + strength * (2 / (j + 2) - 1)
        H += (w if c > H else tau) * (c - H)
    seen, value, _ = accumulate(
        precision,
        SAMPLES,
        falloff=falloff,
        toward="horizon",
        from_tangent=start == "tangent",
        thickness="running" if tau else "none",
        scale=-strength / radius**2 if falloff == "quadratic" else strength,
        offset=1.0,
        tau=tau,
    )
    assert seen == pytest.approx(H, abs=precision.tolerance)
    h1 = min(math.acos(H), math.acos(low))
    expected = slice_oracle.clamped_cosine(nV, nT, -math.pi, h1)
    assert value == pytest.approx(expected, abs=10 * precision.tolerance)


def test_background_lowers_a_horizon_toward_its_eye_ray(precision):
    tau, c = 0.25, 0.4
    far = -1 / math.hypot(0.5, 1)
    seen, _, _ = accumulate(precision, [(c, 1), (math.nan, math.inf)], thickness="running", tau=tau)
    assert seen == pytest.approx(c + tau * (far - c), abs=precision.tolerance)


@pytest.mark.parametrize("toward", ["tangent", "horizon"])
def test_a_sample_on_the_point_itself_changes_nothing(precision, toward):
    options = {
        "falloff": "quadratic",
        "toward": toward,
        "scale": -0.1,
        "offset": 1.0,
        "thickness": "running",
        "tau": 0.3,
    }
    before, _, _ = accumulate(precision, [(0.4, 0.1)], **options)
    after, _, _ = accumulate(precision, [(0.4, 0.1), (math.nan, 0)], **options)
    assert after == before


def test_background_does_not_raise_a_horizon_by_a_share(precision):
    options = {"falloff": "quadratic", "toward": "horizon", "scale": -1.0, "offset": 1.0}
    seen, _, _ = accumulate(precision, [(0.4, 0.1), (math.nan, math.inf)], **options)
    assert seen == pytest.approx(-1 + 0.99 * 1.4, abs=precision.tolerance)


@pytest.mark.parametrize("kind", ["two_term", "bit_trick"])
def test_the_tangent_plane_is_as_approximate_as_the_other_angles(precision, kind):
    """An open slice: both horizons are the tangent plane of the approximate normal."""
    _, value, (nV, nT, _) = accumulate(precision, [], arccosine=kind, from_tangent=True)
    gamma = float(shader_arccos(np.array(nV / math.hypot(nV, nT)), kind))
    h0, h1 = (float(sign * shader_arccos(np.array(-sign * math.sin(gamma)), kind)) for sign in (-1, 1))
    each = [math.hypot(nV, nT) * (2 * h * math.sin(gamma) - math.cos(2 * h - gamma)) for h in (h0, h1)]
    expected = (sum(each) + 2 * nV) / 4
    # A bit of the float32 number decides between neighbouring values of the root: 2e-7 of it.
    assert value == pytest.approx(expected, abs=2e-6)


def test_background_cosine_is_the_limit_of_far_samples(precision):
    X, Y, V = 0.4, -0.3, slice_oracle.unit([0.2, 0.5, 1.0])
    P = -5.0 * V
    far = np.array([X, Y, -1.0]) * 1e9 - P
    Float = precision.Float
    mine = horizon.background_cosine(Float(X), Float(Y), tuple(Float(float(v)) for v in V), False)
    assert np.array(mine)[0] == pytest.approx(far @ V / np.linalg.norm(far), abs=max(1e-8, precision.tolerance))


@pytest.mark.parametrize("kind", ["two_term", "bit_trick"])
@pytest.mark.parametrize("side", [0, 1])
def test_sectors_from_approximate_angles(precision, kind, side):
    nV, nT = 0.7, -0.4
    constants, weight = bitmask.approximate_map(precision.Float(nV), precision.Float(nT), kind)
    c = np.array([-1.0, -0.95, -0.2, 0.3, 0.8, 1.0])
    gamma = -shader_arccos(np.array(nV / math.hypot(nV, nT)), kind)
    theta = (1 if side else -1) * shader_arccos(c, kind)
    expected = np.clip((theta - gamma) / math.pi + 0.5, 0, 1)
    mine = np.array(bitmask.approximate_position(constants, side, precision.lanes(c), kind), dtype=np.float64)
    # A bit of the float32 number under the root decides between neighbouring values: 2e-7 of them.
    assert mine == pytest.approx(expected, abs=1e-6)
    background = bitmask.approximate_position(constants, side, precision.Float(math.nan), kind)
    assert np.array(background)[0] == pytest.approx(side)
    assert np.array(weight)[0] == 1


@pytest.mark.parametrize(("value", "expected"), [(0.5, 0.25), (0.1, 0.03), (1.3, 1.5), (1.2, 1.44), (-1e-7, 0.03)])
def test_shape_of_results(precision, value, expected):
    mine = shaping.shape(precision.Float(value), precision.Float(2.0), precision.Float(0.03), precision.Float(1.5))
    assert np.array(mine)[0] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("radius_px", "expected"), [(20.0, 0.0), (10.0, 0.0), (5.0, 0.0125), (0.0, 0.025)])
def test_fade_of_short_searches(precision, radius_px, expected):
    mine = shaping.small_radius_fade(precision.Float(radius_px), 2)
    assert np.array(mine)[0] == pytest.approx(expected, abs=1e-7)
