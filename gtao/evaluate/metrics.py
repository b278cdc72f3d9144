"""Errors of an image against a reference: RMSE, MAE, bias, PSNR, masked and weighted, and what noise adds to them.

All take anything that NumPy can view as an array (NumPy, Dr.Jit tensors, DLPack holders). Pixels outside the
mask or of weight zero may hold anything, NaN included; a NaN or infinity that would enter the mean is an
error, never a NaN result.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gtao.errors import ConfigError, ShapeError

__all__ = ["bias", "corrected_rmse", "mae", "mse", "noise_floor", "psnr", "rmse"]


def mse(
    image: ArrayLike, reference: ArrayLike, *, mask: ArrayLike | None = None, weights: ArrayLike | None = None
) -> float:
    """Mean squared error.

    Args:
        image: Array of any shape, for example (H, W) or (H, W, C).
        reference: Array of the same shape.
        mask: Pixels that count, bool, of the same shape or of its leading axes: (H, W) for (H, W, C).
        weights: Non-negative weight per pixel, shaped like a mask; the mean is Σ w e² / Σ w.

    Returns:
        The mean squared error, in squared units of the image.

    Raises:
        ShapeError: The shapes differ, no pixel is left, a weight is negative or not finite, or a value that
            counts is not finite.
    """
    error, w = _errors(image, reference, mask, weights)
    return float(np.average(error**2, weights=w))


def rmse(
    image: ArrayLike, reference: ArrayLike, *, mask: ArrayLike | None = None, weights: ArrayLike | None = None
) -> float:
    """Root of the mean squared error; arguments and errors as :func:`mse`."""
    return float(np.sqrt(mse(image, reference, mask=mask, weights=weights)))


def noise_floor(variance: ArrayLike, *, mask: ArrayLike | None = None, weights: ArrayLike | None = None) -> float:
    """RMSE that a perfect image has against a noisy reference: the root of the mean variance.

    Args:
        variance: Variance of the reference's means, of the shape of the images, not negative.
        mask: As in :func:`mse`.
        weights: As in :func:`mse`.

    Returns:
        The noise floor, in units of the image.

    Raises:
        ShapeError: A variance that counts is negative or not finite, or no pixel is left.
    """
    values, w = _errors(variance, np.zeros_like(variance, dtype=np.float64), mask, weights)
    if np.any(values < 0):
        raise ShapeError("a variance is negative; give the variance of the mean")
    return float(np.sqrt(np.average(values, weights=w)))


def corrected_rmse(
    image: ArrayLike,
    reference: ArrayLike,
    variance: ArrayLike,
    *,
    mask: ArrayLike | None = None,
    weights: ArrayLike | None = None,
) -> float:
    """RMSE against what a noisy reference would converge to: the mean variance is taken off the mean squared error.

    Args:
        image: As in :func:`mse`; its noise must be independent of the reference's.
        reference: As in :func:`mse`.
        variance: As in :func:`noise_floor`.
        mask: As in :func:`mse`.
        weights: As in :func:`mse`.

    Returns:
        The root of the difference; 0 where noise accounts for all of the error.

    Raises:
        ShapeError: As in :func:`mse` and :func:`noise_floor`.
    """
    error = mse(image, reference, mask=mask, weights=weights)
    return float(np.sqrt(max(error - noise_floor(variance, mask=mask, weights=weights) ** 2, 0.0)))


def mae(
    image: ArrayLike, reference: ArrayLike, *, mask: ArrayLike | None = None, weights: ArrayLike | None = None
) -> float:
    """Mean absolute error; arguments and errors as :func:`mse`."""
    error, w = _errors(image, reference, mask, weights)
    return float(np.average(np.abs(error), weights=w))


def bias(
    image: ArrayLike, reference: ArrayLike, *, mask: ArrayLike | None = None, weights: ArrayLike | None = None
) -> float:
    """Mean of image minus reference: positive where the image is too bright; arguments and errors as
    :func:`mse`.
    """
    error, w = _errors(image, reference, mask, weights)
    return float(np.average(error, weights=w))


def psnr(
    image: ArrayLike,
    reference: ArrayLike,
    *,
    peak: float = 1.0,
    mask: ArrayLike | None = None,
    weights: ArrayLike | None = None,
) -> float:
    """Peak signal-to-noise ratio 10 log10(peak² / MSE) in decibels; infinite for equal images.

    Args:
        image: As in :func:`mse`.
        reference: As in :func:`mse`.
        peak: Largest value that the signal can take, positive; 1 for visibility.
        mask: As in :func:`mse`.
        weights: As in :func:`mse`.

    Returns:
        The ratio in dB.

    Raises:
        ConfigError: The peak is not a positive number.
        ShapeError: As in :func:`mse`.
    """
    if not (np.isfinite(peak) and peak > 0):
        raise ConfigError(f"peak must be a positive number, got {peak}; use 1 for visibility")
    error = mse(image, reference, mask=mask, weights=weights)
    return float("inf") if error == 0 else float(10 * np.log10(peak**2 / error))


def _errors(image: Any, reference: Any, mask: Any, weights: Any) -> tuple[np.ndarray, np.ndarray]:
    """The errors that count and their weights, both flat float64."""
    x = np.asarray(image, dtype=np.float64)
    y = np.asarray(reference, dtype=np.float64)
    if x.shape != y.shape:
        raise ShapeError(f"image has shape {x.shape} and reference {y.shape}; they must be equal")
    w = np.ones(x.shape)
    if mask is not None:
        w = w * _expand("mask", np.asarray(mask).astype(bool), x.shape)
    if weights is not None:
        given = np.asarray(weights, dtype=np.float64)
        if not np.all(np.isfinite(given)) or np.any(given < 0):
            raise ShapeError("weights must be finite and not negative; give unwanted pixels the weight 0")
        w = w * _expand("weights", given, x.shape)
    counted = w > 0
    if not counted.any():
        raise ShapeError(f"no pixel of {x.shape} is left to compare; check mask and weights")
    x, y = x[counted], y[counted]
    broken = ~(np.isfinite(x) & np.isfinite(y))
    if broken.any():
        raise ShapeError(
            f"{int(broken.sum())} of {x.size} compared values are NaN or infinite; leave them out with mask="
        )
    return x - y, w[counted]


def _expand(name: str, values: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Give a per-pixel array the trailing channel axes of the image."""
    if values.shape != shape[: values.ndim]:
        raise ShapeError(f"{name} has shape {values.shape}, the images {shape}; it must match their leading axes")
    return np.broadcast_to(values.reshape(values.shape + (1,) * (len(shape) - values.ndim)), shape)
