"""The reciprocal square root of kernels."""

import numpy as np
import pytest

import drjit as dr  # isort: skip

from gtao.kernels.roots import rsqrt


def test_rsqrt_over_the_range_of_squared_lengths(precision):
    x = np.logspace(-24, 24, 97)
    lanes = precision.lanes(x)
    want = 1 / np.sqrt(np.array(lanes, dtype=np.float64))
    assert np.array(rsqrt(lanes)) == pytest.approx(want, rel=4 * float(np.finfo(precision.name).eps))


def test_rsqrt_of_nothing_and_of_infinity(precision):
    """An offset of no length times it is NaN, one of infinite length has no direction: both compare false."""
    assert list(np.array(rsqrt(precision.lanes([0.0, np.inf])))) == [np.inf, 0.0]


def test_derivative_of_rsqrt(precision):
    x = precision.lanes([0.04, 1.0, 25.0])
    dr.enable_grad(x)
    dr.backward(rsqrt(x))
    want = -0.5 * np.array(dr.detach(x), dtype=np.float64) ** -1.5
    assert np.array(dr.grad(x)) == pytest.approx(want, rel=8 * float(np.finfo(precision.name).eps))
