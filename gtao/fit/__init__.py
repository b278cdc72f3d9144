"""Fits to ground truth: data in, coefficients or options of estimators with standard errors out. Never renders."""

from .apertures import ApertureFit, ApertureSample, aperture
from .diagnostics import Diagnostics, diagnose
from .forms import evaluate
from .multibounce import multibounce
from .result import MultibounceResult
from .samples import Samples
from .scene import SceneSamples
from .scoring import Score
from .settings import REPORT_ALBEDOS, FitSettings
from .table import FormScore, FormTable
from .tuning import check_tuning, tune
from .tuning_options import CONTINUOUS, Range, at_radius, continuous, option, with_continuous, with_options
from .tuning_problem import Problem
from .tuning_result import Candidate, Fold, TunedParameter, TuningResult, TuningScores
from .validation import FLOOR, PUBLISHED, compare_forms

__all__ = [
    "CONTINUOUS",
    "FLOOR",
    "PUBLISHED",
    "REPORT_ALBEDOS",
    "ApertureFit",
    "ApertureSample",
    "Candidate",
    "Diagnostics",
    "FitSettings",
    "Fold",
    "FormScore",
    "FormTable",
    "MultibounceResult",
    "Problem",
    "Range",
    "Samples",
    "SceneSamples",
    "Score",
    "TunedParameter",
    "TuningResult",
    "TuningScores",
    "aperture",
    "at_radius",
    "check_tuning",
    "compare_forms",
    "continuous",
    "diagnose",
    "evaluate",
    "multibounce",
    "option",
    "tune",
    "with_continuous",
    "with_options",
]
