"""Figures and reports of results. Takes results, returns figures; computes nothing and opens no window."""

from .animation import (
    ANIMATION_PALETTE,
    AnimatedMethod,
    AnimationComparison,
    animation_curves,
    error_pixels,
    video_frame,
    visibility_pixels,
)
from .animation_report import animation_figures, animation_report
from .aperture import aperture_by_roughness, aperture_curves, aperture_figures, aperture_report
from .comparing import comparison_figures
from .comparison import Comparison, MethodResult, SceneComparison
from .comparison_images import comparison_images, error_budget_maps, signed_error_maps
from .comparison_report import compare_report
from .comparison_tables import summary_rows
from .error_bars import deviation_bars, error_budget_bar
from .error_curves import error_against_samples, error_against_time, stratified_errors
from .filter_weights import filter_weights
from .fits import coefficients, comparison, coverage, residuals, scatter
from .images import error_map, image_row, visibility_image
from .lighting import LightingComparison, LightingView, lighting_bars, lighting_images
from .lighting_report import lighting_figures, lighting_report
from .noise import noise_errors, noise_patterns, noise_spectra
from .report import refit_figures, refit_report
from .slices import slices
from .specular import SpecularComparison, SpecularView, specular_curves, specular_images, specular_steps
from .specular_report import specular_figures, specular_report
from .tables import forms, left_out
from .temporal import settling_curves
from .tuning import tuning_candidates, tuning_errors, tuning_figures, tuning_history, tuning_parameters
from .tuning_report import tuning_report

__all__ = [
    "ANIMATION_PALETTE",
    "AnimatedMethod",
    "AnimationComparison",
    "Comparison",
    "LightingComparison",
    "LightingView",
    "MethodResult",
    "SceneComparison",
    "SpecularComparison",
    "SpecularView",
    "animation_curves",
    "animation_figures",
    "animation_report",
    "aperture_by_roughness",
    "aperture_curves",
    "aperture_figures",
    "aperture_report",
    "coefficients",
    "compare_report",
    "comparison",
    "comparison_figures",
    "comparison_images",
    "coverage",
    "deviation_bars",
    "error_against_samples",
    "error_against_time",
    "error_budget_bar",
    "error_budget_maps",
    "error_map",
    "error_pixels",
    "filter_weights",
    "forms",
    "image_row",
    "left_out",
    "lighting_bars",
    "lighting_figures",
    "lighting_images",
    "lighting_report",
    "noise_errors",
    "noise_patterns",
    "noise_spectra",
    "refit_figures",
    "refit_report",
    "residuals",
    "scatter",
    "settling_curves",
    "signed_error_maps",
    "slices",
    "specular_curves",
    "specular_figures",
    "specular_images",
    "specular_report",
    "specular_steps",
    "stratified_errors",
    "summary_rows",
    "tuning_candidates",
    "tuning_errors",
    "tuning_figures",
    "tuning_history",
    "tuning_parameters",
    "tuning_report",
    "video_frame",
    "visibility_image",
    "visibility_pixels",
]
