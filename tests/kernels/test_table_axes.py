"""Coordinates of tables: inverses, bounds, finite derivatives, and what they say of cones."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from gtao import backend

import drjit as dr  # isort: skip

from gtao.data.specular import KINDS
from gtao.kernels.table_axes import ARGUMENTS, AXES, DEFAULT_AXES, table_axes

ALL = sorted(AXES)
HALF = np.pi / 2
CORNERS = {
    "alpha_v": (0, 1e-7, 0.3, HALF, 3, np.pi),
    "beta": (0, 1e-7, 0.3, HALF, np.pi),
    "alpha": (0, 1e-9, 1e-4, 0.3, 1),
    "theta_o": (0, 1e-7, 1, HALF),
    "chi": (0, 1, -HALF, np.pi),
}


def of(arrays):
    return np.array([np.array(a, np.float64) for a in arrays])


def grid(precision, kind, values):
    names = ARGUMENTS[kind]
    points = np.transpose(list(itertools.product(*(values[name] for name in names))))
    return {name: precision.lanes(p) for name, p in zip(names, points, strict=True)}


@pytest.mark.parametrize("key", ALL)
def test_from_unit_is_inverse(precision, key):
    axes = AXES[key]
    # Near the edges where a cone closes or a lobe narrows a table holds the limit, and arguments are moved inward.
    u = np.random.default_rng(3).uniform(0.04, 0.96, (len(axes.names), 500))
    arguments = axes.from_unit(*map(precision.lanes, u))
    # No roughness has the cones of reflection beyond arccos 0.1, which the upper corner of these axes asks for.
    real = of(arguments)[ARGUMENTS[key[0]].index("alpha")] <= 1
    back = axes.to_unit(**dict(zip(ARGUMENTS[key[0]], arguments, strict=True)))
    # Arc cosines near 1 cost half the digits, and angles are compared within a lobe a thousandth of them wide.
    assert np.abs(of(back) - u)[:, real].max() < (1e-9 if precision.name == "float64" else 4e-3)
    assert real.mean() > 0.3


@pytest.mark.parametrize("key", ALL)
def test_finite_with_finite_derivatives_everywhere(precision, key):
    axes = AXES[key]
    given = grid(precision, key[0], CORNERS)
    dr.enable_grad(*given.values())
    unit, scale = axes.to_unit(**given), axes.scale(**given)
    assert all(np.all((u >= 0) & (u <= 1)) for u in of(unit))
    assert np.isfinite(np.array(scale)).all()
    dr.backward(sum(unit) + scale)
    assert all(np.isfinite(g).all() for g in of(map(dr.grad, given.values())))


def test_smooth_and_grazing_have_bounded_derivatives(precision):
    """Roots do not make them infinite where roughness or the cosine of the view ends."""
    alpha, theta_o = precision.lanes((0, 1e-12, 1e-6, 0.1)), precision.lanes((HALF, HALF - 1e-7, 1.5, 0.1))
    dr.enable_grad(alpha, theta_o)
    dr.backward(sum(AXES["environment-brdf", "root"].to_unit(alpha=alpha, theta_o=theta_o)))
    assert all(np.abs(g).max() <= 50.001 for g in of(map(dr.grad, (alpha, theta_o))))


@pytest.mark.parametrize("key", ALL)
def test_derivatives_are_those_of_differences(key):
    axes, h = AXES[key], 1e-6
    precision = SimpleNamespace(lanes=dr.float64_array_t(backend.default_float()))
    inside = {"alpha_v": (0.4, 0.9), "beta": (0.5, 0.85), "alpha": (0.3, 0.6), "theta_o": (0.4, 1.3), "chi": (0.5, 2)}
    for name in ARGUMENTS[key[0]]:
        given = grid(precision, key[0], inside)
        dr.enable_grad(given[name])
        total = sum(axes.to_unit(**given)) + axes.scale(**given)
        dr.backward(total)
        below, above = (
            sum(axes.to_unit(**moved)) + axes.scale(**moved)
            for moved in (given | {name: dr.detach(given[name]) + d} for d in (-h, h))
        )
        expected = (np.array(above) - np.array(below)) / (2 * h)
        # Second differences of curvatures up to 1e3, and rounding over h.
        assert np.array(dr.grad(given[name])) == pytest.approx(expected, rel=1e-5, abs=1e-7)


@pytest.mark.parametrize("key", ALL)
def test_single_precision_is_enough(key):
    """A coordinate is off by less than a hundredth of a texel of 32."""
    Float = backend.default_float()
    rng = np.random.default_rng(2)
    values = {
        "alpha_v": rng.uniform(0, HALF, 2000),
        "beta": rng.uniform(0, np.pi, 2000),
        "alpha": rng.uniform(0.05, 1, 2000) ** 2,
        "theta_o": np.arccos(rng.random(2000)),
        "chi": rng.uniform(-np.pi, np.pi, 2000),
    }
    single, double = (
        of(AXES[key].to_unit(**{name: T(values[name]) for name in ARGUMENTS[key[0]]}))
        for T in (Float, dr.float64_array_t(Float))
    )
    assert np.abs(single - double).max() < 0.01 / 31


@pytest.mark.parametrize("key", ALL)
def test_angles_outside_the_domain_count_as_its_border(precision, key):
    axes = AXES[key]
    values = dict.fromkeys(ARGUMENTS[key[0]], (1.0,))
    for name in {"alpha_v", "beta"} & set(values):
        at, beyond = (of(axes.to_unit(**grid(precision, key[0], values | {name: (x,)}))) for x in (np.pi, 3.5))
        assert np.isfinite(beyond).all()
        if "cos" not in axes.names[0]:
            assert beyond == pytest.approx(at, abs=1e-6)


def test_every_kind_has_axes_of_its_number_of_coordinates():
    assert set(KINDS) == set(ARGUMENTS) == set(DEFAULT_AXES)
    for kind, name in DEFAULT_AXES.items():
        assert table_axes(kind, name).kind == kind
    for (kind, _), axes in AXES.items():
        assert len(axes.names) == KINDS[kind][0] == len(ARGUMENTS[kind])
