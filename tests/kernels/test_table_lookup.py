"""Tables between their texels: against a loop over all texels, at the ends, and their derivatives."""

import itertools

import numpy as np
import pytest
from oracles.specular_frames import interpolated

import drjit as dr  # isort: skip

from gtao.kernels.table_lookup import lookup

SIZES = {"2-D": (3, 5), "3-D": (4, 2, 3), "4-D": (3, 2, 4, 5), "5-D": (2, 3, 2, 3, 2)}
each_size = pytest.mark.parametrize("size", SIZES.values(), ids=SIZES)


def table(size, channels, seed=1):
    return np.random.default_rng(seed).uniform(-1, 1, (*size[::-1], channels))


def looked_up(precision, values, unit):
    """(channels, points) at an array of coordinates (axes, points)."""
    size, flat = values.shape[:-1][::-1], precision.lanes(values.ravel())
    return np.array([np.array(c) for c in lookup(flat, size, values.shape[-1], [precision.lanes(u) for u in unit])])


@each_size
@pytest.mark.parametrize("channels", [1, 2])
def test_every_cell(precision, size, channels):
    values = table(size, channels)
    # Inside, beyond the ends, and the ends and texels themselves.
    unit = np.random.default_rng(2).uniform(-0.2, 1.2, (len(size), 200))
    unit[:, :40] = np.random.default_rng(3).integers(0, np.array(size)[:, None], (len(size), 40))
    unit[:, :40] /= np.array(size)[:, None] - 1
    want = np.array([interpolated(values, u) for u in unit.T]).T
    # Coordinates are rounded before their distance from a texel is taken.
    assert looked_up(precision, values, unit) == pytest.approx(want, abs=1e-12 if precision.name == "float64" else 3e-6)


@each_size
def test_what_is_linear_in_every_coordinate_is_exact(precision, size):
    coefficients = np.random.default_rng(4).uniform(-1, 1, (2,) * len(size))

    def function(*x):
        terms = itertools.product((0, 1), repeat=len(size))
        return sum(coefficients[t] * np.prod([x[k] for k in range(len(size)) if t[k]], axis=0) for t in terms)

    grid = np.meshgrid(*(np.linspace(0, 1, n) for n in size[::-1]), indexing="ij")
    unit = np.random.default_rng(5).uniform(0, 1, (len(size), 100))
    got = looked_up(precision, function(*grid[::-1])[..., None], unit)[0]
    assert got == pytest.approx(function(*unit), abs=1e-12 if precision.name == "float64" else 3e-6)


def test_no_texel_beyond_the_table_is_read(precision):
    values = table((3, 4), 2)
    got = looked_up(precision, values, np.array([[np.nan, np.inf, -np.inf, 1.0], [np.nan, np.nan, np.inf, 1.0]]))
    assert got[:, 0] == pytest.approx(values[0, 0])
    assert got[:, 1] == pytest.approx(values[0, 2])
    assert got[:, 2] == pytest.approx(values[3, 0])
    assert got[:, 3] == pytest.approx(values[3, 2])


@each_size
def test_derivatives(precision, size):
    """By coordinates: differences, which are exact within a cell. By values: each texel's share of each result."""
    values, rng = table(size, 2), np.random.default_rng(6)
    cells = rng.integers(0, np.array(size)[:, None] - 1, (len(size), 12))
    unit = (cells + rng.uniform(0.1, 0.9, cells.shape)) / (np.array(size)[:, None] - 1)
    lanes, flat = [precision.lanes(u) for u in unit], precision.lanes(values.ravel())
    dr.enable_grad(lanes, flat)
    weights = rng.standard_normal((2, 12))
    found = lookup(flat, size, 2, lanes)
    dr.backward(sum(dr.sum(c * precision.lanes(w)) for c, w in zip(found, weights, strict=True)))
    tolerance = 1e-9 if precision.name == "float64" else 1e-4
    h = 1e-3
    for k, lane in enumerate(lanes):
        step = np.zeros((len(size), 1))
        step[k] = h
        ends = [np.array([interpolated(values, u) for u in (unit + s * step).T]).T for s in (1, -1)]
        want = np.sum(weights * (ends[0] - ends[1]) / (2 * h), axis=0)
        assert np.array(dr.grad(lane)) == pytest.approx(want, abs=tolerance)
    want = np.zeros_like(values)
    for texel in itertools.product(*map(range, values.shape[:-1])):
        one = np.zeros((*values.shape[:-1], 1))
        one[texel] = 1
        want[texel] = weights @ [interpolated(one, u)[0] for u in unit.T]
    assert np.array(dr.grad(flat)) == pytest.approx(want.ravel(), abs=tolerance)


def test_beyond_the_ends_nothing_changes(precision):
    values, lanes = table((3, 4), 1), [precision.lanes(u) for u in ([-0.1, 1.1, 0.3], [0.2, 0.4, 1.2])]
    dr.enable_grad(lanes)
    dr.backward(dr.sum(lookup(precision.lanes(values.ravel()), (3, 4), 1, lanes)[0]))
    assert np.array(dr.grad(lanes[0]))[:2].tolist() == [0, 0]
    assert np.array(dr.grad(lanes[1]))[2] == 0
