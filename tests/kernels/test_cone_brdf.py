"""Reflection in a cone at run time: golden values, rings in double precision, convergence, corners, derivatives."""

import numpy as np
import pytest
from oracles import golden
from oracles import specular as oracle

import drjit as dr  # isort: skip

from gtao.kernels.cone_brdf import cone_brdf, hemisphere_brdf

PI = np.pi
NAMES = ("alpha_v", "beta", "chi", "alpha", "theta_o")


def lanes(precision, columns):
    return [precision.lanes(np.ravel(c)) for c in np.broadcast_arrays(*columns)]


def evaluate(precision, columns, *options):
    return np.array(cone_brdf(*lanes(precision, columns), *options), dtype=float).T


def hemisphere(precision, alpha, theta_o, *options):
    return np.array(hemisphere_brdf(*lanes(precision, (alpha, theta_o)), *options), dtype=float).T


def cases(n, seed, least=-2.0):
    """Cones, directions and widths from 10^``least`` on; half of the rims near the reflected direction."""
    rng = np.random.default_rng(seed)
    alpha = np.where(np.arange(n) % 2, rng.uniform(0.05, 1, n), 10 ** rng.uniform(least, 0, n))
    alpha_v, theta_o = rng.uniform(0.02, PI / 2, n), rng.uniform(0, 1.5, n)
    near = np.clip(alpha_v + 2 * alpha * rng.standard_normal(n), 0, PI)
    beta = np.where(np.arange(n) % 4 < 2, near, rng.uniform(0, PI, n))
    return alpha_v, beta, np.where(np.arange(n) % 3, rng.uniform(-PI, PI, n), 0.0), alpha, theta_o


@pytest.fixture(scope="module")
def truth():
    """(columns, (A_V, B_V), (A, B)) by rings."""
    columns = cases(160, 1)
    rows = list(zip(*columns, strict=True))
    cone = np.array([oracle.cone_brdf(*row) for row in rows])
    return columns, cone, np.array([oracle.environment_brdf(*row[3:]) for row in rows])


def specular(F0, cone, whole):
    return (F0 * cone[:, 0] + cone[:, 1]) / (F0 * whole[:, 0] + whole[:, 1])


def test_golden(precision):
    values = golden.cases("E.full_brdf")
    columns = [np.array([i[k] for i, _ in values]) for k in NAMES]
    want = {name: np.array([o[name] for _, o in values]) for name in values[0][1]}
    # What is held to 1e-8 in double precision takes more nodes than an image does.
    tolerance = max(precision.tolerance, 1e-8)
    cone, whole = evaluate(precision, columns, 128), hemisphere(precision, *columns[3:], 128)
    got = {"A_V": cone[:, 0], "B_V": cone[:, 1], "A": whole[:, 0], "B": whole[:, 1]}
    got["S_F1"] = specular(1.0, cone, whole)
    got["S_F0"] = specular(np.array([i["F0"] for i, _ in values]), cone, whole)
    _, beta, chi, _, theta_o = columns
    got["n_dot_b"] = [oracle.geometry(*row)[2][2] for row in zip(beta, chi, theta_o, strict=True)]
    assert set(got) == {"A_V", "B_V", "A", "B", "S_F1", "S_F0", "n_dot_b"}
    for name, value in got.items():
        assert np.array(value) == pytest.approx(want[name], abs=tolerance), name


@pytest.mark.parametrize(("n_nodes", "error"), [(8, 4e-3), (12, 1e-3), (16, 6e-4), (24, 2e-4), (32, 6e-5), (64, 4e-6)])
def test_error_against_the_number_of_nodes(precision, truth, n_nodes, error):
    """As root mean squares of A_V / A, B_V / A, and S of a dielectric; largest where a rim passes the view vector."""
    columns, cone, whole = truth
    got = evaluate(precision, columns, n_nodes)
    rounding = 4e-6 if precision.name == "float32" else 0

    def rms(x):
        return np.sqrt(np.mean(x**2))

    # Of A, for B too: near normal incidence that is 1e-6 of A, made by tails of the lobe that have few nodes.
    assert rms((got - cone)[:, 0] / whole[:, 0]) < error + rounding
    assert rms((got - cone)[:, 1] / whole[:, 0]) < error + rounding
    assert rms(specular(0.04, got, whole) - specular(0.04, cone, whole)) < error + rounding
    assert np.abs(got - cone).max() < 20 * error


def test_tails_of_narrow_lobes(precision, truth):
    """B_V as a share of B, which near normal incidence is what tails reflect toward the horizon."""
    columns, cone, whole = truth
    error = ((evaluate(precision, columns, 32) - cone) / whole)[:, 1]
    assert np.sqrt(np.mean(error**2)) < 1.5e-3


def angles_of(b, theta_o):
    """β and χ of axes in the frame whose normal is z."""
    s, c = np.sin(theta_o), np.cos(theta_o)
    along, inward = s * b[:, 0] + c * b[:, 2], s * b[:, 2] - c * b[:, 0]
    return np.arctan2(np.hypot(inward, b[:, 1]), along), np.arctan2(b[:, 1], inward)


def test_cones_opposite_to_the_view(precision):
    """Around -ω_o, beside the plane of incidence, with the horizon through them: angles there pass half a turn."""
    rng = np.random.default_rng(12)
    n = 60
    theta_o, alpha, alpha_v = rng.uniform(1.1, 1.45, n), rng.uniform(0.3, 1, n), rng.uniform(0.2, 0.5, n)
    away, psi = rng.uniform(0.2, 0.7, n), rng.choice([-1, 1], n) * rng.uniform(0.9, PI / 2, n)
    s, c = np.sin(theta_o), np.cos(theta_o)
    opposite, across = np.array([s, 0 * s, -c]), np.array([c, 0 * s, s])
    b = np.cos(away) * opposite + np.sin(away) * (np.cos(psi) * across + np.sin(psi) * np.array([[0], [1], [0]]))
    columns = alpha_v, *angles_of(b.T, theta_o), alpha, theta_o
    want = np.array([oracle.cone_brdf(*row) for row in zip(*columns, strict=True)])
    assert (want[:, 0] > 1e-3).sum() > 20
    assert evaluate(precision, columns, 48) == pytest.approx(want, abs=2e-4)


def test_grazing_views(precision):
    theta_o = PI / 2 - np.array([0.03, 0.01, 1e-3])
    whole = hemisphere(precision, 0.3, theta_o, 128)
    want = np.array([oracle.environment_brdf(0.3, t) for t in theta_o])
    assert whole == pytest.approx(want, abs=2e-4)
    for alpha in (0.1, 0.5):
        columns = np.full(3, 1.0), np.full(3, 0.6), np.full(3, 0.5), np.full(3, alpha), theta_o
        want = np.array([oracle.cone_brdf(*row) for row in zip(*columns, strict=True)])
        assert evaluate(precision, columns, 64) == pytest.approx(want, rel=2e-3)


def test_narrow_cones_keep_their_digits(precision):
    """In single precision cos α_v is 1 for half angles below 3e-4."""
    rng = np.random.default_rng(13)
    n = 100
    theta_o, alpha, alpha_v = rng.uniform(0.1, 1.2, n), rng.uniform(0.2, 1, n), 10 ** rng.uniform(-3, -1, n)
    columns = alpha_v, rng.uniform(0, 0.3, n), rng.uniform(-3, 3, n), alpha, theta_o
    solid = oracle.cap(alpha_v)
    got = evaluate(precision, columns)[:, 0] / solid
    wo, _, b = zip(*(oracle.geometry(*row) for row in zip(*columns[1:3], theta_o, strict=True)), strict=True)
    # In the limit, the BRDF at the axis; a mean over the cone beyond that.
    limit = [oracle.brdf(x, v, a)[0] for x, v, a in zip(np.array(b), np.array(wo), alpha, strict=True)]
    assert got == pytest.approx(limit, rel=0.05)
    fine = dr.float64_array_t(precision.Float)
    double = np.array(cone_brdf(*(fine(c) for c in columns))[0]) / solid
    # Half angles of 1e-3 are 1e-4 of themselves off where directions are rounded to 1e-7.
    assert got == pytest.approx(double, rel=2e-3)


def test_cones_narrower_than_roundings(precision):
    """Directions are rounded to 1e-7, which must not make planes that miss a cone count as if they did not."""
    rng = np.random.default_rng(14)
    n = 2000
    columns = [rng.uniform(*limits, n) for limits in ((0, 1), (0, 0.4), (-3, 3), (0.2, 1), (0.2, 1.2))]
    columns[0] = np.full(n, 1e-6)
    got = evaluate(precision, columns)[:, 0]
    fine = dr.float64_array_t(precision.Float)
    slopes = derivatives(precision, columns)[0]
    A, B = cone_brdf(*(fine(c) for c in columns))
    assert np.abs(got / np.array(A) - 1).max() < 0.5
    want = np.array(A + 3 * B) * 2 / 1e-6
    # In single precision the rim's place in a plane is not known to better than a tenth of the half angle.
    assert np.median(np.abs(slopes / want - 1)) < 0.2
    assert np.abs(slopes).max() < 10 * want.max()


def test_views_from_below_count_as_grazing(precision):
    assert evaluate(precision, (0.7, 0.5, 0.3, 0.4, 2.0)) == pytest.approx(
        evaluate(precision, (0.7, 0.5, 0.3, 0.4, PI / 2))
    )
    assert hemisphere(precision, 0.4, 2.0) == pytest.approx(hemisphere(precision, 0.4, PI / 2))


def test_the_hemisphere(precision, truth):
    columns, _, whole = truth
    for n_nodes, error in ((16, 6e-4), (64, 6e-6)):
        got = hemisphere(precision, *columns[3:], n_nodes)
        rounding = 4e-6 if precision.name == "float32" else 0
        assert np.sqrt(np.mean((got / whole - 1)[:, 0] ** 2)) < error + rounding
        cone = evaluate(precision, (PI / 2, columns[4], 0.0, *columns[3:]), n_nodes)
        assert np.sqrt(np.mean((cone - got) ** 2)) < error + rounding


def test_both_sides_of_the_plane_of_incidence_are_alike(precision, truth):
    alpha_v, beta, chi, alpha, theta_o = truth[0]
    one, other = (evaluate(precision, (alpha_v, beta, s * chi, alpha, theta_o)) for s in (1, -1))
    assert one == pytest.approx(other, abs=2e-5 if precision.name == "float32" else 1e-12)


def test_wider_cones_count_as_hemispheres(precision):
    columns = 2.0, 0.7, 0.4, 0.3, 0.9
    assert evaluate(precision, columns).tolist() == evaluate(precision, (PI / 2, *columns[1:])).tolist()


def test_a_mirror_sees_what_the_cone_holds(precision):
    """At a width of 1e-4: all of the lobe or nothing, and Fresnel's term at the mirror's half vector."""
    theta_o = 0.6
    got = evaluate(precision, ([0.5, 0.5], [0.45, 0.55], 1.0, 0.0, theta_o), 24)
    k = (1 - np.cos(theta_o)) ** 5
    assert got == pytest.approx(np.array([[1 - k, k], [0, 0]]), abs=2e-4)


def corners():
    """Nothing, hemispheres, axes along and opposite to everything, grazing and head-on views, mirrors."""
    half = PI / 2
    rows = np.meshgrid([0.0, 1e-6, 0.7, half], [0.0, 1e-6, 0.7, half, PI], [0.0, half, PI, 2.0], [0.0, 1e-3, 0.4, 1.0],
                       [0.0, 1e-6, 0.35, 0.7, half - 1e-4, half])  # fmt: skip
    return [r.ravel() for r in rows]


def test_corners(precision):
    columns = corners()
    got = evaluate(precision, columns, 24)
    whole = hemisphere(precision, *columns[3:], 24)
    assert np.isfinite(got).all()
    assert got.min() > -1e-6
    # 1e-3 is the error where a rim passes the view vector.
    assert (got - whole).max() < 5e-3
    wide = (columns[3] >= 0.4) & (columns[4] < PI / 2 - 1e-3) & (columns[0] > 0.1)
    some = np.flatnonzero(wide)[::7]
    want = np.array([oracle.cone_brdf(*(c[k] for c in columns)) for k in some])
    assert got[some] == pytest.approx(want, abs=5e-3)


def derivatives(precision, columns, weights=None):
    arguments = lanes(precision, columns)
    dr.enable_grad(arguments)
    A, B = cone_brdf(*arguments)
    value = A + 3 * B
    dr.backward(dr.sum(value if weights is None else value * precision.lanes(weights)))
    return np.array([dr.grad(a) for a in arguments], dtype=float)


def test_derivatives_by_differences_of_rings(precision):
    """All five, of the integral and not of the quadrature."""
    rng = np.random.default_rng(4)
    n = 24
    columns = [rng.uniform(*limits, n) for limits in ((0.3, 1.4), (0.1, 1.2), (-2, 2), (0.15, 1), (0.2, 1.3))]
    got = derivatives(precision, columns)
    h = 1e-4
    for k in range(5):
        up, down = (
            np.array([oracle.cone_brdf(*row) @ [1, 3] for row in zip(*moved, strict=True)])
            for moved in ([c + (s * h if j == k else 0) for j, c in enumerate(columns)] for s in (1, -1))
        )
        want = (up - down) / (2 * h)
        error = got[k] - want
        assert np.sqrt(np.mean(error**2)) < 0.02, NAMES[k]
        assert np.median(np.abs(error)) < 2e-4 * (1 + np.abs(want).max()), NAMES[k]


def test_derivatives_of_the_hemisphere(precision):
    rng = np.random.default_rng(5)
    alpha, theta_o = rng.uniform(0.15, 1, 30), rng.uniform(0.1, 1.3, 30)
    arguments = lanes(precision, (alpha, theta_o))
    dr.enable_grad(arguments)
    A, B = hemisphere_brdf(*arguments, 32)
    dr.backward(dr.sum(A + 3 * B))
    Float, h = dr.float64_array_t(precision.Float), 1e-5
    for k in range(2):
        moved = [[c + (s * h if j == k else 0) for j, c in enumerate((alpha, theta_o))] for s in (1, -1)]
        up, down = (np.array(hemisphere_brdf(*map(Float, row), 128)).T @ [1, 3] for row in moved)
        assert np.array(dr.grad(arguments[k])) == pytest.approx((up - down) / (2 * h), abs=2e-3)


def test_derivatives_are_finite_in_all_corners(precision):
    got = derivatives(precision, corners())
    assert np.isfinite(got).all()
    # Of a lobe of the least width, 1e-4, whose width across is that times the width again where the view grazes.
    grazing = corners()[4] > PI / 2 - 1e-3
    assert np.abs(got[:, ~grazing]).max() < 1e5
    assert np.abs(got).max() < 1e8


def test_forward_and_reverse_mode_are_adjoint(precision):
    rng = np.random.default_rng(8)
    columns = cases(60, 9, -1)
    v, w = rng.standard_normal((5, 60)), rng.standard_normal(60)
    arguments = lanes(precision, columns)
    for a, direction in zip(arguments, v, strict=True):
        dr.enable_grad(a)
        dr.set_grad(a, precision.lanes(direction))
    A, B = cone_brdf(*arguments)
    value = A + 3 * B
    dr.forward_to(value)
    forward = np.array(dr.grad(value), dtype=float) @ w
    reverse = np.sum(derivatives(precision, columns, w) * v)
    assert forward == pytest.approx(reverse, rel=1e-3 if precision.name == "float32" else 1e-9)
