"""Figures and reports of results. Takes results, returns figures; computes nothing and opens no window."""

from .comparison import Comparison, MethodResult, SceneComparison
from .comparison_report import compare_report
from .fits import coefficients, comparison, coverage, residuals, scatter
from .images import error_map, image_row, visibility_image
from .report import refit_figures, refit_report
from .tables import forms, left_out

__all__ = [
    "Comparison",
    "MethodResult",
    "SceneComparison",
    "coefficients",
    "compare_report",
    "comparison",
    "coverage",
    "error_map",
    "forms",
    "image_row",
    "left_out",
    "refit_figures",
    "refit_report",
    "residuals",
    "scatter",
    "visibility_image",
]
