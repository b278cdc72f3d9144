"""The points: uniform, stratified within a batch, independent between batches, pixels and bounces."""

import numpy as np
import pytest
from scipy import stats

from gtao import ConfigError
from gtao.render import sampling

import drjit as dr  # isort: skip
import mitsuba as mi  # isort: skip

FALSE_ALARM = 1e-4


def points(n_points, n_pixels=1, batch=0, bounce=0, seed=0):
    """(n_pixels, n_points, 2)."""
    lane = dr.arange(mi.UInt32, n_points * n_pixels)
    pixel = lane // n_points
    stream = sampling.stream_key(dr.opaque(mi.UInt32, sampling.batch_key(seed, batch)), pixel)
    p = sampling.point(stream, mi.UInt32(bounce), lane - pixel * n_points)
    return p.numpy().T.reshape(n_pixels, n_points, 2).astype(np.float64)


@pytest.mark.parametrize("bounce", [0, 1, 7])
@pytest.mark.parametrize("m", [3, 5])
def test_every_elementary_interval_holds_one_point(m, bounce):
    n = 1 << m
    for pixel in points(n, n_pixels=20, bounce=bounce):
        for split in range(m + 1):
            cells = np.floor(pixel * [1 << split, 1 << (m - split)]).astype(int)
            assert len({tuple(c) for c in cells}) == n


def test_any_aligned_block_of_a_longer_run_is_stratified_too():
    for pixel in points(64, n_pixels=5):
        for block in pixel.reshape(8, 8, 2):
            assert len(set(np.floor(block[:, 0] * 8))) == len(set(np.floor(block[:, 1] * 8))) == 8


def test_places_within_the_strata_are_random():
    n, n_pixels = 32, 500
    place = (points(n, n_pixels) * n) % 1
    # Variance of a uniform number, 1/12; its estimates from so many numbers spread by sqrt(1/180 / count).
    tolerance = 6 * np.sqrt(1 / 180 / (n * n_pixels))
    np.testing.assert_allclose(place.var(1, ddof=1).mean(0), 1 / 12, atol=tolerance)


def test_one_point_is_uniform_over_pixels_and_over_batches():
    over_pixels = points(1, n_pixels=4096)[:, 0]
    over_batches = np.concatenate([points(1, n_pixels=16, batch=b)[:, 0] for b in range(256)])
    for sample in (over_pixels, over_batches):
        assert sample.min() >= 0
        assert sample.max() < 1
        for axis in (0, 1):
            assert stats.kstest(sample[:, axis], "uniform").pvalue > FALSE_ALARM
        counts = np.histogram2d(*sample.T, bins=8, range=[[0, 1], [0, 1]])[0]
        assert stats.chisquare(counts.ravel()).pvalue > FALSE_ALARM


#: How two streams differ: arguments of each, and how many pixels the second is shifted by.
PAIRS = {
    "neighbouring pixels": ({}, {}, 1),
    "pixels one row apart": ({}, {}, 64),
    "batches": ({}, {"batch": 1}, 0),
    "bounces": ({}, {"bounce": 1}, 0),
    "next bounce and pixel": ({}, {"bounce": 1}, 1),
    "next bounce of the pixel before": ({"bounce": 1}, {}, 1),
    "seeds": ({}, {"seed": 1}, 0),
    "high bits of the seed": ({"seed": 5}, {"seed": 5 + (1 << 40)}, 0),
    "seed and batch exchanged": ({"seed": 1, "batch": 2}, {"seed": 2, "batch": 1}, 0),
}


@pytest.mark.parametrize(("first", "second", "shift"), PAIRS.values(), ids=PAIRS.keys())
def test_streams_are_uncorrelated(first, second, shift):
    n = 4096
    a, b = points(4, n, **first)[: n - shift], points(4, n, **second)[shift:]
    r = np.corrcoef(a.reshape(len(a), -1).T, b.reshape(len(b), -1).T)[:8, 8:]
    limit = stats.norm.ppf(1 - FALSE_ALARM / 2 / r.size)
    assert np.abs(r).max() * np.sqrt(len(a)) < limit


def test_points_of_two_bounces_are_paired_at_random():
    """In the order of the sequence, the halves that the points of two bounces fall into would always agree or never."""
    n, n_pixels = 32, 2000
    first, second = (points(n, n_pixels, bounce=b)[..., 0] < 0.5 for b in (0, 1))
    agreement = (first == second).mean(1)
    # Of two consecutive points one lies in either half, and which comes first is a coin flip for each bounce: the
    # pairs agree or not by n/2 coin flips. Six standard errors of a variance.
    assert agreement.var() == pytest.approx(1 / (2 * n), rel=6 * np.sqrt(2 / n_pixels))


def test_smooth_integrals_converge_faster_than_with_random_points():
    """An indicator of a tilted half plane: the spread over pixels falls well below the binomial one."""
    p = points(64, n_pixels=2000)
    inside = (0.7 * p[..., 0] + 0.4 * p[..., 1] < 0.5).mean(1)
    truth = _area_below(0.7, 0.4, 0.5)
    standard_error = inside.std() / np.sqrt(len(inside))
    assert abs(inside.mean() - truth) < stats.norm.ppf(1 - FALSE_ALARM / 2) * standard_error
    binomial = truth * (1 - truth) / 64
    # One boundary crosses 8 of 64 cells of a stratified pattern, which leaves about an eighth of the variance.
    assert inside.var() < binomial / 4


def _area_below(a, b, c):
    """Area of the unit square where a x + b y < c, for a > c and c > b: a trapezium."""
    return (c / a + (c - b) / a) / 2


@pytest.mark.parametrize(
    ("spp", "n_batches", "seed", "message"),
    [
        (0, 8, 0, "spp must be an integer of at least 1, got 0"),
        (2.5, 8, 0, "spp must be an integer"),
        (8, 1, 0, "n_batches must be an integer of at least 2, got 1"),
        (10, 4, 0, r"spp must be a multiple of n_batches \(4\), got 10"),
        (8, 8, -1, "seed must be an integer of at least 0, got -1"),
        (True, 8, 0, "spp must be an integer"),
    ],
)
def test_bad_counts(spp, n_batches, seed, message):
    with pytest.raises(ConfigError, match=message):
        sampling.check_sampling(spp, n_batches, seed)
