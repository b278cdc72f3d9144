"""Strata of the hemisphere: equal shares, and the means of what is summed over them, against dense grids."""

import numpy as np
import pytest
from oracles import closed_forms, harmonics, slice_oracle

from gtao.kernels.open_directions import Sums
from gtao.kernels.strata import Strata

GRIDS = [(1, 1), (2, 3), (12, 16)]
WEIGHTINGS = ["cosine", "uniform"]


def numbers(arrays):
    return np.stack([np.array(a, dtype=np.float64) for a in arrays])


def all_of(precision, grid):
    """Every stratum's azimuth and elevation, as lanes."""
    azimuth, elevation = (a.ravel() for a in np.meshgrid(*map(np.arange, grid), indexing="ij"))
    return precision.lanes(azimuth), precision.lanes(elevation)


@pytest.mark.parametrize("weighting", WEIGHTINGS)
@pytest.mark.parametrize("grid", GRIDS)
def test_means_are_those_of_the_directions(precision, grid, weighting):
    """The midpoint rule with n² places in a stratum. In a stratum that ends where "out" or "up" begins like a root, its
    error is 0.2 n^-1.5, else of second order."""
    strata, n = Strata(*grid, weighting == "cosine"), 64
    got = numbers(strata.mean(*all_of(precision, grid)))
    middles = (np.arange(n) + 0.5) / n
    each = np.meshgrid(*map(np.arange, grid), middles, middles, indexing="ij")
    azimuth, elevation, u, v = (precision.lanes(a.ravel()) for a in each)
    directions = numbers(Sums.of(*strata.direction(azimuth, elevation, u, v)))
    want = directions.reshape(8, -1, n * n).mean(axis=-1)
    assert got == pytest.approx(want, abs=0.2 * n**-1.5)


@pytest.mark.parametrize("weighting", WEIGHTINGS)
@pytest.mark.parametrize("grid", GRIDS)
def test_all_strata_are_the_hemisphere(precision, grid, weighting):
    strata = Strata(*grid, weighting == "cosine")
    x, y, z, xy, yz, zz, xz, xx_yy = numbers(strata.mean(*all_of(precision, grid))).mean(axis=1)
    first, second = closed_forms.cone([0, 0, 1], 0.0, weighting)
    assert [x, y, z] == pytest.approx(first, abs=precision.tolerance)
    want = [second[0, 1], second[1, 2], second[2, 2], second[0, 2], second[0, 0] - second[1, 1]]
    assert [xy, yz, zz, xz, xx_yy] == pytest.approx(want, abs=precision.tolerance)


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_directions_are_unit_vectors_of_their_stratum(precision, weighting):
    strata = Strata(8, 4, weighting == "cosine")
    last = 1 - 2**-24
    for u, v in ((0.0, 0.0), (0.3, 0.8), (last, last)):
        x, y, z = numbers(strata.direction(*all_of(precision, (8, 4)), precision.Float(u), precision.Float(v)))
        assert x * x + y * y + z * z == pytest.approx(1, abs=1e-6)
        assert (z >= 0).all()
        share = 1 - z**2 if weighting == "cosine" else 1 - z
        elevation = np.tile(np.arange(4), 8)
        assert share == pytest.approx((elevation + u) / 4, abs=1e-6)
        turn = np.arctan2(y, x) / (2 * np.pi) * 8 - np.repeat(np.arange(8), 4) - v
        away = np.hypot(x, y) > 1e-3
        assert (turn - np.round(turn / 8) * 8)[away] == pytest.approx(0, abs=1e-4)


def test_sums_turn_into_harmonics_of_the_view_frame(precision):
    """In any frame of axes, and with directions that count as 0."""
    rng = np.random.default_rng(4)
    for _ in range(5):
        frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        local = slice_oracle.unit(rng.normal(size=(40, 3)))
        is_open = rng.random(40) < 0.6
        means = numbers(Sums.of(*map(precision.lanes, local.T)))[:, is_open].sum(axis=1) / 40
        got = Sums(*map(precision.Float, means)).in_view(
            precision.Float(is_open.mean()), [list(map(precision.Float, axis)) for axis in frame.tolist()]
        )
        world = local @ frame * is_open[:, None]
        want = [*world.mean(axis=0), *(harmonics.basis(local @ frame) * is_open[:, None]).mean(axis=0)[4:]]
        assert numbers(got)[:, 0] == pytest.approx(np.array(want), abs=precision.tolerance)
