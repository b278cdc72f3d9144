"""Fits to ground truth: path counts in, coefficients with standard errors out. Reads data, never renders."""

from .diagnostics import Diagnostics, diagnose
from .forms import evaluate
from .multibounce import multibounce
from .result import MultibounceResult
from .samples import Samples
from .scene import SceneSamples
from .scoring import Score
from .settings import REPORT_ALBEDOS, FitSettings
from .table import FormScore, FormTable
from .validation import FLOOR, PUBLISHED, compare_forms

__all__ = [
    "FLOOR",
    "PUBLISHED",
    "REPORT_ALBEDOS",
    "Diagnostics",
    "FitSettings",
    "FormScore",
    "FormTable",
    "MultibounceResult",
    "Samples",
    "SceneSamples",
    "Score",
    "compare_forms",
    "diagnose",
    "evaluate",
    "multibounce",
]
