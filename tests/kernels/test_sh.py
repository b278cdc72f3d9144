"""Spherical harmonics, zonal functions, moments and products of functions against golden values and quadrature."""

import numpy as np
import pytest
from oracles import golden, harmonics, sphere
from oracles.slice_oracle import unit

import drjit as dr  # isort: skip

from gtao.kernels import gaunt, sh

ORDER = 4


def numbers(arrays):
    return np.array([np.array(a, dtype=np.float64) + np.zeros(1) for a in arrays])


def random_directions(n, seed):
    return unit(np.random.default_rng(seed).standard_normal((n, 3)))


def harmonics_of(precision, directions, order=ORDER):
    return numbers(sh.basis(*(precision.lanes(column) for column in np.transpose(directions)), order))


def test_basis_golden(precision):
    cases = golden.cases("C.sh_basis")
    got = harmonics_of(precision, [unit(i["dir"]) for i, _ in cases])
    assert got == pytest.approx(np.transpose([o["Y"] for _, o in cases]), abs=precision.tolerance)


@pytest.mark.parametrize("order", range(ORDER + 1))
def test_lower_orders_are_the_first_bands(precision, order):
    d = random_directions(20, 1)
    assert np.array_equal(harmonics_of(precision, d, order), harmonics_of(precision, d)[: (order + 1) ** 2])


def test_the_basis_is_orthonormal(precision):
    d, w = sphere.nodes(2 * ORDER)
    y = harmonics_of(precision, d)
    assert (y * w) @ y.T == pytest.approx(np.eye(25), abs=precision.tolerance)


def to_zh(kernel):
    """Kernels as coefficients about z: z_l = √((2l+1)/4π) K_l."""
    values = numbers(kernel)
    return values * np.sqrt((2 * np.arange(len(values)) + 1) / (4 * np.pi))[:, None]


def test_zonal_kernels_golden(precision):
    cases = golden.cases("C.zh")
    x = precision.lanes([np.cos(i["alpha"]) for i, _ in cases])
    want = {name: np.array([o[name] for _, o in cases]).T for name in cases[0][1]}
    assert to_zh(sh.cone(x, ORDER)) == pytest.approx(want["cone_zh"], abs=precision.tolerance)
    got = to_zh(sh.cone_cosine(np.pi * (1 - x * x), x, ORDER))
    assert got == pytest.approx(want["cone_cos_zh"], abs=precision.tolerance)
    kernel = [precision.lanes([k] * len(cases)) for k in sh.CLAMPED_COSINE]
    assert numbers(kernel) == pytest.approx(want["clamped_cos_kernel"], abs=precision.tolerance)
    assert to_zh(kernel) == pytest.approx(want["clamped_cos_zh"], abs=precision.tolerance)


def test_narrow_cones_keep_their_digits(precision):
    """Relative to what is in the cone: nothing cancels, down to an aperture whose cosine float32 still tells from 1."""
    for alpha in (0.3, 0.03, 0.01):
        x = precision.lanes([np.cos(alpha)])
        exact = float(np.array(x)[0])
        got = numbers(sh.cone(x, ORDER))[:, 0]
        z, w = np.polynomial.legendre.leggauss(20)
        z, w = exact + (1 - exact) * (z + 1) / 2, w * (1 - exact) / 2
        want = [2 * np.pi * np.sum(w * np.polynomial.legendre.legval(z, np.eye(5)[k])) for k in range(5)]
        assert got == pytest.approx(want, rel=precision.tolerance)


def test_a_zonal_function_about_any_axis(precision):
    """Coefficients K_l Y_lm(a) against the projection of f(⟨a, ω⟩), f a polynomial."""
    d, w = sphere.nodes(2 * ORDER)
    axis = random_directions(1, 3)[0]
    z, v = np.polynomial.legendre.leggauss(8)

    def f(x):
        return 0.3 - 0.5 * x + 0.2 * x**2 + 0.7 * x**3 - 0.4 * x**4

    kernel = [
        precision.Float(2 * np.pi * np.sum(v * f(z) * np.polynomial.legendre.legval(z, np.eye(5)[k]))) for k in range(5)
    ]
    got = numbers(sh.zonal(kernel, sh.basis(*(precision.lanes([c]) for c in axis), ORDER)))[:, 0]
    want = harmonics.basis(d, ORDER).T @ (w * f(d @ axis))
    assert got == pytest.approx(want, abs=precision.tolerance)


def test_moments_and_back(precision):
    rng = np.random.default_rng(5)
    d = unit(rng.standard_normal((40, 3)))
    weight = rng.random(40)
    upper = np.triu_indices(3)
    m0, m1, m2 = weight.sum(), weight @ d, np.einsum("k,ki,kj->ij", weight, d, d)[upper]
    lanes = precision.lanes([m0]), [precision.lanes([v]) for v in m1], [precision.lanes([v]) for v in m2]
    coefficients = sh.from_moments(*lanes)
    # A sum of 40 directions: magnitudes of order 10.
    tolerance = 20 * precision.tolerance
    assert numbers(coefficients)[:, 0] == pytest.approx(weight @ harmonics.basis(d, 2), abs=tolerance)
    back0, back1, back2 = sh.to_moments(coefficients)
    got = numbers([back0, *back1, *back2])[:, 0]
    assert got == pytest.approx([m0, *m1, *m2], abs=tolerance)


@pytest.mark.parametrize("order", [2, ORDER])
def test_triple_products_by_quadrature(order):
    """Every Γ_ijk, those that the table leaves out too, against quadrature that is exact for their degree."""
    d, w = sphere.nodes(3 * order)
    y = harmonics.basis(d, order)
    want = np.einsum("n,ni,nj,nk->ijk", w, y, y, y, optimize=True)
    got = np.zeros_like(want)
    for i, j, k, value in gaunt.table(order):
        for a, b, c in ((i, j, k), (i, k, j), (j, i, k), (j, k, i), (k, i, j), (k, j, i)):
            got[a, b, c] = value
    # Rounding of sums of some thousand products.
    assert got == pytest.approx(want, abs=1e-12)


@pytest.mark.parametrize("order", [1, 2, ORDER])
def test_product_of_two_functions(precision, order):
    rng = np.random.default_rng(order)
    f, g = rng.uniform(-1, 1, (2, (order + 1) ** 2))
    d, w = sphere.nodes(3 * order)
    y = harmonics.basis(d, order)
    want = y.T @ (w * (y @ f) * (y @ g))
    lanes = [precision.lanes([v]) for v in f], [precision.lanes([v]) for v in g]
    got = numbers(gaunt.product(*lanes, order, order))[:, 0]
    assert got == pytest.approx(want, abs=precision.tolerance)
    few = numbers(gaunt.product(*lanes, order, order - 1))[:, 0]
    assert few == pytest.approx(want[: order**2], abs=precision.tolerance)


def test_derivatives_of_the_basis(precision):
    """A polynomial of each component: against differences of the oracle along the sphere."""
    d = random_directions(12, 7)
    along = np.cross(d, random_directions(12, 8))
    h = 1e-5
    want = (harmonics.basis(unit(d + h * along), ORDER) - harmonics.basis(unit(d - h * along), ORDER)) / (2 * h)
    lanes = [precision.lanes(column) for column in d.T]
    dr.enable_grad(lanes)
    for lane, column in zip(lanes, along.T, strict=True):
        dr.set_grad(lane, precision.lanes(column))
    y = sh.basis(*lanes, ORDER)
    dr.forward_to(*y[1:])
    # Differences of the second order: third derivatives of harmonics of order 4 are below 100.
    got = numbers(dr.grad(v) for v in y[1:])
    assert got == pytest.approx(want[:, 1:].T, abs=max(1e-7, 10 * precision.tolerance))
