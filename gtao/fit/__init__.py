"""Fits to ground truth: path counts in, coefficients with standard errors out. Reads data, never renders."""

from .forms import evaluate
from .multibounce import REPORT_ALBEDOS, multibounce
from .result import FitSettings, MultibounceResult
from .samples import Samples
from .scene import SceneSamples
from .scoring import Score

__all__ = [
    "REPORT_ALBEDOS",
    "FitSettings",
    "MultibounceResult",
    "Samples",
    "SceneSamples",
    "Score",
    "evaluate",
    "multibounce",
]
