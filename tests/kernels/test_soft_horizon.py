"""Accumulators with smooth maxima, sample by sample, against Boltzmann's mean written out in float64."""

from types import SimpleNamespace

import numpy as np
import pytest
from oracles import soft_horizons as oracle

from gtao import backend
from gtao.kernels.accumulators import Horizon, SoftHorizon

import drjit as dr  # isort: skip  (after gtao, which chooses the LLVM library)

N_V, N_T = 0.8, 0.36
LOW = float(N_T / np.hypot(N_V, N_T))  # the tangent plane on side 0; on side 1 it is -LOW
# The slice value is made of two cosines in single precision; in double, sums of a few dozen terms.
ROUNDING = {"float64": 1e-14, "float32": 5e-7}
TEMPERATURES = [1e-6, 1e-3, 0.03, 0.2, 10.0]


def slice_of(Float, n):
    nV, nT = (dr.full(Float, v, n) for v in (N_V, N_T))
    yes = dr.full(dr.mask_t(Float), True, n)
    return SimpleNamespace(nV=nV, nT=nT, start=(LOW + 0 * nT, -LOW + 0 * nT), inside=(yes, yes))


def horizon(Float, cosines, temperature=None):
    """Horizon cosine of side 0 after samples (samples, lanes); of uniform weighting, whose value is 1 - (c0 + c1)/2."""
    options = {
        "weighting": "uniform",
        "order": 0,
        "bent_normal": "exact",
        "arccosine": "exact",
        "orthographic": True,
        "blended": False,
    }
    options |= {"falloff": "none", "toward": "tangent", "from_tangent": True, "thickness": "none", "stretched": False}
    options |= dict.fromkeys(("scale", "offset", "reach", "tau", "depth", "stretch", "blend"), Float(0))
    a = Horizon(**options) if temperature is None else SoftHorizon(**options, temperature=temperature)
    sl = slice_of(Float, dr.width(cosines[0]))
    state = a.begin(sl)
    for c in cosines:
        state = a.add(state, 0, SimpleNamespace(c=c, d2=Float(1), D=(0, 0, 0), j=0), sl)
    (value,) = a.finish(state, sl)
    return 2 - 2 * value + sl.start[0]


def random_cosines(n_samples, n=500, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform(-1, 1, (n_samples, n))


def lanes(precision, cosines):
    return [precision.lanes(c) for c in cosines]


@pytest.mark.parametrize("temperature", TEMPERATURES)
@pytest.mark.parametrize("n_samples", [1, 8, 32])
def test_the_horizon_is_the_mean_with_boltzmann_weights(precision, temperature, n_samples):
    cosines = random_cosines(n_samples)
    got = np.array(horizon(precision.Float, lanes(precision, cosines), precision.Float(temperature)), dtype=np.float64)
    want = [oracle.boltzmann_mean([LOW, *np.maximum(c, LOW)], temperature) for c in cosines.T]
    # Rises are rounded to 6e-8, which the weights see in units of the temperature where samples nearly tie.
    near_ties = 5e-7 if precision.name == "float32" else 0.0
    assert got == pytest.approx(np.array(want), abs=ROUNDING[precision.name] + near_ties)


@pytest.mark.parametrize("temperature", TEMPERATURES)
def test_samples_at_the_tangent_plane_or_below_leave_it_alone(precision, temperature):
    cosines = np.minimum(random_cosines(8), LOW)
    cosines[3:5] = LOW
    got = np.array(horizon(precision.Float, lanes(precision, cosines), precision.Float(temperature)))
    assert np.abs(got - LOW).max() <= ROUNDING[precision.name]


def test_a_background_sample_has_no_direction_and_leaves_it_alone(precision):
    cosines = random_cosines(4)
    cosines[1] = np.nan
    want = horizon(precision.Float, lanes(precision, np.delete(cosines, 1, axis=0)), precision.Float(0.1))
    got = np.array(horizon(precision.Float, lanes(precision, cosines), precision.Float(0.1)))
    # It ties with the tangent plane.
    expected = [oracle.boltzmann_mean([LOW, *np.nan_to_num(np.maximum(c, LOW), nan=LOW)], 0.1) for c in cosines.T]
    assert got == pytest.approx(np.array(expected), abs=1e-6)
    assert (got <= np.array(want) + 1e-6).all()


@pytest.mark.parametrize("temperature", [0.003, 0.1, 3.0])
def test_the_bias_is_bounded(precision, temperature):
    """Between 0 and τ W(n/e): nowhere above the maximum; the bound is reached where all others tie 1 + W(n/e) below."""
    for n_samples in (1, 8, 32):
        cosines = lanes(precision, random_cosines(n_samples))
        hard, soft = (np.array(horizon(precision.Float, cosines, t)) for t in (None, precision.Float(temperature)))
        bound = oracle.greatest_bias(temperature, n_samples)
        assert (soft <= hard + ROUNDING[precision.name]).all()
        assert (hard - soft <= bound + ROUNDING[precision.name]).all()
    gap = oracle.greatest_bias(0.003, 7) + 0.003
    worst = [np.full(1, 0.9 - gap)] * 7 + [np.full(1, 0.9)]
    got = float(np.array(horizon(precision.Float, lanes(precision, worst), precision.Float(0.003)))[0])
    # The tangent plane is far below.
    assert 0.9 - got == pytest.approx(oracle.greatest_bias(0.003, 7), abs=ROUNDING[precision.name])


def test_the_order_of_samples_does_not_matter(precision):
    cosines = random_cosines(16)
    values = [
        np.array(horizon(precision.Float, lanes(precision, order), precision.Float(0.05)))
        for order in (cosines, np.sort(cosines, axis=0), np.sort(cosines, axis=0)[::-1])
    ]
    assert np.abs(values[0] - values[1]).max() <= ROUNDING[precision.name]
    assert np.abs(values[0] - values[2]).max() <= ROUNDING[precision.name]


@pytest.mark.parametrize("temperature", [0.01, 0.2])
def test_derivatives_by_samples_and_temperature(temperature):
    """∂H/∂c_k = p_k (1 + (c_k - H)/τ) and ∂H/∂τ = -Var_p(c)/τ², with p the weights; nothing below the tangent plane."""
    Float = dr.float64_array_t(backend.default_float())
    cosines = random_cosines(6)
    inputs, tau = [Float(c) for c in cosines], dr.full(Float, temperature, 500)
    dr.enable_grad(inputs, tau)
    dr.backward(horizon(Float, inputs, tau))
    entries = np.vstack([np.full(500, LOW), np.maximum(cosines, LOW)])
    p = np.exp((entries - entries.max(axis=0)) / temperature)
    p /= p.sum(axis=0)
    H = (p * entries).sum(axis=0)
    want = np.where(cosines > LOW, p[1:] * (1 + (entries[1:] - H) / temperature), 0.0)
    got = np.array([np.array(dr.grad(c)) for c in inputs])
    assert got == pytest.approx(want, abs=1e-11)
    assert np.array(dr.grad(tau)) == pytest.approx(-(p * (entries - H) ** 2).sum(axis=0) / temperature**2, abs=1e-9)
    # The price of a mean: what lies far enough below the horizon lowers it as it rises.
    assert (want < 0).any()
