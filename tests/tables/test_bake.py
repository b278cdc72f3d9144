"""Baked tables: texels against golden values, errors within what was promised, the same bits twice."""

import pytest

import gtao
from gtao.kernels.table_axes import AXES


def test_the_same_bits_twice_and_sizes_of_every_axis():
    first, second = (gtao.tables.bake("brdf-4d", (3, 4, 2, 5)) for _ in range(2))
    assert first.values.tobytes() == second.values.tobytes()
    assert first.values.shape == (5, 2, 4, 3, 2)
    assert first.size == (3, 4, 2, 5)
    assert first.settings["quadrature_error"] < 1e-5


@pytest.mark.parametrize("key", sorted(AXES))
def test_ratios_are_between_0_and_1(key):
    values = gtao.tables.bake(key[0], 5, key[1]).values
    # Rounding below 0 of what cancels.
    assert values.min() > -1e-9
    assert values.max() < 1 + 1e-6


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
