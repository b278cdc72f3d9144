"""Image metrics against numbers worked out by hand, and their refusals."""

import math

import numpy as np
import pytest

from gtao import evaluate
from gtao.errors import ConfigError, GtaoError, ShapeError

IMAGE = np.array([[1.0, 2.0], [3.0, 5.0]])
REFERENCE = np.array([[1.0, 1.0], [1.0, 1.0]])
# Errors 0, 1, 2, 4.
WEIGHTS = np.array([[1.0, 0.0], [1.0, 2.0]])


def test_values_by_hand():
    assert evaluate.mse(IMAGE, REFERENCE) == pytest.approx(21 / 4)
    assert evaluate.rmse(IMAGE, REFERENCE) == pytest.approx(math.sqrt(21 / 4))
    assert evaluate.mae(REFERENCE, IMAGE) == pytest.approx(7 / 4)
    assert evaluate.bias(IMAGE, REFERENCE) == pytest.approx(7 / 4)
    assert evaluate.bias(REFERENCE, IMAGE) == pytest.approx(-7 / 4)
    assert evaluate.psnr(IMAGE, REFERENCE, peak=5.0) == pytest.approx(10 * math.log10(25 / (21 / 4)))


def test_weights():
    assert evaluate.mse(IMAGE, REFERENCE, weights=WEIGHTS) == pytest.approx((0 + 4 + 2 * 16) / 4)
    assert evaluate.mae(IMAGE, REFERENCE, weights=WEIGHTS) == pytest.approx((0 + 2 + 2 * 4) / 4)
    assert evaluate.bias(IMAGE, REFERENCE, weights=3 * WEIGHTS) == pytest.approx((0 + 2 + 2 * 4) / 4)


def test_mask_and_weights_multiply():
    mask = np.array([[True, True], [False, True]])
    assert evaluate.mse(IMAGE, REFERENCE, mask=mask, weights=WEIGHTS) == pytest.approx((0 + 2 * 16) / 3)


def test_a_mask_serves_all_channels():
    colour = np.stack([IMAGE, IMAGE + 1, IMAGE + 2], axis=-1)
    mask = np.array([[False, True], [False, False]])
    assert evaluate.bias(colour, np.ones_like(colour), mask=mask) == pytest.approx((1 + 2 + 3) / 3)


@pytest.mark.parametrize("broken", [np.nan, np.inf])
def test_what_is_masked_may_be_broken(broken):
    image = IMAGE.copy()
    image[1, 1] = broken
    mask = np.array([[True, True], [True, False]])
    assert evaluate.mse(image, REFERENCE, mask=mask) == pytest.approx(5 / 3)
    assert evaluate.mse(image, REFERENCE, weights=mask.astype(float)) == pytest.approx(5 / 3)
    with pytest.raises(ShapeError, match=r"1 of 4 compared values are NaN or infinite.*mask="):
        evaluate.rmse(image, REFERENCE)


def test_equal_images():
    assert evaluate.rmse(IMAGE, IMAGE) == 0
    assert evaluate.psnr(IMAGE, IMAGE) == math.inf


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"reference": REFERENCE[:1]}, r"shape \(2, 2\) and reference \(1, 2\)"),
        ({"mask": np.zeros((2, 2), bool)}, "no pixel"),
        ({"mask": np.ones((3, 2), bool)}, r"mask has shape \(3, 2\)"),
        ({"weights": -WEIGHTS}, "not negative"),
        ({"weights": np.full((2, 2), np.nan)}, "finite"),
    ],
)
def test_refusals(kwargs, message):
    arguments = {"image": IMAGE, "reference": REFERENCE} | kwargs
    with pytest.raises(ShapeError, match=message) as caught:
        evaluate.mae(**arguments)
    assert isinstance(caught.value, GtaoError)


@pytest.mark.parametrize("peak", [0, -1, math.nan])
def test_peak_must_be_positive(peak):
    with pytest.raises(ConfigError, match="peak"):
        evaluate.psnr(IMAGE, REFERENCE, peak=peak)


def test_tensors_are_accepted():
    import drjit as dr

    from gtao import backend

    tensor = backend.types_of(backend.default_float()).Tensor
    assert evaluate.mse(tensor(IMAGE.astype(np.float32)), REFERENCE) == pytest.approx(21 / 4)
    assert dr.is_tensor_v(tensor)


def test_noise_floor_and_corrected_error_by_hand():
    variance = np.array([[0.5, 0.25], [1.0, 3.0]])
    assert evaluate.noise_floor(variance) == pytest.approx(math.sqrt(4.75 / 4))
    assert evaluate.corrected_rmse(IMAGE, REFERENCE, variance) == pytest.approx(math.sqrt(21 / 4 - 4.75 / 4))
    mask = np.array([[True, True], [False, False]])
    assert evaluate.noise_floor(variance, mask=mask) == pytest.approx(math.sqrt(0.75 / 2))
    assert evaluate.corrected_rmse(IMAGE, REFERENCE, variance, mask=mask) == pytest.approx(math.sqrt(1 / 2 - 0.75 / 2))
    # Errors that noise accounts for.
    assert evaluate.corrected_rmse(IMAGE, REFERENCE, 10 * variance) == 0
    assert evaluate.noise_floor(variance, weights=WEIGHTS) == pytest.approx(math.sqrt((0.5 + 1 + 6) / 4))


def test_the_correction_is_unbiased():
    generator = np.random.default_rng(8)
    truth, sigma = generator.random(100000), 0.1 + 0.1 * generator.random(100000)
    noisy = truth + sigma * generator.standard_normal(truth.shape)
    # The mean of 100000 squared errors of size 0.15 is known to 0.3 %; 0.07 is what is to be found.
    assert evaluate.corrected_rmse(truth + 0.07, noisy, sigma**2) == pytest.approx(0.07, rel=0.05)


@pytest.mark.parametrize(("broken", "message"), [(-0.1, "negative"), (np.nan, "NaN"), (np.inf, "infinite")])
def test_variances_are_checked(broken, message):
    variance = np.array([[0.5, broken], [1.0, 3.0]])
    with pytest.raises(ShapeError, match=message):
        evaluate.noise_floor(variance)
    with pytest.raises(ShapeError, match=message):
        evaluate.corrected_rmse(IMAGE, REFERENCE, variance)
