"""Metrics of what a viewer sees: SSIM, DSSIM and FLIP, of the compared pixels only.

The background is 1 in every visibility image: counted in, it would raise each score by as much as a scene has sky.

References:
    Z. Wang, A. C. Bovik, H. R. Sheikh, E. P. Simoncelli, "Image quality assessment: from error visibility to
    structural similarity", IEEE Transactions on Image Processing 2004.
    P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. D. Fairchild, "FLIP: a difference
    evaluator for alternating images", Proceedings of the ACM on Computer Graphics and Interactive Techniques 2020.
"""

from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import ndimage

from gtao.errors import ConfigError, ShapeError

__all__ = ["dssim", "flip", "flip_is_installed", "ssim", "ssim_windows"]

#: Standard deviation of the Gaussian window in pixels, and its side after truncation at 3.5 of them.
_SIGMA, _WINDOW = 1.5, 11


def ssim(image: ArrayLike, reference: ArrayLike, *, mask: ArrayLike | None = None, data_range: float = 1.0) -> float:
    """Mean structural similarity as defined by Wang et al. (2004), computed by scikit-image.

    Gaussian windows of 11×11 pixels with a standard deviation of 1.5, population covariance, K1 = 0.01, K2 = 0.03.
    The mean runs over the windows that lie in the frame and in the mask as a whole: the mask's border is treated as
    the frame's border always is. Windows that overlap the background would compare it with itself.

    Args:
        image: (H, W) image.
        reference: (H, W) image.
        mask: (H, W) bool, pixels that count; all if left out.
        data_range: Largest minus smallest value that the signal can take, positive; 1 for visibility.

    Returns:
        The similarity: 1 for equal images, lower is worse, negative for images that oppose each other.

    Raises:
        ConfigError: The range is not a positive number.
        ShapeError: The shapes differ or are not (H, W), no window fits, or a value that counts is not finite.
    """
    if not (np.isfinite(data_range) and data_range > 0):
        raise ConfigError(f"data_range must be a positive number, got {data_range}; use 1 for visibility")
    x, y, keep = _pair(image, reference, mask)
    windows = ssim_windows(keep)
    if not windows.any():
        raise ShapeError(
            f"no window of {_WINDOW}x{_WINDOW} pixels lies in the {keep.shape[1]}x{keep.shape[0]} frame and its mask; "
            f"compare larger images, or a wider mask"
        )
    from skimage.metrics import structural_similarity

    values = structural_similarity(
        np.where(keep, x, 0.0), np.where(keep, y, 0.0), data_range=data_range, gaussian_weights=True, sigma=_SIGMA,
        use_sample_covariance=False, full=True,
    )[-1]  # fmt: skip
    return float(values[windows].mean())


def dssim(image: ArrayLike, reference: ArrayLike, *, mask: ArrayLike | None = None, data_range: float = 1.0) -> float:
    """Structural dissimilarity (1 - SSIM)/2: 0 for equal images; arguments and errors as :func:`ssim`."""
    return (1 - ssim(image, reference, mask=mask, data_range=data_range)) / 2


def ssim_windows(mask: ArrayLike) -> np.ndarray:
    """Centres of the windows that :func:`ssim` averages over: (H, W) bool, for an (H, W) mask."""
    # Outside the frame counts as outside the mask.
    return ndimage.binary_erosion(np.asarray(mask, dtype=bool), np.ones((_WINDOW, _WINDOW), dtype=bool))


def flip_is_installed() -> bool:
    """Whether :func:`flip` can be computed here."""
    return find_spec("flip_evaluator") is not None


def flip(
    image: ArrayLike, reference: ArrayLike, *, mask: ArrayLike | None = None, pixels_per_degree: float = 67.0
) -> float:
    """Mean FLIP of two visibility images, as a viewer notices who flips between them (Andersson et al. 2020).

    Values are taken as linear grey, clipped to [0, 1], and shown in sRGB. Outside the mask both images are white, so
    that nothing differs there; the mean runs over the mask.

    Args:
        image: (H, W) visibility.
        reference: (H, W) visibility.
        mask: (H, W) bool, pixels that count; all if left out.
        pixels_per_degree: Pixels per degree of visual angle, positive. 67 is a 0.7 m wide monitor of 3840 pixels at
            a distance of 0.7 m.

    Returns:
        The mean error, in [0, 1].

    Raises:
        ConfigError: flip-evaluator is not installed, or the resolution is not a positive number.
        ShapeError: The shapes differ or are not (H, W), no pixel is left, or a value that counts is not finite.
    """
    if not (np.isfinite(pixels_per_degree) and pixels_per_degree > 0):
        raise ConfigError(f"pixels_per_degree must be a positive number, got {pixels_per_degree}")
    if not flip_is_installed():
        raise ConfigError("FLIP needs the package flip-evaluator, which is not here; pip install 'gtao[flip]'")
    x, y, keep = _pair(image, reference, mask)
    from flip_evaluator import evaluate

    shown = [np.repeat(np.where(keep, np.clip(v, 0, 1), 1.0)[..., None], 3, axis=-1) for v in (y, x)]
    errors, _, _ = evaluate(
        *(v.astype(np.float32) for v in shown), "LDR", inputsRGB=False, applyMagma=False, computeMeanError=False,
        parameters={"ppd": float(pixels_per_degree)},
    )  # fmt: skip
    return float(np.asarray(errors, dtype=np.float64).reshape(keep.shape)[keep].mean())


def _pair(image: Any, reference: Any, mask: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two float64 images and the pixels that count."""
    x, y = np.asarray(image, dtype=np.float64), np.asarray(reference, dtype=np.float64)
    if x.ndim != 2 or x.shape != y.shape:
        raise ShapeError(f"image has shape {x.shape} and reference {y.shape}; both must be the same (H, W)")
    keep = np.ones(x.shape, dtype=bool) if mask is None else np.asarray(mask).astype(bool)
    if keep.shape != x.shape:
        raise ShapeError(f"mask has shape {keep.shape}, the images {x.shape}; they must be equal")
    if not keep.any():
        raise ShapeError(f"no pixel of {x.shape} is left to compare; check mask")
    broken = int((keep & ~(np.isfinite(x) & np.isfinite(y))).sum())
    if broken:
        raise ShapeError(f"{broken} of {keep.sum()} compared values are NaN or infinite; leave them out with mask=")
    return x, y, keep
