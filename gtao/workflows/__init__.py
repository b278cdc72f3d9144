"""Whole jobs made of the other rooms: what the ``gtao`` command runs, callable from Python."""

from .comparison import CompareConfig, CompareOutcome, compare
from .files import export_fit, occlusion_file, render_scene
from .refit import RefitOutcome, refit
from .settings import RefitConfig

__all__ = [
    "CompareConfig",
    "CompareOutcome",
    "RefitConfig",
    "RefitOutcome",
    "compare",
    "export_fit",
    "occlusion_file",
    "refit",
    "render_scene",
]
