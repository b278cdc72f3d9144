"""Statistics helpers: calibrated under the null hypothesis, alert off it."""

import math

import numpy as np
import pytest
from scipy import stats

from gtao import evaluate
from gtao.errors import ConfigError, ShapeError

#: Chance that a calibration test below fails although the helper is right; seeds are fixed, so it was paid once.
ALARM = 1e-3
N = 20000


def batch_means(generator, batches, scale=1.0):
    """Means and estimated variances of the mean of N cells with true mean 0."""
    x = scale * generator.standard_normal((batches, N))
    return x.mean(axis=0), x.var(axis=0, ddof=1) / batches


def uniform_p(p):
    return stats.kstest(p, "uniform").pvalue


def test_z_values_by_hand():
    test = evaluate.z_test([2.0, -1.0], [1.0, 0.25], 0.0, [3.0, 0.0])
    assert test.z == pytest.approx([1.0, -2.0])
    assert test.p_value == pytest.approx([2 * stats.norm.sf(1), 2 * stats.norm.sf(2)])


def test_known_variance_is_calibrated():
    x = np.random.default_rng(1).normal(3.0, 2.0, N)
    assert uniform_p(evaluate.z_test(x, 4.0, 3.0).p_value) > ALARM


def test_estimated_variance_is_calibrated_only_with_its_degrees_of_freedom():
    mean, variance = batch_means(np.random.default_rng(2), 8)
    assert uniform_p(evaluate.z_test(mean, variance, 0.0, dof=7).p_value) > ALARM
    assert uniform_p(evaluate.z_test(mean, variance, 0.0).p_value) < ALARM


def test_two_noisy_sides_are_calibrated():
    # Equal true variances of the means: Welch's approximation is then exact Student.
    generator = np.random.default_rng(3)
    a, va = batch_means(generator, 8)
    b, vb = batch_means(generator, 8)
    assert uniform_p(evaluate.z_test(a, va, b, vb, dof=7, reference_dof=7).p_value) > ALARM


def test_a_shift_is_seen():
    x = np.random.default_rng(4).normal(0.5, 1.0, N)
    assert uniform_p(evaluate.z_test(x, 1.0, 0.0).p_value) < ALARM


def test_without_noise_equality_decides():
    test = evaluate.z_test([1.0, 2.0], 0.0, 1.0)
    assert test.p_value.tolist() == [1.0, 0.0]
    assert test.z.tolist() == [0.0, math.inf]


def test_sidak():
    assert evaluate.sidak(0.05, 1) == pytest.approx(0.05)
    assert evaluate.sidak(0.05, 3) == pytest.approx(1 - 0.95 ** (1 / 3))
    # Where the power would round to 1.
    assert evaluate.sidak(1e-12, 10**6) == pytest.approx(1e-18, rel=1e-6)


def test_image_test_alarms_at_its_significance():
    generator = np.random.default_rng(5)
    significance, images = 0.1, 1000
    failed = sum(
        not evaluate.z_test_image(generator.standard_normal((10, 20)), np.ones((10, 20)), 0.0, significance=0.1).ok
        for _ in range(images)
    )
    # Four standard deviations of the binomial count.
    assert abs(failed - images * significance) < 4 * math.sqrt(images * significance * (1 - significance))


def test_image_test_finds_the_wrong_pixel_and_honours_the_mask():
    image = np.zeros((4, 5))
    image[2, 3] = 8.0
    test = evaluate.z_test_image(image, np.ones((4, 5)), np.zeros((4, 5)))
    assert np.argwhere(~test.passed).tolist() == [[2, 3]]
    assert (test.n_tests, test.n_failed, test.ok) == (20, 1, False)
    assert test.threshold == pytest.approx(evaluate.sidak(0.01, 20))
    image[2, 3] = np.nan
    mask = np.isfinite(image)
    test = evaluate.z_test_image(image, np.ones((4, 5)), np.zeros((4, 5)), mask=mask)
    assert test.ok
    assert test.n_tests == 19
    assert test.p_value[2, 3] == 1


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: evaluate.z_test(np.nan, 1, 0), ShapeError, "finite"),
        (lambda: evaluate.z_test(0, -1, 0), ShapeError, "negative"),
        (lambda: evaluate.z_test([1, 2], [1, 2, 3], 0), ShapeError, "combined"),
        (lambda: evaluate.z_test(0, 1, 0, dof=0), ConfigError, "degrees of freedom"),
        (lambda: evaluate.sidak(0, 3), ConfigError, "significance"),
        (lambda: evaluate.sidak(0.1, 0), ConfigError, "n_tests"),
        (lambda: evaluate.z_test_image(np.zeros((2, 2)), np.ones((2, 3)), 0), ShapeError, r"shape \(2, 2\)"),
        (lambda: evaluate.z_test_image(np.zeros(2), np.ones(2), 0, mask=[0, 0]), ShapeError, "no pixel"),
        (lambda: evaluate.bootstrap_counts(1, 10), ConfigError, "at least 2 clusters"),
        (lambda: evaluate.bootstrap_counts(3, 10, strata=[0, 0, 1]), ConfigError, "at least 2 clusters"),
        (lambda: evaluate.bootstrap_counts(3, 10, strata=[0, 0]), ConfigError, "strata"),
        (lambda: evaluate.bootstrap_counts(3, 0), ConfigError, "at least 1 draw"),
        (lambda: evaluate.bootstrap_interval(np.zeros(3), 3, 1.0), ConfigError, "level"),
        (lambda: evaluate.bootstrap_interval(np.zeros(3), 1), ConfigError, "at least 2 clusters"),
    ],
)
def test_refusals(call, error, message):
    with pytest.raises(error, match=message):
        call()


def test_bootstrap_counts_resample_within_strata():
    strata = np.array([0, 1, 0, 1, 1])
    counts = evaluate.bootstrap_counts(5, 500, 7, strata=strata)
    assert np.all(counts[:, strata == 0].sum(axis=1) == 2)
    assert np.all(counts[:, strata == 1].sum(axis=1) == 3)
    assert counts.mean(axis=0) == pytest.approx(np.ones(5), abs=4 * 0.9 / math.sqrt(500))
    assert np.array_equal(counts, evaluate.bootstrap_counts(5, 500, 7, strata=strata))
    assert not np.array_equal(counts, evaluate.bootstrap_counts(5, 500, 8, strata=strata))


def test_bootstrap_standard_error_of_a_mean():
    values = np.random.default_rng(6).standard_normal(10)
    draws = evaluate.bootstrap_counts(10, 20000) @ values / 10
    # Relative standard deviation of a standard deviation from 20000 draws: 1/sqrt(40000).
    known = values.std(ddof=1) / math.sqrt(10)
    assert evaluate.bootstrap_standard_error(draws, 10) == pytest.approx(known, rel=4 / 200)


def test_bootstrap_interval_covers_as_often_as_it_says():
    generator = np.random.default_rng(7)
    repeats, n, level = 1000, 12, 0.95
    hits = 0
    for seed in range(repeats):
        values = generator.standard_normal(n)
        draws = evaluate.bootstrap_counts(n, 500, seed) @ values / n
        low, high = evaluate.bootstrap_interval(draws, n, level)
        hits += low <= 0 <= high
    # Four standard deviations of the binomial share. The plain percentile interval covers 0.907 here, and fails.
    assert hits / repeats == pytest.approx(level, abs=4 * math.sqrt(level * (1 - level) / repeats))


def test_block_labels():
    # Image 5 wide, blocks of 2: three blocks across, the last one narrow.
    assert evaluate.block_labels(np.arange(15), 5, 2).tolist() == [0, 0, 1, 1, 2, 0, 0, 1, 1, 2, 3, 3, 4, 4, 5]
    assert evaluate.block_labels([4, 14], 5, 2).tolist() == [0, 1]
