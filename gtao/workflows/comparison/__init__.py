"""Every method against ray-traced truth: tables, pictures, error budgets, report."""

from .run import CompareOutcome, compare
from .settings import CompareConfig

__all__ = ["CompareConfig", "CompareOutcome", "compare"]
