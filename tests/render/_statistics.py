"""Tests that two unbiased estimates agree, with thresholds that follow from their own batches."""

import numpy as np
from scipy import stats

#: Chance that one comparison fails although both sides are right. Seeds are fixed, so a pass is a pass for ever.
FALSE_ALARM = 1e-4


def standard_error(batches):
    """Of the mean over the first axis."""
    return batches.std(0, ddof=1) / np.sqrt(len(batches))


def assert_mean_is(batches, expected, allowance=0.0):
    """The mean of independent numbers is ``expected`` up to Student's t, plus a known error of the expectation."""
    excess = max(0.0, abs(batches.mean() - expected) - allowance)
    spread = standard_error(batches)
    t = 0.0 if excess == 0 else np.inf if spread == 0 else excess / spread
    limit = stats.t.ppf(1 - FALSE_ALARM / 2, len(batches) - 1)
    assert t < limit, f"mean {batches.mean():.6f}, expected {expected:.6f}: t = {t:.1f}, limit {limit:.1f}"


def assert_same_mean(a, b):
    """Welch's test on two sets of independent numbers."""
    t, p = stats.ttest_ind(a, b, equal_var=False)
    assert p > FALSE_ALARM, f"means {a.mean():.6f} and {b.mean():.6f}: t = {t:.1f}"


def assert_no_excess(difference, variance):
    """Squared differences of pixels are, on average, their variances: a bias anywhere would add to them.

    ``variance`` must be unbiased; the comparison needs neither normality nor many degrees of freedom.
    """
    excess = (difference**2 - variance).ravel()
    z = excess.mean() / (excess.std(ddof=1) / np.sqrt(excess.size))
    limit = stats.norm.ppf(1 - FALSE_ALARM / 2)
    assert abs(z) < limit, f"squared differences are off their variances by z = {z:.1f}, limit {limit:.1f}"
