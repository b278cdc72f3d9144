"""How far an image or a sample is from the truth, and whether that can be chance."""

from .bootstrap import block_labels, bootstrap_counts, bootstrap_interval, bootstrap_standard_error
from .budget import ErrorBudget, error_budget
from .metrics import bias, corrected_rmse, mae, mse, noise_floor, psnr, rmse
from .scoring import scores
from .similarity import dssim, flip, flip_is_installed, ssim, ssim_windows
from .statistics import ImageTest, TestResult, sidak, z_test, z_test_image
from .strata import STRATA_EDGES, Strata, strata_of, stratify

__all__ = [
    "STRATA_EDGES",
    "ErrorBudget",
    "ImageTest",
    "Strata",
    "TestResult",
    "bias",
    "block_labels",
    "bootstrap_counts",
    "bootstrap_interval",
    "bootstrap_standard_error",
    "corrected_rmse",
    "dssim",
    "error_budget",
    "flip",
    "flip_is_installed",
    "mae",
    "mse",
    "noise_floor",
    "psnr",
    "rmse",
    "scores",
    "sidak",
    "ssim",
    "ssim_windows",
    "strata_of",
    "stratify",
    "z_test",
    "z_test_image",
]
