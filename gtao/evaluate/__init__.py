"""How far an image or a sample is from the truth, and whether that can be chance."""

from .metrics import bias, mae, mse, psnr, rmse
from .statistics import (
    ImageTest,
    TestResult,
    block_labels,
    bootstrap_counts,
    bootstrap_interval,
    bootstrap_standard_error,
    sidak,
    z_test,
    z_test_image,
)

__all__ = [
    "ImageTest",
    "TestResult",
    "bias",
    "block_labels",
    "bootstrap_counts",
    "bootstrap_interval",
    "bootstrap_standard_error",
    "mae",
    "mse",
    "psnr",
    "rmse",
    "sidak",
    "z_test",
    "z_test_image",
]
