"""Coordinates of tables: inverses, bounds, finite derivatives, and what they say of cones."""

import itertools

import numpy as np
import pytest

import drjit as dr  # isort: skip

from gtao.kernels.table_axes import ARGUMENTS, AXES, DEFAULT_AXES, table_axes

ALL = sorted(AXES)
HALF = np.pi / 2
CORNERS = {
    "alpha_v": (0, 1e-7, 0.3, HALF, 3),
    "beta": (0, 1e-7, 0.3, HALF, np.pi),
    "alpha": (0, 1e-4, 0.3, 1),
}


def of(arrays):
    return np.array([np.array(a, np.float64) for a in arrays])


@pytest.mark.parametrize("key", ALL)
def test_from_unit_is_inverse(precision, key):
    axes = AXES[key]
    # Near the edges where a cone closes a table holds the limit, and arguments are moved inward.
    u = np.random.default_rng(3).uniform(0.02, 0.98, (len(axes.names), 500))
    back = axes.to_unit(*axes.from_unit(*map(precision.lanes, u)))
    # Arc cosines near 1 and back cost half the digits.
    assert np.abs(of(back) - u).max() < (1e-10 if precision.name == "float64" else 2e-3)


@pytest.mark.parametrize("key", ALL)
def test_finite_with_finite_derivatives_everywhere(precision, key):
    axes = AXES[key]
    names = ARGUMENTS[axes.kind]
    points = np.transpose(list(itertools.product(*(CORNERS[name] for name in names))))
    given = {name: precision.lanes(p) for name, p in zip(names, points, strict=True)}
    dr.enable_grad(*given.values())
    unit, scale = axes.to_unit(**given), axes.scale(**given)
    assert all(np.all((u >= 0) & (u <= 1)) for u in of(unit))
    assert np.isfinite(np.array(scale)).all()
    dr.backward(sum(unit) + scale)
    assert all(np.isfinite(g).all() for g in of(map(dr.grad, given.values())))


def test_every_kind_has_a_default():
    for kind, name in DEFAULT_AXES.items():
        assert table_axes(kind, name).kind == kind
        assert set(ARGUMENTS) == set(DEFAULT_AXES)
