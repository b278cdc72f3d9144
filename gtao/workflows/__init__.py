"""Whole jobs made of the other rooms: what the ``gtao`` command runs, callable from Python."""

from .animation import AnimateConfig, AnimateOutcome, animate
from .baking import BakeOutcome, bake_table
from .comparison import CompareConfig, CompareOutcome, compare
from .files import export_fit, occlusion_file, render_scene
from .lighting import IRRADIANCE_METHODS, LIGHTS, CompareLightingConfig, CompareLightingOutcome, compare_lighting
from .refit import RefitOutcome, refit
from .settings import RefitConfig
from .specular import (
    SPECULAR_LIGHTS,
    SPECULAR_METHODS,
    CompareSpecularConfig,
    CompareSpecularOutcome,
    FitApertureConfig,
    FitApertureOutcome,
    compare_specular,
    fit_aperture,
)
from .tuning import TuneOutcome, tune
from .tuning_settings import TuneConfig

__all__ = [
    "IRRADIANCE_METHODS",
    "LIGHTS",
    "SPECULAR_LIGHTS",
    "SPECULAR_METHODS",
    "AnimateConfig",
    "AnimateOutcome",
    "BakeOutcome",
    "CompareConfig",
    "CompareLightingConfig",
    "CompareLightingOutcome",
    "CompareOutcome",
    "CompareSpecularConfig",
    "CompareSpecularOutcome",
    "FitApertureConfig",
    "FitApertureOutcome",
    "RefitConfig",
    "RefitOutcome",
    "TuneConfig",
    "TuneOutcome",
    "animate",
    "bake_table",
    "compare",
    "compare_lighting",
    "compare_specular",
    "export_fit",
    "fit_aperture",
    "occlusion_file",
    "refit",
    "render_scene",
    "tune",
]
