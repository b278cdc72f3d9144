"""The harmonics against golden values, SciPy, Dr.Jit and their own orthogonality."""

import math

import numpy as np
import pytest
from _sphere import directions, harmonics
from oracles import golden
from scipy.integrate import lebedev_rule

from gtao import lighting
from gtao.errors import ConfigError, ShapeError

#: Rounding of recurrences over up to 60 bands, whose values reach 11.
HIGH_ORDER = 1e-12


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("C.sh_basis"))
def test_golden(inputs, outputs):
    values = lighting.basis(inputs["dir"], 4)
    np.testing.assert_allclose(values, outputs["Y"], atol=golden.FLOAT64_TOLERANCE, rtol=0)


@pytest.mark.parametrize("order", [0, 1, 4, 60])
def test_scipy(order):
    poles = [[0, 0, 1], [0, 0, -1], [1, 0, 0], [1e-9, 0, 1]]
    d = np.concatenate([directions(40), np.array(poles) / np.linalg.norm(poles, axis=1)[:, None]])
    np.testing.assert_allclose(lighting.basis(d, order), harmonics(d, order), atol=HIGH_ORDER, rtol=0)


def test_orthonormal_under_a_rule_of_others():
    d, w = lebedev_rule(17)
    y = lighting.basis(d.T, 8)
    np.testing.assert_allclose(y.T @ (w[:, None] * y), np.eye(81), atol=1e-12)


def test_drjit():
    """Dr.Jit's have the Condon-Shortley phase."""
    import drjit as dr
    from drjit.scalar import Array3f64

    d = directions(1, seed=3)[0]
    theirs = np.array(dr.sh_eval(Array3f64(*d), 4))
    np.testing.assert_allclose(lighting.convert(lighting.basis(d, 4), "gtao", "drjit"), theirs, atol=1e-14)


def test_length_does_not_matter_and_shape_is_kept():
    d = directions(6, seed=1).reshape(2, 3, 3)
    scales = np.array([1e-300, 1, 1e300])[:, None]
    np.testing.assert_allclose(lighting.basis(d * scales, 3), lighting.basis(d, 3), atol=1e-14)
    assert lighting.basis(d, 3).shape == (2, 3, 16)


def test_evaluate_and_project_are_inverse():
    c = np.random.default_rng(0).normal(size=(25, 3))
    d = directions(5)
    np.testing.assert_allclose(lighting.evaluate(c, d), harmonics(d, 4) @ c, atol=1e-13)
    np.testing.assert_allclose(lighting.evaluate(c[:, 0], d), harmonics(d, 4) @ c[:, 0], atol=1e-13)
    back = lighting.project_function(lambda w: harmonics(w, 4) @ c, 4, degree=8)
    np.testing.assert_allclose(back, c, atol=1e-13)


def test_cosine_kernel():
    expected = [math.pi, 2 * math.pi / 3, math.pi / 4, 0, -math.pi / 24, 0, math.pi / 64]
    np.testing.assert_allclose(lighting.cosine_kernel(6), expected, atol=1e-15)
    assert lighting.cosine_kernel(0) == pytest.approx(math.pi)


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: lighting.basis([1, 0], 2), ShapeError, r"directions must be \(…, 3\), got shape \(2,\)"),
        (lambda: lighting.basis([[0, 0, 0], [1, 0, 0]], 2), ShapeError, "1 of them are"),
        (lambda: lighting.basis([math.nan, 0, 1], 2), ShapeError, "finite"),
        (lambda: lighting.basis([0, 0, 1], -1), ConfigError, "order must be an integer of at least 0.*-1"),
        (lambda: lighting.basis([0, 0, 1], 2.0), ConfigError, r"got 2\.0"),
        (lambda: lighting.evaluate(np.zeros(8), [0, 0, 1]), ShapeError, r"1, 4, 9, 16, 25.*got 8"),
        (lambda: lighting.evaluate(np.zeros((4, 3, 1)), [0, 0, 1]), ShapeError, r"\(n,\) or \(n, C\)"),
        (lambda: lighting.evaluate([math.inf, 0, 0, 0], [0, 0, 1]), ShapeError, "1 of 4 are not"),
        (lambda: lighting.project_function(lambda d: 1.0, 2), ShapeError, "the function must return"),
        (lambda: lighting.project_function(lambda d: d / 0.0 * 0, 2), ShapeError, "not finite"),
    ],
)
@pytest.mark.filterwarnings("ignore:divide by zero:RuntimeWarning", "ignore:invalid value:RuntimeWarning")
def test_refusals(call, error, words):
    with pytest.raises(error, match=words):
        call()
