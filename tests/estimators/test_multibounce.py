"""Multi-bounce visibility of images, against the formulas written out in NumPy."""

import drjit as dr
import numpy as np
import pytest

import gtao
from gtao.data import FORM_PARAMETERS

RNG = np.random.default_rng(5)
VISIBILITY = RNG.random((6, 7)).astype(np.float32)
ALBEDO = RNG.random((6, 7, 3)).astype(np.float32)
# float32 arithmetic on polynomials with coefficients up to 5: a few ulp of the largest term.
TOLERANCE = 3e-6


def published(v, rho):
    a = 2.0404 * rho - 0.3324
    b = -4.7951 * rho + 0.6417
    c = 2.7552 * rho + 0.6903
    return np.minimum(np.maximum(v, ((v * a + b) * v + c) * v), 1)


def test_published_set_per_channel():
    result = gtao.multibounce(VISIBILITY, ALBEDO).numpy()
    expected = published(VISIBILITY[..., None].astype(float), ALBEDO.astype(float))
    assert result.shape == (6, 7, 3)
    assert np.max(np.abs(result - expected)) < TOLERANCE


def test_grey_albedo_and_a_single_number():
    grey = gtao.multibounce(VISIBILITY, ALBEDO[..., 0]).numpy()
    assert np.max(np.abs(grey - published(VISIBILITY.astype(float), ALBEDO[..., 0].astype(float)))) < TOLERANCE
    number = gtao.multibounce(VISIBILITY, 0.5).numpy()
    assert np.max(np.abs(number - published(VISIBILITY.astype(float), 0.5))) < TOLERANCE


def test_an_estimate_above_one_counts_as_open():
    assert gtao.multibounce(np.float32([[1.2]]), 0.9).numpy() == pytest.approx(1.0)


def test_the_result_never_exceeds_one():
    assert gtao.multibounce(np.ones((2, 2), np.float32), 1.0).numpy().max() <= 1


def test_it_takes_the_estimate_as_it_is():
    g = gtao.GBuffer(np.full((6, 7), 2.0, np.float32), None, gtao.PerspectiveCamera(7, 6, 1.0))
    ao = gtao.ambient_occlusion(g)
    assert gtao.multibounce(ao.visibility, ALBEDO).numpy().shape == (6, 7, 3)


def test_the_albedo_has_a_gradient():
    rho = dr.tensor_t(gtao.backend.default_float())(ALBEDO)
    dr.enable_grad(rho)
    dr.backward(dr.sum(gtao.multibounce(VISIBILITY, rho, gtao.SPHERE), axis=None))
    v, a = VISIBILITY[..., None].astype(float), ALBEDO.astype(float)
    expected = v * (1 - v) / (1 - a * (1 - v)) ** 2
    assert np.max(np.abs(dr.grad(rho).numpy() - expected)) < 1e-4 * expected.max()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((VISIBILITY, ALBEDO[:3]), "shape"),
        ((VISIBILITY, ALBEDO * 2), r"albedo must be in \[0, 1\]"),
        ((VISIBILITY, -0.1), "albedo"),
        ((VISIBILITY * np.nan, 0.5), "visibility"),
        ((VISIBILITY - 1, 0.5), "visibility"),
        (("grey", 0.5), "visibility must be an array"),
    ],
)
def test_bad_input(arguments, message):
    with pytest.raises(gtao.ShapeError, match=message):
        gtao.multibounce(*arguments)


def test_a_fit_is_checked_when_it_is_made():
    with pytest.raises(gtao.ConfigError, match="unknown form"):
        gtao.MultibounceFit(form="quintic", coefficients=(), bounces=4, source="")
    with pytest.raises(gtao.ConfigError, match="6 coefficients, got 2"):
        gtao.MultibounceFit(form="linear_cubic", coefficients=(1.0, 2.0), bounces=4, source="")
    with pytest.raises(gtao.ConfigError, match="fit must be"):
        gtao.multibounce(VISIBILITY, 0.5, fit=(1, 2, 3))


def test_every_form_is_known_to_the_kernels():
    from gtao.kernels.multibounce import FORMS

    assert set(FORMS) == set(FORM_PARAMETERS)


def test_an_array_may_change_before_the_result_is_looked_at():
    visibility, albedo = np.full((4, 5), 0.5, np.float32), np.full((4, 5, 3), 0.8, np.float32)
    expected = gtao.multibounce(visibility.copy(), albedo.copy()).numpy()
    result = gtao.multibounce(visibility, albedo)
    visibility[:], albedo[:] = 0.1, 0.2
    assert np.array_equal(result.numpy(), expected)
