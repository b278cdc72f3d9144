"""Polynomials through Chebyshev points."""

import math

import numpy as np
import pytest

from gtao.kernels import chebyshev


def test_a_polynomial_is_found_again():
    wanted = (0.3, -1.2, 0.0, 2.5)
    found = chebyshev.interpolated(lambda x: float(np.polyval(wanted[::-1], x)), -0.5, 2.0, 4)
    assert found == pytest.approx(wanted, abs=1e-14)


@pytest.mark.parametrize("n", [3, 5, 7])
def test_the_error_is_what_theory_allows(n):
    """On an interval of length l it is at most 2 (l/4)ⁿ max |f⁽ⁿ⁾| / n!, and not far below."""
    coefficients = chebyshev.interpolated(math.exp, 0.0, 1.0, n)
    x = np.linspace(0, 1, 1001)
    error = np.abs(np.polyval(coefficients[::-1], x) - np.exp(x)).max()
    bound = 2 * 0.25**n * math.e / math.factorial(n)
    assert 0.3 * bound < error <= bound


def test_evaluation(precision):
    coefficients, x = (0.5, -2.0, 3.0), [-1.0, 0.0, 0.25, 2.0]
    assert np.array(chebyshev.evaluate(coefficients, precision.lanes(x))) == pytest.approx(
        np.polyval(coefficients[::-1], x), abs=precision.tolerance
    )
