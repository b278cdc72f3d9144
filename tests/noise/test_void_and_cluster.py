"""Masks by void and cluster: the plain algorithm step by step, the file in the package, what makes them blue."""

import numpy as np
import pytest
from oracles import void_and_cluster as oracle

import gtao
from gtao import noise
from gtao.data.blue_noise import MASK_FILE, mask_values


@pytest.mark.parametrize(("size", "seed", "sigma"), [(8, 0, 1.5), (10, 3, 1.9), (9, 1, 1.2)])
def test_ranks_are_those_of_the_plain_algorithm(size, seed, sigma):
    """Densities of Gaussians in integers of 2^-40 order pixels as floating-point sums do, ties by position."""
    first = np.zeros(size * size, dtype=bool)
    first[np.random.default_rng(seed).permutation(size * size)[: round(size * size / 10)]] = True
    want = oracle.ranks(first.reshape(size, size), sigma)
    assert np.array_equal(noise.void_and_cluster(size, seed, sigma), want)


def test_the_mask_in_the_package_is_made_by_its_generator():
    made = noise.blue_noise_mask()
    assert np.array_equal(np.load(MASK_FILE), made)
    assert np.array_equal(np.reshape(mask_values(), (64, 64, 2)), made)
    assert made.dtype == np.dtype("<u2")


def test_a_mask_holds_every_level_once():
    mask = noise.blue_noise_mask(16, seed=4)
    for channel in range(2):
        # Middles of 256 equal parts of 2^16.
        assert np.array_equal(np.sort(mask[..., channel], axis=None), 256 * np.arange(256) + 128)
    assert not np.array_equal(mask[..., 0], mask[..., 1])


def test_low_frequencies_are_missing():
    """Below a quarter of the sampling frequency there is less than a twentieth of what uncorrelated values have there:
    what a filter of four pixels keeps. And nothing prefers a direction: sectors of 45 degrees differ by sampling."""
    mask = np.load(MASK_FILE) / 65536
    for channel in range(2):
        found = noise.spectrum(mask[..., channel])
        low = found.frequency < 0.25
        assert found.radial[low].max() < 0.05
        assert found.radial[found.frequency > 0.4].mean() > 1.2
        y, x = np.mgrid[-32:32, -32:32]
        middle = (np.hypot(x, y) > 16) & (np.hypot(x, y) < 32)
        sector = np.floor(np.mod(np.arctan2(y, x), np.pi) / (np.pi / 4)).astype(int)
        means = np.array([found.power[middle & (sector == k)].mean() for k in range(4)])
        # 300 frequencies of exponential distribution per sector, each twice: 8 % standard deviation.
        assert np.abs(means / means.mean() - 1).max() < 4 * 0.08


@pytest.mark.parametrize("share", [0.1, 0.25, 0.5, 0.8])
def test_thresholds_are_spread_evenly(share):
    """Counts in windows of 16 × 16 pixels of those below a threshold vary less than a tenth as much as random ones."""
    mask = np.load(MASK_FILE)[..., 0] < share * 65536
    counts = mask.reshape(4, 16, 4, 16).sum(axis=(1, 3))
    assert counts.var() < 0.1 * 256 * share * (1 - share)


def test_what_is_asked_for_must_make_sense():
    with pytest.raises(gtao.ConfigError, match="size must be 2 to 256"):
        noise.void_and_cluster(1)
    with pytest.raises(gtao.ConfigError, match="sigma must be a positive number"):
        noise.void_and_cluster(8, sigma=float("nan"))
    with pytest.raises(gtao.ConfigError, match="power of two"):
        noise.blue_noise_mask(48)
