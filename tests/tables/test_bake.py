"""Baked tables: texels against golden values, errors within what was promised, the same bits twice."""

import numpy as np
import pytest

import gtao
from gtao.kernels.table_axes import AXES
from gtao.tables.bake import fitted_texels
from gtao.tables.lanes import lanes, numbers


def test_the_same_bits_twice_and_sizes_of_every_axis():
    first, second = (gtao.tables.bake("brdf-4d", (3, 4, 2, 5)) for _ in range(2))
    assert first.values.tobytes() == second.values.tobytes()
    assert first.values.shape == (5, 2, 4, 3, 2)
    assert first.size == (3, 4, 2, 5)
    assert first.settings["quadrature_error"] < 1e-5


def test_texels_that_are_not_fitted_are_the_function():
    table = gtao.tables.bake("brdf-3d", (4, 5, 3), fitted=False)
    axes = AXES["brdf-3d", table.axes]
    unit = [i.ravel() / (n - 1) for i, n in zip(np.indices((3, 5, 4))[::-1], (4, 5, 3), strict=True)]
    alpha_v, beta, alpha = (numbers(x, like=unit[0]) for x in axes.from_unit(*lanes(*unit)))
    expected = gtao.tables.cone_shares(alpha_v, beta, alpha, beta).values
    assert np.array_equal(table.values.reshape(-1, 2), expected.astype(np.float32))


def test_fitted_texels_have_the_least_squared_error():
    """Of a parabola, along each of two axes: none of the texels inside can be moved either way without loss."""
    n, fine = 9, np.linspace(0, 1, 801)

    def function(x, y):
        return 0.2 + 0.3 * x**2 + 0.4 * y**2

    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n), indexing="ij")
    truth = function(*np.meshgrid(fine, fine, indexing="ij"))
    texels = fitted_texels(function(x, y)[..., None])[..., 0]

    def loss(values):
        along = np.stack([np.interp(fine, np.linspace(0, 1, n), column) for column in values.T], axis=-1)
        table = np.stack([np.interp(fine, np.linspace(0, 1, n), row) for row in along])
        # Cells at the ends have a texel that stays.
        return np.mean((table - truth)[200:-200, 200:-200] ** 2)

    # Along one axis a sixth; means, which fitting takes away, add up over the axes.
    assert loss(texels) < 0.17 * loss(function(x, y))
    for move in (-1e-4, 1e-4):
        moved = texels.copy()
        moved[4, 4] += move
        assert loss(moved) > loss(texels)
    assert np.array_equal(texels[[0, -1]][:, [0, -1]], function(x, y)[[0, -1]][:, [0, -1]])


def test_fitted_texels_stay_between_0_and_1():
    step = (np.arange(8) > 3).astype(float)[:, None]
    assert np.array_equal(fitted_texels(step), step)


@pytest.mark.parametrize("key", sorted(AXES))
def test_ratios_are_between_0_and_1(key):
    values = gtao.tables.bake(key[0], 5, key[1]).values
    assert values.min() >= 0
    assert values.max() <= 1


def test_wrong_requests_are_refused():
    with pytest.raises(gtao.ConfigError, match="unknown kind"):
        gtao.tables.bake("cone")
    with pytest.raises(gtao.ConfigError, match="no axes 'log'; choose one of published, cosine"):
        gtao.tables.bake("cone-cone", axes="log")
    with pytest.raises(gtao.ShapeError, match="3 axes"):
        gtao.tables.bake("cone-cone", (8, 8))
    with pytest.raises(gtao.ConfigError, match="no distribution 'phong'"):
        gtao.tables.bake("cone-cone", distribution="phong")
    with pytest.raises(gtao.ConfigError, match="not made of BRDFs"):
        gtao.tables.bake("cone-lobe", brdf=lambda alpha: None)
