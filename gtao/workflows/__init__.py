"""Whole jobs made of the other rooms: what the ``gtao`` command runs, callable from Python."""

from .comparison import CompareConfig, CompareOutcome, compare
from .files import export_fit, occlusion_file, render_scene
from .lighting import IRRADIANCE_METHODS, LIGHTS, CompareLightingConfig, CompareLightingOutcome, compare_lighting
from .refit import RefitOutcome, refit
from .settings import RefitConfig
from .specular import FitApertureConfig, FitApertureOutcome, fit_aperture
from .tuning import TuneOutcome, tune
from .tuning_settings import TuneConfig

__all__ = [
    "IRRADIANCE_METHODS",
    "LIGHTS",
    "CompareConfig",
    "CompareLightingConfig",
    "CompareLightingOutcome",
    "CompareOutcome",
    "FitApertureConfig",
    "FitApertureOutcome",
    "RefitConfig",
    "RefitOutcome",
    "TuneConfig",
    "TuneOutcome",
    "compare",
    "compare_lighting",
    "export_fit",
    "fit_aperture",
    "occlusion_file",
    "refit",
    "render_scene",
    "tune",
]
