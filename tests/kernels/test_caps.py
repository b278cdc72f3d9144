"""What two cones share: golden values, rings in double precision, the planar limit, corners, and derivatives."""

import numpy as np
import pytest
from oracles import golden
from oracles import specular as oracle

import drjit as dr  # isort: skip

from gtao.kernels import caps

PI = np.pi


def lanes(precision, *columns):
    return [precision.lanes(np.ravel(c)) for c in np.broadcast_arrays(*columns)]


def as_given(precision, *columns):
    """The numbers that the kernel gets, in float64: the rounding of inputs is not the kernel's."""
    kind = np.float32 if precision.name == "float32" else np.float64
    return [np.ravel(c).astype(kind).astype(float) for c in np.broadcast_arrays(*columns)]


def evaluate(f, precision, *columns):
    return np.array(f(*lanes(precision, *columns)), dtype=float)


def share_oracle(*columns):
    return np.array([oracle.cap_share(*row) for row in zip(*columns, strict=True)])


def lenses(n, seed, narrow):
    """Cones of visibility of all widths whose rims cut reflection cones of the half angle ``narrow``."""
    rng = np.random.default_rng(seed)
    alpha_s = narrow * rng.uniform(0.7, 1, n)
    alpha_v = rng.uniform(0.02, PI / 2, n)
    beta = np.abs(alpha_v + alpha_s * rng.uniform(-1.05, 1.05, n))
    return alpha_v, alpha_s, beta


def test_golden(precision):
    cases = golden.cases("E.caps")
    a_v, a_s, beta = (np.array([i[k] for i, _ in cases]) for k in ("alpha_v", "alpha_s", "beta"))
    want = {name: np.array([o[name] for _, o in cases]) for name in cases[0][1]}
    # As shares: golden solid angles reach down to 1e-6.
    whole = oracle.cap(np.minimum(a_v, a_s))
    omega = evaluate(caps.cap_intersection, precision, a_v, a_s, beta) / whole
    # Inputs of 1e-3 have float32's digits of 1, a lens that reaches 1e-3 into the cone four less.
    tolerance = precision.tolerance
    assert omega == pytest.approx(want["omega"] / whole, abs=tolerance)
    assert evaluate(caps.cap_share, precision, a_v, a_s, beta) == pytest.approx(want["V_s"], abs=tolerance)
    oat = evaluate(caps.oat_intersection, precision, a_v, a_s, beta)
    assert oat / whole == pytest.approx(want["oat_omega"] / whole, abs=tolerance)
    oat = evaluate(caps.oat_share, precision, a_v, a_s, beta)
    assert oat == pytest.approx(want["oat_omega"] / oracle.cap(a_s), abs=tolerance)


@pytest.mark.parametrize("narrow", [1.4, 0.1, 1e-2, 1e-3, 1e-4, 1e-6])
def test_narrow_reflection_cones_keep_their_digits(precision, narrow):
    """Where the form with L'Huilier's excess alone has errors of 1e-7 / α_s."""
    columns = as_given(precision, *lenses(400, 1, narrow))
    got = evaluate(caps.cap_share, precision, *columns)
    want = share_oracle(*columns)
    single = precision.name == "float32"
    # The oracle's arc cosines cancel like 1e-16 / α_s.
    assert np.abs(got - want).max() < (3e-6 if single else 1e-14 + 3e-15 / narrow)
    seen = want > 1e-3
    assert seen.sum() > 200
    assert np.abs(got / np.where(seen, want, 1) - 1)[seen].max() < (1e-4 if single else 1e-11 + 3e-12 / narrow)


def test_the_planar_limit_is_reached_without_a_transition(precision):
    """The limit's own error is α_s / 2 at most; from α_s = 1e-7 on it is below single precision."""
    for narrow in (1e-2, 1e-3, 1e-5, 1e-7, 1e-9):
        alpha_v = np.linspace(0.3, 1.5, 60)
        columns = as_given(precision, alpha_v, narrow, alpha_v + narrow * np.linspace(-1.1, 1.1, 60))
        error = np.abs(evaluate(caps.cap_share, precision, *columns) - oracle.planar_share(*columns)).max()
        assert error < 0.6 * narrow + (5e-7 if precision.name == "float32" else 1e-12)
        assert narrow < 1e-4 or error > 0.05 * narrow


def test_a_mirror_sees_a_step(precision):
    alpha_v = [0.5, 0.5, 0.5, 0.0, 0.0, PI / 2]
    beta = [0.4, 0.5, 0.6, 0.0, 0.1, PI / 2]
    for f in (caps.cap_share, caps.oat_share):
        got = evaluate(f, precision, alpha_v, np.zeros(6), beta)
        assert got == pytest.approx([1, 0.5, 0, 0, 0, 0.5], abs=1e-6)


def test_all_caps_up_to_the_sphere(precision):
    """Beyond hemispheres, against rings; and both ways round, which take different branches."""
    rng = np.random.default_rng(3)
    a1, a2, beta = as_given(precision, *(rng.uniform(0, PI, 500) for _ in range(3)))
    got = evaluate(caps.cap_intersection, precision, a1, a2, beta)
    want = np.array([oracle.cap_intersection(*row) for row in zip(a1, a2, beta, strict=True)])
    tolerance = 1e-5 if precision.name == "float32" else 1e-12
    assert got == pytest.approx(want, abs=tolerance)
    assert evaluate(caps.cap_intersection, precision, a2, a1, beta) == pytest.approx(want, abs=tolerance)
    kinds = [beta > a1 + a2, beta < abs(a1 - a2), a1 + a2 + beta > 2 * PI, (a1 > PI / 2) & (a2 > PI / 2)]
    assert min(k.sum() for k in kinds) > 20


def corners():
    """Every combination of nothing, points, touching, coinciding and opposite cones, and of hemispheres."""
    angles = [
        0,
        1e-30,
        1e-12,
        1e-6,
        1e-3,
        0.4,
        0.4 + 1e-7,
        1.2,
        PI / 2 - 1e-6,
        PI / 2,
        PI / 2 + 1e-6,
        2.5,
        PI - 1e-6,
        PI,
    ]
    a1, a2 = (x.ravel() for x in np.meshgrid(angles, angles))
    rows = [
        np.stack([a1, a2, beta])
        for beta in (
            0 * a1,
            a1,
            a1 + a2,
            abs(a1 - a2),
            abs(a1 - a2) + 1e-7,
            2 * PI - a1 - a2,
            1e-30 + 0 * a1,
            PI + 0 * a1,
        )
    ]
    rows = np.concatenate(rows, axis=1)
    return rows[:, (rows[2] >= 0) & (rows[2] <= PI)]


def test_corners(precision):
    a1, a2, beta = as_given(precision, *corners())
    # Single precision has a π that is a little too large.
    a1, a2, beta = (np.minimum(x, PI) for x in (a1, a2, beta))
    got = evaluate(caps.cap_intersection, precision, a1, a2, beta)
    want = np.array([oracle.cap_intersection(*row) for row in zip(a1, a2, beta, strict=True)])
    # Where two rims nearly coincide, lens and cone differ by roots of roundings.
    assert got == pytest.approx(want, abs=1e-5 if precision.name == "float32" else 1e-8)
    for f in (caps.cap_share, caps.oat_share):
        share = evaluate(f, precision, a1, a2, beta)
        assert share.min() >= 0
        assert share.max() <= 1 + 1e-5


def derivatives(f, precision, columns, weights=None):
    """Gradients in reverse mode, one row per argument."""
    arguments = lanes(precision, *columns)
    dr.enable_grad(*arguments)
    value = f(*arguments)
    dr.backward(dr.sum(value if weights is None else value * precision.lanes(weights)))
    return np.array([dr.grad(a) for a in arguments], dtype=float)


@pytest.mark.parametrize("name", ["cap_intersection", "cap_share", "oat_intersection", "oat_share"])
def test_derivatives_by_central_differences(precision, name):
    f = getattr(caps, name)
    rng = np.random.default_rng(5)
    a1, a2 = rng.uniform(0.05, PI if "cap" in name else PI / 2, (2, 300))
    least, most = np.abs(a1 - a2), np.minimum(a1 + a2, 2 * PI - a1 - a2)
    beta = least + (most - least) * rng.uniform(0.02, 0.98, 300)
    beta[::5] = rng.uniform(0, PI, 60)
    got = derivatives(f, precision, (a1, a2, beta))
    Float = dr.float64_array_t(precision.Float)
    h = 1e-6
    for k in range(3):
        moved = [[c + (s * h if j == k else 0) for j, c in enumerate((a1, a2, beta))] for s in (1, -1)]
        up, down = (np.array(f(*map(Float, row))) for row in moved)
        # Oat's smoothstep has kinks in its second derivative where cones are equally wide.
        assert got[k] == pytest.approx((up - down) / (2 * h), abs=1e-4 if precision.name == "float32" else 1e-5)


def test_derivatives_of_narrow_cones(precision):
    """Down to where they are limited: V_s falls from 1 to 0 while the rim moves by 2 α_s."""
    narrow = 1e-3
    columns = as_given(precision, *lenses(200, 7, narrow))
    got = derivatives(caps.cap_share, precision, columns)
    Float = dr.float64_array_t(precision.Float)
    h = 1e-6 * narrow
    for k in range(3):
        moved = [[c + (s * h if j == k else 0) for j, c in enumerate(columns)] for s in (1, -1)]
        up, down = (np.array(caps.cap_share(*map(Float, row))) for row in moved)
        want = (up - down) / (2 * h)
        assert np.abs(want).max() > 100
        # At the ends of the range they start like roots, where one rounding of the rim's place is 1e-4 of α_s.
        assert got[k] * narrow == pytest.approx(want * narrow, abs=1e-4)


@pytest.mark.parametrize("name", ["cap_intersection", "cap_share", "oat_intersection", "oat_share"])
def test_derivatives_are_bounded_in_all_corners(precision, name):
    a1, a2, beta = corners()
    got = derivatives(getattr(caps, name), precision, (a1, a2, beta))
    assert np.isfinite(got).all()
    # Rims sweep 2π at most, and of a narrow cap a share of 1 / (2 sin ½α_s) or less.
    limit = 2 * PI + 1e-5 if "intersection" in name else 1.01 / caps.LEAST[precision.name == "float32"]
    assert np.abs(got).max() < limit


def test_forward_and_reverse_mode_are_adjoint(precision):
    rng = np.random.default_rng(8)
    columns = lenses(200, 9, 0.4)
    v, w = rng.standard_normal((3, 200)), rng.standard_normal(200)
    arguments = lanes(precision, *columns)
    for a, direction in zip(arguments, v, strict=True):
        dr.enable_grad(a)
        dr.set_grad(a, precision.lanes(direction))
    value = caps.cap_share(*arguments)
    dr.forward_to(value)
    forward = np.array(dr.grad(value), dtype=float) @ w
    reverse = np.sum(derivatives(caps.cap_share, precision, columns, w) * v)
    assert forward == pytest.approx(reverse, rel=1e-3 if precision.name == "float32" else 1e-10)


def test_what_oats_smoothstep_misses(precision):
    """Its published use: caps up to hemispheres, where it is up to 0.16 too bright and 0.10 too dark."""
    rng = np.random.default_rng(11)
    a_v, a_s, beta = np.arccos(rng.uniform(0, 1, 4000)), rng.uniform(0.05, PI / 2, 4000), rng.uniform(0, PI, 4000)
    error = evaluate(caps.oat_share, precision, a_v, a_s, beta) - evaluate(caps.cap_share, precision, a_v, a_s, beta)
    assert 0.1 < error.max() < 0.17
    assert -0.11 < error.min() < -0.07
