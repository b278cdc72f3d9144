"""Cones over isotropic lobes: golden values, rings in double precision, mirrors, corners, derivatives."""

import numpy as np
import pytest
from oracles import golden
from oracles import specular as oracle

import drjit as dr  # isort: skip

from gtao.kernels.cone_lobe import cone_lobe
from gtao.kernels.gauss import legendre
from gtao.kernels.lobes import alpha_of_power

PI = np.pi
LOBES = {"ggx": oracle.lobe_ggx, "phong": lambda alpha: oracle.lobe_phong(2 / alpha**2 - 2)}


def lanes(precision, columns):
    return [precision.lanes(np.ravel(c)) for c in np.broadcast_arrays(*columns)]


def evaluate(precision, columns, *options):
    return np.array(cone_lobe(*lanes(precision, columns), *options), dtype=float)


def as_given(precision, *columns):
    kind = np.float32 if precision.name == "float32" else np.float64
    return [np.asarray(c).astype(kind).astype(float) for c in columns]


def cases(n, seed):
    """(α_v, β, α) of all widths from 1e-3 on, half of the cones with their rims where the lobe is."""
    rng = np.random.default_rng(seed)
    alpha = np.where(np.arange(n) % 2, rng.uniform(0.02, 1, n), 10 ** rng.uniform(-3, 0, n))
    alpha_v = rng.uniform(0, PI / 2, n)
    alpha_v[::5] = rng.uniform(0, PI, n)[::5]
    near = np.clip(alpha_v + alpha * rng.standard_normal(n), 0, PI)
    return alpha_v, np.where(np.arange(n) % 4 < 2, near, rng.uniform(0, PI, n)), alpha


def truth(columns, distribution):
    rows = zip(*columns, strict=True)
    return np.array([oracle.cone_lobe(a_v, b, LOBES[distribution](a), a) for a_v, b, a in rows])


@pytest.mark.parametrize("n", [1, 2, 7, 16, 40])
def test_gauss_nodes(n):
    x, w = np.polynomial.legendre.leggauss(n)
    got = np.array(legendre(n))
    assert got[:, 0] == pytest.approx((x + 1) / 2, abs=1e-14)
    assert got[:, 1] == pytest.approx(w / 2, abs=1e-14)


def test_golden(precision):
    values = golden.cases("E.cone_lobe")
    a_v, beta, alpha, p = (np.array([i[k] for i, _ in values]) for k in ("alpha_v", "beta", "alpha", "p"))
    # What is held to 1e-8 in double precision; the power lobe takes 24 nodes for that.
    tolerance = max(precision.tolerance, 1e-8)
    got = evaluate(precision, (a_v, beta, alpha))
    assert got == pytest.approx([o["ggx"] for _, o in values], abs=tolerance)
    width = alpha_of_power(precision.lanes(p))
    half = cone_lobe(precision.lanes(a_v), precision.lanes(beta), width, "phong", 24)
    assert np.array(half) == pytest.approx([o["phong_half"] for _, o in values], abs=tolerance)
    # The lobe of reflected directions is not one of ours: it checks the oracle's rings.
    rows = zip(a_v, beta, p, strict=True)
    reflection = [oracle.cone_lobe(a, b, oracle.lobe_reflection(q), 1) for a, b, q in rows]
    assert reflection == pytest.approx([o["phong_reflection"] for _, o in values], abs=1e-9)
    untilted = beta == 0
    assert untilted.any()
    closed = 1 - np.cos(a_v[untilted]) ** (p[untilted] + 2)
    assert np.array(reflection)[untilted] == pytest.approx(closed, abs=1e-12)


@pytest.mark.parametrize(("distribution", "error"), [("ggx", 2e-9), ("phong", 3e-5)])
def test_sixteen_nodes_for_all_widths(precision, distribution, error):
    columns = as_given(precision, *cases(300, 1))
    want = truth(columns, distribution)
    assert ((want > 0.01) & (want < 0.99)).sum() > 100
    # Where a rim goes through a lobe of 1e-3, roundings of sines of angles are 1e-4 of its width.
    allowed = error + (3e-5 if precision.name == "float32" else 0)
    assert np.abs(evaluate(precision, columns, distribution) - want).max() < allowed


@pytest.mark.parametrize("distribution", LOBES)
def test_convergence(precision, distribution):
    """Like a power of the number of nodes' exponential: half as many leave the root of the error."""
    columns = as_given(precision, *cases(200, 2))
    want = truth(columns, distribution)
    error = [np.abs(evaluate(precision, columns, distribution, n) - want).max() for n in (4, 8, 16)]
    assert error[0] < 0.1
    assert error[1] < 0.1 * error[0]
    assert error[2] < 0.1 * error[1] + (3e-5 if precision.name == "float32" else 0)


@pytest.mark.parametrize("distribution", LOBES)
def test_mirrors_see_a_step(precision, distribution):
    got = evaluate(precision, ([0.5, 0.5, 0.5, 0.0, PI], [0.45, 0.5, 0.55, 0.0, 0.3], np.zeros(5)), distribution)
    # The width of 1e-4 that a mirror counts as has tails of (1e-4 / 0.05)².
    assert got == pytest.approx([1, 0.5, 0, 0, 1], abs=1e-4)


def corners():
    angles = [0, 1e-30, 1e-6, 0.3, PI / 4, PI / 2 - 1e-6, PI / 2, PI / 2 + 1e-6, 3 * PI / 4, PI - 1e-6, PI]
    rows = np.meshgrid(angles, angles, [0.0, 1e-6, 1e-2, 0.5, 1.0])
    return [r.ravel() for r in rows]


@pytest.mark.parametrize("distribution", LOBES)
def test_corners(precision, distribution):
    """Nothing, points, axes that meet or are opposite, hemispheres; widths from nothing to 1."""
    columns = corners()
    got = evaluate(precision, columns, distribution)
    assert got.min() > -1e-4
    assert got.max() < 1 + 1e-4
    wide = columns[2] >= 0.01
    want = truth([c[wide] for c in columns], distribution)
    # A hemisphere's rim lies within 90° by a rounding: the root of it is the azimuth up to which it does.
    assert got[wide] == pytest.approx(want, abs=1e-4)


@pytest.mark.parametrize("distribution", LOBES)
def test_a_cone_and_what_is_outside_it_make_the_whole(precision, distribution):
    alpha_v, beta, alpha = cases(200, 3)
    # One behind the other: the complement's axis is opposite.
    both = evaluate(precision, (alpha_v, beta, alpha), distribution)
    both += evaluate(precision, (PI - alpha_v, PI - beta, alpha), distribution)
    # π - α is a rounding of π off in single precision, 1e-4 of the narrowest lobe.
    assert both == pytest.approx(
        1, abs=3e-4 if precision.name == "float32" else 3e-5 if distribution == "phong" else 1e-8
    )


def derivatives(precision, columns, distribution, weights=None):
    arguments = lanes(precision, columns)
    dr.enable_grad(arguments)
    value = cone_lobe(*arguments, distribution)
    dr.backward(dr.sum(value if weights is None else value * precision.lanes(weights)))
    return np.array([dr.grad(a) for a in arguments], dtype=float)


@pytest.mark.parametrize("distribution", LOBES)
def test_derivatives_by_differences_of_rings(precision, distribution):
    rng = np.random.default_rng(4)
    columns = rng.uniform(0.1, PI / 2, 60), rng.uniform(0.05, 2, 60), rng.uniform(0.05, 1, 60)
    got = derivatives(precision, columns, distribution)
    h = 1e-5
    for k in range(3):
        up, down = (truth([c + (s * h if j == k else 0) for j, c in enumerate(columns)], distribution) for s in (1, -1))
        want = (up - down) / (2 * h)
        # The width's derivative of a narrow lobe is the value's error of 1e-9, or 1e-5 for powers, over the width.
        assert got[k] == pytest.approx(
            want, abs=2e-3 if distribution == "phong" or precision.name == "float32" else 1e-6
        )


@pytest.mark.parametrize("distribution", LOBES)
def test_derivatives_are_bounded_in_all_corners(precision, distribution):
    columns = corners()
    got = derivatives(precision, columns, distribution)
    assert np.isfinite(got).all()
    # What a rim sweeps in a lobe of the least width, 1e-4.
    assert np.abs(got).max() < 1e4


def test_forward_and_reverse_mode_are_adjoint(precision):
    rng = np.random.default_rng(8)
    columns = cases(100, 9)
    v, w = rng.standard_normal((3, 100)), rng.standard_normal(100)
    arguments = lanes(precision, columns)
    for a, direction in zip(arguments, v, strict=True):
        dr.enable_grad(a)
        dr.set_grad(a, precision.lanes(direction))
    value = cone_lobe(*arguments)
    dr.forward_to(value)
    forward = np.array(dr.grad(value), dtype=float) @ w
    reverse = np.sum(derivatives(precision, columns, "ggx", w) * v)
    assert forward == pytest.approx(reverse, rel=1e-3 if precision.name == "float32" else 1e-9)
