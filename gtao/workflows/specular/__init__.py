"""Occlusion of glossy reflections against ray-traced truth."""

from .aperture import FitApertureOutcome, fit_aperture
from .aperture_settings import FitApertureConfig
from .methods import SPECULAR_METHODS
from .run import CompareSpecularOutcome, compare_specular
from .settings import SPECULAR_LIGHTS, CompareSpecularConfig

__all__ = [
    "SPECULAR_LIGHTS",
    "SPECULAR_METHODS",
    "CompareSpecularConfig",
    "CompareSpecularOutcome",
    "FitApertureConfig",
    "FitApertureOutcome",
    "compare_specular",
    "fit_aperture",
]
