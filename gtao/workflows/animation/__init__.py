"""Methods on moving images against ray-traced truth: frames, videos, temporal metrics."""

from .run import AnimateOutcome, animate
from .settings import AnimateConfig

__all__ = ["AnimateConfig", "AnimateOutcome", "animate"]
