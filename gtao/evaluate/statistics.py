"""Is the difference chance? z-tests of means, and tests of images with Šidák correction.

References:
    Z. Šidák, "Rectangular confidence regions for the means of multivariate normal distributions", JASA 1967.
    B. L. Welch, "The generalization of Student's problem when several different population variances are
    involved", Biometrika 1947.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from gtao.errors import ConfigError, ShapeError

__all__ = [
    "ImageTest",
    "TestResult",
    "sidak",
    "z_test",
    "z_test_image",
]


class TestResult(NamedTuple):
    """Statistic and two-sided p-value, each of the shape of the input."""

    z: np.ndarray
    p_value: np.ndarray


@dataclass(frozen=True)
class ImageTest:
    """Outcome of one test per pixel.

    Attributes:
        p_value: Two-sided p-value per pixel, in [0, 1]; 1 outside the mask.
        passed: Per pixel, whether its p-value is at or above ``threshold``.
        n_tests: Number of pixels tested.
        threshold: Significance of one pixel, after the Šidák correction.
        significance: Chance that at least one of the tested pixels fails although nothing differs.
    """

    p_value: np.ndarray
    passed: np.ndarray
    n_tests: int
    threshold: float
    significance: float

    @property
    def n_failed(self) -> int:
        """Number of pixels that fail."""
        return int((~self.passed).sum())

    @property
    def ok(self) -> bool:
        """True if no pixel fails."""
        return self.n_failed == 0


# Neither name is a test case, whatever pytest may think of it.
TestResult.__test__ = False  # pyright: ignore[reportAttributeAccessIssue]  (pytest looks for it)


def z_test(
    mean: ArrayLike,
    variance: ArrayLike,
    reference: ArrayLike,
    reference_variance: ArrayLike = 0.0,
    *,
    dof: float = np.inf,
    reference_dof: float = np.inf,
) -> TestResult:
    """Two-sided test that two means estimate the same number, elementwise.

    With infinitely many degrees of freedom this is the z-test. Variances estimated from B batches have B - 1
    degrees of freedom: then the statistic follows Student's distribution, with Welch's degrees of freedom
    where both sides have noise, and only so are the p-values uniform under the null hypothesis.

    Args:
        mean: Estimated means.
        variance: Variances *of the means* (not of single samples), broadcastable to the means, not negative.
        reference: Means to test against, same shape or broadcastable.
        reference_variance: Variances of these; 0 for a known truth.
        dof: Degrees of freedom of ``variance``.
        reference_dof: Degrees of freedom of ``reference_variance``.

    Returns:
        The statistics and p-values. Where both variances are 0 the p-value is 1 for equal means and 0
        otherwise.

    Raises:
        ConfigError: Degrees of freedom below 1.
        ShapeError: The shapes cannot be broadcast, a value is not finite, or a variance is negative.
    """
    if not (dof >= 1 and reference_dof >= 1):
        raise ConfigError(f"degrees of freedom must be at least 1, got {dof} and {reference_dof}; use batches - 1")
    try:
        a, va, b, vb = np.broadcast_arrays(
            *(np.asarray(x, dtype=np.float64) for x in (mean, variance, reference, reference_variance))
        )
    except ValueError as error:
        raise ShapeError(f"means and variances cannot be combined: {error}") from error
    if not all(np.all(np.isfinite(x)) for x in (a, va, b, vb)):
        raise ShapeError("means and variances must be finite; leave out broken pixels before the test")
    if np.any(va < 0) or np.any(vb < 0):
        raise ShapeError("a variance is negative; give the variance of the mean")
    total = va + vb
    certain = total == 0
    safe = np.where(certain, 1.0, total)
    z = np.where(certain, np.where(a == b, 0.0, np.copysign(np.inf, a - b)), (a - b) / np.sqrt(safe))
    # Welch-Satterthwaite; infinite where only a variance that is known exactly contributes.
    spread = va**2 / dof + vb**2 / reference_dof
    nu = np.where(spread > 0, safe**2 / np.where(spread > 0, spread, 1.0), np.inf)
    p = np.where(np.isinf(nu), 2 * stats.norm.sf(np.abs(z)), 2 * stats.t.sf(np.abs(z), np.minimum(nu, 1e9)))
    return TestResult(z, np.where(certain, np.where(a == b, 1.0, 0.0), p))


def sidak(significance: float, n_tests: int) -> float:
    """Significance of each of n independent tests so that all of them together have the given one.

    Args:
        significance: Chance of any false alarm, in (0, 1).
        n_tests: Number of tests, at least 1.

    Returns:
        1 - (1 - significance)^(1/n), computed without cancellation.

    Raises:
        ConfigError: A value is outside its range.
    """
    if not 0 < significance < 1:
        raise ConfigError(f"significance must lie in (0, 1), got {significance}")
    if n_tests < 1:
        raise ConfigError(f"n_tests must be at least 1, got {n_tests}")
    return float(-np.expm1(np.log1p(-significance) / n_tests))


def z_test_image(
    mean: ArrayLike,
    variance: ArrayLike,
    reference: ArrayLike,
    reference_variance: ArrayLike = 0.0,
    *,
    mask: ArrayLike | None = None,
    significance: float = 0.01,
    dof: float = np.inf,
    reference_dof: float = np.inf,
) -> ImageTest:
    """:func:`z_test` of every pixel, with the Šidák correction for their number.

    Args:
        mean: Estimated image, any shape.
        variance: Variance of the mean, per pixel.
        reference: Image to test against.
        reference_variance: Its variance.
        mask: Pixels to test, of the image's shape; all if left out.
        significance: Chance that a correct image fails anywhere, in (0, 1).
        dof: As in :func:`z_test`.
        reference_dof: As in :func:`z_test`.

    Returns:
        p-values and verdicts.

    Raises:
        ConfigError: As in :func:`z_test` and :func:`sidak`.
        ShapeError: As in :func:`z_test`, or no pixel is left.
    """
    parts = [np.asarray(x, dtype=np.float64) for x in (mean, variance, reference, reference_variance)]
    shape = parts[0].shape
    keep = np.ones(shape, bool) if mask is None else np.asarray(mask).astype(bool)
    if keep.shape != shape or any(x.ndim and x.shape != shape for x in parts):
        raise ShapeError(f"images, variances and mask must all have the shape {shape} of the mean")
    n_tests = int(keep.sum())
    if n_tests == 0:
        raise ShapeError(f"no pixel of {shape} is left to test; check the mask")
    inside = [x[keep] if x.ndim else x for x in parts]
    p = np.ones(shape)
    p[keep] = z_test(*inside, dof=dof, reference_dof=reference_dof).p_value
    threshold = sidak(significance, n_tests)
    return ImageTest(p, p >= threshold, n_tests, threshold, significance)
