"""Occlusion of glossy reflections against ray-traced truth."""

from .aperture import FitApertureOutcome, fit_aperture
from .aperture_settings import FitApertureConfig

__all__ = ["FitApertureConfig", "FitApertureOutcome", "fit_aperture"]
