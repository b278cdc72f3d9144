"""Baked tables: texels against golden values, errors within what was promised, the same bits twice."""

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

import gtao
from gtao.kernels.table_axes import AXES
from gtao.tables.cones import intersection, visible_share
from gtao.tables.lanes import lanes, numbers


def looked_up(table, *arguments):
    axes = AXES[table.kind, table.axes]
    given = lanes(*arguments)
    like = np.asarray(arguments[0], np.float64)
    unit = np.stack([numbers(u, like=like) for u in axes.to_unit(*given)], -1)
    values = np.transpose(table.values[..., 0].astype(np.float64))
    read = RegularGridInterpolator([np.linspace(0, 1, n) for n in table.size], values)
    return read(unit) * numbers(axes.scale(*given), like=like)


def sampled(n):
    rng = np.random.default_rng(0)
    return np.arcsin(np.sqrt(rng.random(n))), rng.uniform(0, np.pi / 2, n), rng.uniform(0.03, 1, n)


def test_cap_intersections():
    # Mazonka's closed form, evaluated with many digits.
    for a, b, beta, omega in [
        (0.8, 0.5, 0.6, 0.5345540446643),
        (1.2, 0.01, 1.195, 0.0002526538360703),
        (0.001, 0.002, 0.0021, 1.211923182737e-06),
        (1.5, 1.47, 1.0, 3.752050358131),
    ]:
        assert intersection(a, b, beta) == pytest.approx(omega, rel=1e-9)


# Root mean square errors of 32³ texels, with 10 % for the few samples here.
@pytest.mark.parametrize(
    ("axes", "rms"),
    [("published", 0.0143), ("cosine", 0.0097), ("linear", 0.0031), ("overlap", 6e-4), ("nested", 2.4e-4)],
)
def test_cone_cone_errors(axes, rms):
    alpha_v, beta, alpha = sampled(20000)
    truth = visible_share(alpha_v, np.arccos(0.01 ** (alpha**2 / 2)), beta)
    table = gtao.tables.bake("cone-cone", 32, axes)
    error = looked_up(table, alpha_v, beta, alpha) - truth
    assert np.sqrt(np.mean(error**2)) < 1.1 * rms


def test_the_same_bits_twice_and_sizes_of_every_axis():
    first, second = (gtao.tables.bake("cone-cone", (3, 4, 5)) for _ in range(2))
    assert first.values.tobytes() == second.values.tobytes()
    assert first.values.shape == (5, 4, 3, 1)
    assert first.size == (3, 4, 5)


def test_wrong_requests_are_refused():
    with pytest.raises(gtao.ConfigError, match="unknown kind"):
        gtao.tables.bake("cone")
    with pytest.raises(gtao.ConfigError, match="no axes 'log'; choose one of published, cosine"):
        gtao.tables.bake("cone-cone", axes="log")
    with pytest.raises(gtao.ShapeError, match="3 axes"):
        gtao.tables.bake("cone-cone", (8, 8))
