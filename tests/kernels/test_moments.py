"""Moments of a slice against golden values, quadrature and what they add up to over all slices."""

import numpy as np
import pytest
from oracles import golden, slice_oracle

import drjit as dr  # isort: skip

from gtao.kernels import moments, slices

MANY = 1 << 16
"""Slices for an integral over the hemisphere. Horizons that meet the tangent plane have a kink in azimuth: the sum
errs by O(n^-2), below 1e-9."""


def numbers(arrays):
    return np.stack([np.array(a, dtype=np.float64) for a in arrays])


def clamped_cosines(precision, nV, nT, h0, h1):
    gamma = np.arctan2(nT, nV)
    h0, h1 = np.maximum(h0, gamma - np.pi / 2), np.minimum(h1, gamma + np.pi / 2)
    return precision.lanes(np.cos(h0)), precision.lanes(np.cos(h1))


def test_first_moments_of_arcs_golden(precision):
    cases = golden.cases("A.arc")
    gamma, a, b = (np.array([i[k] for i, _ in cases]) for k in ("gamma", "h0", "h1"))
    want = np.array([[o["t0"] for _, o in cases], [o["t1"] for _, o in cases]])
    nV, nT = precision.lanes(np.cos(gamma)), precision.lanes(np.sin(gamma))
    got = numbers(moments.first_signed(nV, nT, precision.lanes(a), precision.lanes(b)))
    assert got == pytest.approx(want, abs=precision.tolerance)
    around = (a <= 0) & (b >= 0)
    assert 0 < around.sum() < len(cases)
    got = numbers(moments.first(nV, nT, precision.lanes(np.cos(a)), precision.lanes(np.cos(b))))
    assert got[:, around] == pytest.approx(want[:, around], abs=precision.tolerance)


def test_moments_of_slices_golden(precision):
    cases = golden.cases("A.slice")
    nV, nT, h0, h1 = (precision.lanes([i[k] for i, _ in cases]) for k in ("nV", "nT", "h0", "h1"))
    want = np.array([[o[k] for _, o in cases] for k in ("bT", "bV", "ss", "sc", "cc")])
    h0, h1 = slices.clamped_arc(nV, nT, h0, h1)
    got = numbers([*moments.first_signed(nV, nT, h0, h1), *moments.second_signed(nV, nT, h0, h1)])
    assert got == pytest.approx(want, abs=precision.tolerance)
    around = np.array([o["h0"] <= 0 for _, o in cases])
    assert 0 < around.sum() < len(cases)
    c0, c1 = dr.cos(h0), dr.cos(h1)
    got = numbers([*moments.first(nV, nT, c0, c1), *moments.second(nV, nT, c0, c1)])
    assert got[:, around] == pytest.approx(want[:, around], abs=precision.tolerance)


def random_arcs(n=100, seed=2):
    """(nV, nT, a, b) with a <= b anywhere in [-π, π], the normal anywhere."""
    rng = np.random.default_rng(seed)
    length, gamma = rng.uniform(0.05, 1, n), rng.uniform(-np.pi, np.pi, n)
    a, b = np.sort(rng.uniform(-np.pi, np.pi, (2, n)), axis=0)
    return length * np.cos(gamma), length * np.sin(gamma), a, b


def all_moments(lanes, first, second, uniform):
    nV, nT, a, b = lanes
    return numbers([*first(nV, nT, a, b), *second(nV, nT, a, b), *uniform(a, b)])


def test_moments_against_quadrature(precision):
    arcs = np.array(random_arcs())
    want = []
    for nV, nT, a, b in arcs.T:
        weighted = slice_oracle.arc(nV, nT, a, b)
        # The integrals of |sin θ| {sin θ, cos θ}: without the cosine's factor, from quadrature of their own.
        uniform = (slice_oracle.integrate(lambda t, f=f: abs(np.sin(t)) * f(t), a, b) for f in (np.sin, np.cos))
        want.append([*(getattr(weighted, k) for k in ("t0", "t1", "ss", "sc", "cc")), *uniform])
    want = np.array(want).T
    lanes = [precision.lanes(row) for row in arcs]
    signed = all_moments(lanes, moments.first_signed, moments.second_signed, moments.first_uniform_signed)
    assert signed == pytest.approx(want, abs=precision.tolerance)
    around = (arcs[2] <= 0) & (arcs[3] >= 0)
    assert 20 < around.sum() < 80
    lanes[2:] = dr.cos(lanes[2]), dr.cos(lanes[3])
    plain = all_moments(lanes, moments.first, moments.second, moments.first_uniform)
    assert plain[:, around] == pytest.approx(want[:, around], abs=precision.tolerance)


def test_horizons_toward_the_eye_and_away(precision):
    """Cosines of ± 1, and a little more by rounding: nothing and everything, never NaN."""
    beyond = 1 + 1e-6
    c0, c1 = precision.lanes([1, beyond, -1, -beyond]), precision.lanes([1, beyond, -1, -beyond])
    nV, nT = precision.Float(0.8), precision.Float(0.0)
    got = numbers([*moments.first(nV, nT, c0, c1), *moments.second(nV, nT, c0, c1)])
    full = slice_oracle.arc(0.8, 0.0, -np.pi, np.pi)
    full = np.array([full.t0, full.t1, full.ss, full.sc, full.cc])
    assert got == pytest.approx(np.outer(full, [0, 0, 1, 1]), abs=precision.tolerance)


def test_derivative_is_the_integrand_at_the_horizon(precision):
    """d(t0, t1)/dc1 = -(n_V c1 + n_T s1) (s1, c1): an arc ends where its integrand is cut."""
    nV, nT, c0 = precision.Float(0.6), precision.Float(-0.3), precision.Float(0.2)
    at = np.array([0.9, 0.4, -0.3, -0.8])
    s = np.sqrt(1 - at**2)
    for k, factor in enumerate((s, at)):
        c1 = precision.lanes(at)
        dr.enable_grad(c1)
        dr.backward(dr.sum(moments.first(nV, nT, c0, c1)[k]))
        assert np.array(dr.grad(c1)) == pytest.approx(-(0.6 * at - 0.3 * s) * factor, abs=precision.tolerance)


def test_derivative_at_a_horizon_toward_the_eye_is_finite(precision):
    c1 = precision.lanes([1.0, -1.0])
    dr.enable_grad(c1)
    results = [f(precision.Float(0.6), precision.Float(0.3), c1, c1) for f in (moments.first, moments.second)]
    dr.backward(dr.sum(sum(x for result in results for x in result)))
    assert np.isfinite(np.array(dr.grad(c1))).all()


def bent_of(precision, inputs, n, offset):
    """Mean over slices of t0 T + t1 V, both weightings, and of the matrix of second moments."""
    nV, nT, h0, h1, T = slice_oracle.horizon_slices(inputs, n, offset)
    V = slice_oracle.unit(inputs["V"])
    cosines = clamped_cosines(precision, nV, nT, h0, h1)
    nV, nT = precision.lanes(nV), precision.lanes(nT)
    (t0, t1), (ss, sc, cc) = numbers(moments.first(nV, nT, *cosines)), numbers(moments.second(nV, nT, *cosines))
    u0, u1 = numbers(moments.first_uniform(*cosines))
    m0, m1 = numbers(moments.mean_horizon(*cosines))
    cross = np.einsum("n,ni,j->ij", sc, T, V) / n
    return {
        "bent": t0 @ T / n + t1.mean() * V,
        "uniform": u0 @ T / n + u1.mean() * V,
        "average": m0 @ T / n + m1.mean() * V,
        "second": np.einsum("n,ni,nj->ij", ss, T, T) / n + cross + cross.T + cc.mean() * np.outer(V, V),
    }


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("B.slices"))
def test_bent_normal_of_few_slices_golden(precision, inputs, outputs):
    got = bent_of(precision, inputs, inputs["n"], inputs["offset"])
    assert got["bent"] == pytest.approx(np.array(outputs["bent_vec"]), abs=precision.tolerance)
    direction = slice_oracle.unit(got["bent"])
    assert direction == pytest.approx(np.array(outputs["bent_dir"]), abs=precision.tolerance)
    average = slice_oracle.unit(got["average"])
    assert average == pytest.approx(np.array(outputs["avg_horizon_dir"]), abs=precision.tolerance)


def harmonics(second, first):
    """The nine spherical harmonics up to order 2 of the visible cosine, from its moments divided by π."""
    M, B = np.pi * second, np.pi * first
    zero, one = np.sqrt(1 / (4 * np.pi)) * np.trace(M), np.sqrt(3 / (4 * np.pi)) * B
    two = np.sqrt(15 / (4 * np.pi))
    return np.array(
        [
            *(zero, one[1], one[2], one[0]),
            *(two * M[0, 1], two * M[1, 2], two / np.sqrt(12) * (3 * M[2, 2] - np.trace(M))),
            *(two * M[0, 2], two / 2 * (M[0, 0] - M[1, 1])),
        ]
    )


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("A.horizon"))
def test_bent_normal_of_many_slices_golden(precision, inputs, outputs):
    """The sum over slices converges to the integral over the hemisphere, for every moment."""
    got = bent_of(precision, inputs, MANY, 0.5)
    assert got["bent"] == pytest.approx(np.array(outputs["bent_vec"]), abs=precision.tolerance)
    assert slice_oracle.unit(got["bent"]) == pytest.approx(np.array(outputs["bent_dir"]), abs=precision.tolerance)
    uniform = slice_oracle.unit(got["uniform"])
    assert uniform == pytest.approx(np.array(outputs["uniform_bent_dir"]), abs=precision.tolerance)
    assert got["second"] == pytest.approx(np.array(outputs["M2_over_pi"]), abs=precision.tolerance)
    expansion = harmonics(got["second"], got["bent"])
    assert expansion == pytest.approx(np.array(outputs["sh9"]), abs=precision.tolerance)


def open_surface(tilt):
    return {"N": [np.sin(tilt), 0, np.cos(tilt)], "V": [0, 0, 1], "c": np.pi, "harmonics": []}


@pytest.mark.parametrize("tilt", [0.0, 0.5, 1.2])
def test_open_surface_has_its_own_normal(precision, tilt):
    inputs = open_surface(tilt)
    got = bent_of(precision, inputs, 64, 0.5)
    N = np.array(inputs["N"])
    assert got["bent"] == pytest.approx(2 / 3 * N, abs=precision.tolerance)
    assert got["uniform"] == pytest.approx(N, abs=precision.tolerance)
    # ∫ ⟨N, ω⟩ ω ωᵀ dω/π over the hemisphere: ½ along N, ¼ across.
    assert got["second"] == pytest.approx(0.25 * (np.eye(3) + np.outer(N, N)), abs=precision.tolerance)


def test_average_horizon_is_halfway_and_biased_toward_the_viewer(precision):
    rng = np.random.default_rng(4)
    h0, h1 = -rng.uniform(0.1, 3, 50), rng.uniform(0.1, 3, 50)
    got = numbers(moments.mean_horizon(precision.lanes(np.cos(h0)), precision.lanes(np.cos(h1))))
    half = (h0 + h1) / 2
    assert got == pytest.approx(np.array([np.sin(half), np.cos(half)]), abs=precision.tolerance)
    x, _, z = bent_of(precision, open_surface(np.pi / 4), 256, 0.5)["average"]
    # The printed digits of the docstring.
    assert np.degrees(np.arctan2(x, z)) == pytest.approx(24.6, abs=0.05)
