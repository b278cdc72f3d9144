"""How far an image, a sequence or a sample is from the truth, and whether that can be chance."""

from .bootstrap import block_labels, bootstrap_counts, bootstrap_interval, bootstrap_standard_error
from .budget import ErrorBudget, error_budget
from .metrics import bias, corrected_rmse, mae, mse, noise_floor, psnr, rmse
from .scoring import scores
from .similarity import dssim, flip, flip_is_installed, ssim, ssim_windows
from .statistics import ImageTest, TestResult, sidak, z_test, z_test_image
from .strata import STRATA_EDGES, Strata, strata_of, stratify
from .temporal import TemporalScores, convergence_frames, drift
from .temporal_flicker import Flicker, FlickerMeter, flicker
from .temporal_ghosting import Ghosting, GhostingMeter, ghosting
from .temporal_trail import TrailTracker, trail_mask

__all__ = [
    "STRATA_EDGES",
    "ErrorBudget",
    "Flicker",
    "FlickerMeter",
    "Ghosting",
    "GhostingMeter",
    "ImageTest",
    "Strata",
    "TemporalScores",
    "TestResult",
    "TrailTracker",
    "bias",
    "block_labels",
    "bootstrap_counts",
    "bootstrap_interval",
    "bootstrap_standard_error",
    "convergence_frames",
    "corrected_rmse",
    "drift",
    "dssim",
    "error_budget",
    "flicker",
    "flip",
    "flip_is_installed",
    "ghosting",
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
    "trail_mask",
    "z_test",
    "z_test_image",
]
