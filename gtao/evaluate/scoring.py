"""All metrics of one image at once."""

import numpy as np
from numpy.typing import ArrayLike

from .metrics import bias, corrected_rmse, mae, psnr, rmse
from .similarity import flip, flip_is_installed, ssim, ssim_windows

__all__ = ["scores"]


def scores(
    image: ArrayLike,
    reference: ArrayLike,
    *,
    variance: ArrayLike | None = None,
    mask: ArrayLike | None = None,
    perceptual: bool = True,
) -> dict[str, float | None]:
    """Every metric of a visibility image, by name.

    Args:
        image: (H, W) visibility.
        reference: (H, W) visibility.
        variance: (H, W) variance of the reference's means; without it there is no "corrected_rmse".
        mask: (H, W) bool, pixels that count; all if left out.
        perceptual: Whether to compute SSIM, DSSIM and FLIP, which take most of the time.

    Returns:
        "rmse", "corrected_rmse", "bias", "mae", "psnr", "ssim", "dssim" and "flip"; None for what was not asked for,
        for FLIP where flip-evaluator is not installed, and for SSIM where the mask is too narrow for its windows.

    Raises:
        ShapeError: The shapes differ or are not (H, W), no pixel is left, or a value that counts is not finite.
    """
    similarity = None
    if perceptual and ssim_windows(np.ones(np.shape(image)) if mask is None else mask).any():
        similarity = ssim(image, reference, mask=mask)
    return {
        "rmse": rmse(image, reference, mask=mask),
        "corrected_rmse": None if variance is None else corrected_rmse(image, reference, variance, mask=mask),
        "bias": bias(image, reference, mask=mask),
        "mae": mae(image, reference, mask=mask),
        "psnr": psnr(image, reference, mask=mask),
        "ssim": similarity,
        "dssim": None if similarity is None else (1 - similarity) / 2,
        "flip": flip(image, reference, mask=mask) if perceptual and flip_is_installed() else None,
    }
