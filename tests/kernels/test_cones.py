"""Cones of visibility: apertures and cut cones against golden values, quadrature, limits, and their derivatives."""

import numpy as np
import pytest
from oracles import cones as oracle
from oracles import golden, harmonics
from oracles.slice_oracle import unit

import drjit as dr  # isort: skip

from gtao.kernels import cones, sh
from gtao.kernels.clipped_cone import clipped_cone, tilt
from gtao.kernels.cut_integrals import local

ORDER = 4
HALF = np.pi / 2


def numbers(arrays):
    return np.array([np.array(a, dtype=np.float64) + np.zeros(1) for a in arrays])


def vectors(precision, rows):
    return [precision.lanes(column) for column in np.transpose(rows)]


def angle(precision, n, b):
    """(cos β, sin β) and f of unit vectors, one pair per row."""
    return tilt(vectors(precision, n), vectors(precision, b))


def harmonics_of(precision, n, b, alpha, order=ORDER):
    """(lanes, coefficients) of cut cones, one per row."""
    c = precision.lanes(np.cos(alpha))
    return numbers(clipped_cone(vectors(precision, n), c, *angle(precision, n, b), order)).T


def quadrature(n, b, alpha, order=ORDER):
    d, w = oracle.directions(n, b, alpha)
    return harmonics.basis(d, order).T @ (w * (d @ unit(n)))


def test_cut_cones_golden(precision):
    cases = golden.cases("C.clipped_cone")
    n, b = (np.array([unit(i[k]) for i, _ in cases]) for k in ("n", "b"))
    alpha = np.array([i["alpha"] for i, _ in cases])
    want = {name: np.array([o[name] for _, o in cases]) for name in cases[0][1]}
    cb, sb, _ = angle(precision, n, b)
    c = precision.lanes(np.cos(alpha))
    # A tilt of 0 comes out as the little by which the axis is moved there.
    assert np.array(dr.atan2(sb, cb)) == pytest.approx(want["beta"], abs=max(2e-10, precision.tolerance / 4))
    assert np.array(cones.energy(c, cb, sb)) == pytest.approx(want["AO"], abs=precision.tolerance)
    assert np.array(cones.solid_angle(c, cb, sb)) == pytest.approx(want["solid_angle"], abs=precision.tolerance)
    got = harmonics_of(precision, n, b, alpha, 2)
    assert got == pytest.approx(want["sh9"], abs=precision.tolerance)
    m0, m1, m2 = sh.to_moments([precision.lanes(column) for column in got.T])
    assert np.array(m0) == pytest.approx(want["m0"], abs=precision.tolerance)
    assert numbers(m1) == pytest.approx(want["m1"].T, abs=precision.tolerance)
    rows, columns = np.triu_indices(3)
    assert numbers(m2) == pytest.approx(want["M2"][:, rows, columns].T, abs=precision.tolerance)


def random_cones(n, seed):
    """(normals, axes, half angles) of all tilts up to 90° and cones up to what the tangent plane leaves whole."""
    rng = np.random.default_rng(seed)
    normal = unit(rng.standard_normal((n, 3)))
    across = unit(np.cross(normal, rng.standard_normal((n, 3))))
    beta = rng.uniform(0, HALF, n)
    axis = np.cos(beta)[:, None] * normal + np.sin(beta)[:, None] * across
    return normal, axis, rng.uniform(0.02, 1, n) * (HALF + beta)


def test_cut_cones_against_quadrature(precision):
    """All 25 coefficients, cut and whole, cones narrow and wider than a hemisphere."""
    cases = random_cones(60, 1)
    want = np.array([quadrature(*case) for case in zip(*cases, strict=True)])
    assert harmonics_of(precision, *cases) == pytest.approx(want, abs=precision.tolerance)
    for order in range(ORDER):
        low = harmonics_of(precision, *cases, order)
        assert low == pytest.approx(want[:, : (order + 1) ** 2], abs=precision.tolerance)
    omega, energy, *_ = zip(*(oracle.moments(*case) for case in zip(*cases, strict=True)), strict=True)
    cb, sb, _ = angle(precision, *cases[:2])
    c = precision.lanes(np.cos(cases[2]))
    assert np.array(cones.solid_angle(c, cb, sb)) == pytest.approx(np.array(omega), abs=precision.tolerance)
    assert np.array(cones.energy(c, cb, sb)) == pytest.approx(np.array(energy) / np.pi, abs=precision.tolerance)


def corner_cases():
    """Where formulas divide by nothing: no tilt, hemispheres, points, tilts of 90°, cones that touch the plane."""
    betas = [0.0, 1e-8, 1e-5, 9e-4, 1.1e-3, 0.01, 0.7, HALF - 1e-6, HALF]
    cases = []
    for beta in betas:
        alphas = {0.0, 1e-6, 1e-3, 0.3, HALF - beta - 1e-7, HALF - beta, HALF - beta + 1e-7, HALF - 1e-4, HALF}
        cases += [(beta, a) for a in sorted(alphas | {HALF + beta - 1e-5, HALF + beta}) if a >= 0]
    return np.array(cases).T


def at_tilt(beta, seed=2):
    n = unit(np.random.default_rng(seed).standard_normal(3))
    f = unit(np.cross(n, [0.2, -0.5, 0.9]))
    return np.tile(n, (len(beta), 1)), np.cos(beta)[:, None] * n + np.sin(beta)[:, None] * f


def test_cut_cones_in_all_corners(precision):
    beta, alpha = corner_cases()
    n, b = at_tilt(beta)
    want = np.array([quadrature(*case) for case in zip(n, b, alpha, strict=True)])
    assert harmonics_of(precision, n, b, alpha) == pytest.approx(want, abs=precision.tolerance)
    assert np.isfinite(np.array(cones.solid_angle(precision.lanes(np.cos(alpha)), *angle(precision, n, b)[:2]))).all()


def test_a_hemisphere_is_the_clamped_cosine(precision):
    n, b = at_tilt(np.array([0.0, 1e-4, 0.5]))
    got = harmonics_of(precision, n, b, HALF + np.array([0.0, 1e-4, 0.5]))
    y = harmonics.basis(n, ORDER)
    kernel = np.repeat(sh.CLAMPED_COSINE, 2 * np.arange(5) + 1)
    assert got == pytest.approx(y * kernel, abs=precision.tolerance)


def test_an_axis_below_the_plane_is_moved_up_to_it(precision):
    n = np.array([[0.0, 0, 1]] * 2)
    got = harmonics_of(precision, n, unit([[0.6, 0, -0.8], [1.0, 0, 0]]), np.array([0.9, 0.9]))
    assert got[0] == pytest.approx(got[1], abs=precision.tolerance)


def test_published_and_uniform_apertures(precision):
    """A = sin² α of a cone about the normal, and 1 - cos α of any that is not cut, both by quadrature."""
    alpha = np.array([1e-3, 0.1, 0.8, 1.5, HALF])
    A = [oracle.energy(a, 0.0) for a in alpha]
    # Visibility of 1e-6 has seven digits in float32, that of 1 has none of what is missing to it: √ε.
    assert np.array(cones.aperture(precision.lanes(A))) == pytest.approx(np.cos(alpha), abs=max(1e-7, 3e-4))
    inner = A[1:4]
    got = np.arccos(np.array(cones.aperture(precision.lanes(inner)), dtype=float))
    assert got == pytest.approx(alpha[1:4], abs=precision.tolerance)
    share = [oracle.moments([0, 0, 1], [0, 0, 1], a)[0] / (2 * np.pi) for a in alpha]
    assert np.array(cones.uniform_aperture(precision.lanes(share))) == pytest.approx(
        np.cos(alpha), abs=precision.tolerance
    )
    outside = precision.lanes([-0.1, 1.2])
    assert np.array(cones.aperture(outside))[1] == 0
    assert np.array(cones.uniform_aperture(outside)).tolist() == [1, 0]


def test_apertures_golden(precision):
    cases = golden.cases("C.alpha_match")
    A, beta = (np.array([i[k] for i, _ in cases]) for k in ("A", "beta"))
    want = {name: np.array([o[name] for _, o in cases]) for name in cases[0][1]}
    lanes = precision.lanes(A), precision.lanes(np.cos(beta)), precision.lanes(np.sin(beta))
    alpha = np.arccos(np.array(cones.matched_aperture(*lanes), dtype=float))
    assert alpha == pytest.approx(want["alpha"], abs=precision.tolerance)
    whole = np.cos(beta) ** 3 >= A
    assert 0 < whole.sum() < len(cases)
    assert alpha[whole] == pytest.approx(want["unclipped_formula"][whole], abs=precision.tolerance)
    assert np.abs(alpha - want["unclipped_formula"])[~whole].min() > 50e-6
    published = np.arccos(np.array(cones.aperture(precision.lanes(A)), dtype=float))
    assert published == pytest.approx(want["published_formula"], abs=precision.tolerance)


def test_matched_apertures_leave_the_visibility(precision):
    """Over all tilts and visibilities, also within 1e-6 of fully open and where the cut begins."""
    share = np.concatenate([10.0 ** -np.arange(1, 9), np.linspace(0.1, 0.9, 17), 1 - 10.0 ** -np.arange(1, 9), [0, 1]])
    beta = np.concatenate([[0, 1e-6, 1e-3], np.linspace(0.01, HALF - 0.01, 40), [HALF]])
    least = np.cos(beta) ** 3
    A = np.concatenate([least[:, None] * share, least[:, None] + (1 - least[:, None]) * share]).ravel()
    beta = np.tile(np.repeat(beta, len(share)), 2)
    lanes = precision.lanes(A), precision.lanes(np.cos(beta)), precision.lanes(np.sin(beta))
    c = np.array(cones.matched_aperture(*lanes), dtype=float)
    assert (np.abs(c) <= 1).all()
    some = np.random.default_rng(0).choice(len(A), 300, replace=False)
    got = np.array([oracle.energy(np.arccos(c[k]), beta[k]) for k in some])
    assert got == pytest.approx(A[some], abs=precision.tolerance)


def test_equivalent_cone_golden(precision):
    cases = golden.cases("C.radiance")
    A, length = (precision.lanes([i[k] * f for i, _ in cases]) for k, f in (("A", 1), ("m1_len", 1 / np.pi)))
    got = np.array(cones.equivalent_cone(A, length))
    assert got == pytest.approx([o["moment_zh_x"] for _, o in cases], abs=precision.tolerance)


def test_equivalent_cone_of_a_cone_is_the_cone(precision):
    alpha = np.linspace(0.05, HALF - 0.05, 12)
    _, energy, first, _ = zip(*(oracle.moments([0, 0, 1], [0, 0, 1], a) for a in alpha), strict=True)
    A, B = np.array(energy) / np.pi, np.linalg.norm(first, axis=1) / np.pi
    got = np.array(cones.equivalent_cone(precision.lanes(A), precision.lanes(B)))
    # A mean direction tells a narrow cone's width by how much it is short of 1: α² of a rounding error.
    assert got == pytest.approx(np.cos(alpha), abs=precision.tolerance)
    empty = cones.equivalent_cone(precision.lanes([0, 1, 0.5]), precision.lanes([0, 0.5, 0.6]))
    assert np.array(empty) == pytest.approx([1, 0, 1], abs=1e-3)


def differences(f, x, h=1e-5):
    return (f(x + h) - f(x - h)) / (2 * h)


@pytest.mark.parametrize("with_respect_to", ["c", "beta"])
def test_derivatives_of_cut_cones(precision, with_respect_to):
    """By differences of quadrature, cut and whole: the energy and all coefficients in the frame of the integrals."""
    rng = np.random.default_rng(4)
    beta = rng.uniform(0.05, HALF - 0.05, 30)
    alpha = rng.uniform(0.05, 1, 30) * (HALF + beta) * 0.98
    z = [0.0, 0, 1]

    def at(k):
        def f(x):
            b = x if with_respect_to == "beta" else beta[k]
            a = np.arccos(x) if with_respect_to == "c" else alpha[k]
            return quadrature(z, [np.sin(b), 0, np.cos(b)], a)

        return differences(f, np.cos(alpha[k]) if with_respect_to == "c" else beta[k])

    want = np.array([at(k) for k in range(30)])
    c, cb, sb = (precision.lanes(v) for v in (np.cos(alpha), np.cos(beta), np.sin(beta)))
    dr.enable_grad(c, cb, sb)
    if with_respect_to == "c":
        dr.set_grad(c, 1)
    else:
        dr.set_grad(cb, -dr.detach(sb))
        dr.set_grad(sb, dr.detach(cb))
    names = [(band, m) for band in range(ORDER + 1) for m in range(band + 1)]
    parts = local(c, cb, sb, ORDER)
    energy = cones.energy(c, cb, sb)
    dr.forward_to(*parts.values(), energy)
    got = numbers(dr.grad(parts[name]) for name in names).T
    tolerance = max(1e-7, 5 * precision.tolerance)
    assert got == pytest.approx(want[:, [band * band + band + m for band, m in names]], abs=tolerance)
    assert np.array(dr.grad(energy)) == pytest.approx(want[:, 0] * 2 / np.sqrt(np.pi), abs=tolerance)


def gradients_at(precision, beta, alpha, *, matched=False):
    """d(sum of weighted coefficients) by visibility or c, normal and axis."""
    n, b = at_tilt(beta)
    lanes = vectors(precision, n), vectors(precision, b)
    last = precision.lanes(
        [oracle.energy(a, t) for a, t in zip(alpha, beta, strict=True)] if matched else np.cos(alpha)
    )
    dr.enable_grad(lanes, last)
    cb, sb, f = tilt(*lanes)
    c = cones.matched_aperture(last, cb, sb) if matched else last
    v = clipped_cone(lanes[0], c, cb, sb, f, ORDER)
    dr.backward(dr.sum(sum(x * (0.3 + 0.1 * k) for k, x in enumerate(v))))
    return numbers([dr.grad(last), *map(dr.grad, lanes[0]), *map(dr.grad, lanes[1])])


@pytest.mark.parametrize("matched", [False, True])
def test_derivatives_are_finite_in_all_corners(precision, matched):
    beta, alpha = corner_cases()
    got = gradients_at(precision, beta, alpha, matched=matched)
    assert np.isfinite(got).all()
    # The least slope by which the implicit function is divided is 1e-3; harmonics weigh up to 2.7 each, 70 in all.
    assert np.abs(got).max() < (2e5 if matched else 2e2)


def test_derivatives_where_axis_and_normal_meet(precision):
    """The axis of a whole cone turns it: the derivative of K_l Y_lm(b), though the formulas divide by the tilt."""
    beta, alpha = np.array([0.0, 1e-7, 1e-4, 1e-3, 0.1]), np.full(5, 0.6)
    n, b = at_tilt(beta)
    g = gradients_at(precision, beta, alpha)[4:]
    weights = 0.3 + 0.1 * np.arange(25)
    for k in range(5):
        for along in unit(np.cross(b[k], np.eye(3)[:2])):
            want = differences(lambda x: weights @ quadrature(n[k], unit(b[k] + x * along), 0.6), 0.0)  # noqa: B023  (called at once)
            # Coefficients have rounding errors of 1e-7, over the least tilt 1e-3, in 25 terms that weigh up to 2.7.
            assert g[:, k] @ along == pytest.approx(want, abs=1e-2 if precision.name == "float32" else 1e-5)


def test_derivatives_of_matched_apertures(precision):
    """Of the implicit function, against differences of the double-precision solution."""
    rng = np.random.default_rng(6)
    beta = rng.uniform(0.05, 1.4, 40)
    A = rng.uniform(0.02, 0.97, 40)
    Float = dr.float64_array_t(precision.Float)

    def solve(A, beta):
        return np.array(cones.matched_aperture(Float(A), Float(np.cos(beta)), Float(np.sin(beta))))

    by_A = (solve(A + 1e-6, beta) - solve(A - 1e-6, beta)) / 2e-6
    by_beta = (solve(A, beta + 1e-6) - solve(A, beta - 1e-6)) / 2e-6
    lanes = precision.lanes(A), precision.lanes(np.cos(beta)), precision.lanes(np.sin(beta))
    dr.enable_grad(*lanes)
    dr.backward(dr.sum(cones.matched_aperture(*lanes)))
    got = numbers(map(dr.grad, lanes))
    rel = 1e-3 if precision.name == "float32" else 1e-5
    assert got[0] == pytest.approx(by_A, rel=rel)
    assert got[2] * np.cos(beta) - got[1] * np.sin(beta) == pytest.approx(by_beta, rel=rel, abs=1e-4)


def test_derivatives_of_apertures_are_bounded(precision):
    least, last = (1e-3, 2.0**-24) if precision.name == "float32" else (1e-6, 2.0**-53)
    A = precision.lanes([-0.1, 0, 0.5, 1 - 1e-6, 1 - last, 1, 1.1])
    length = precision.lanes([0, 0, 0.4, 2 / 3, 2 / 3, 2 / 3, 0.7])
    for f in (cones.aperture, cones.uniform_aperture, lambda A: cones.equivalent_cone(A, length)):
        x = type(A)(A)
        dr.enable_grad(x)
        dr.backward(dr.sum(f(x)))
        g = np.array(dr.grad(x))
        assert np.isfinite(g).all()
        # Half of the reciprocal of the least root, times up to 4 by what is under it.
        assert np.abs(g).max() < 2.1 / least
        assert f is cones.uniform_aperture or np.abs(g).max() > 0.1 / least
