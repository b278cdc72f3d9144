"""What every function of an estimate and its frame looks at first."""

from typing import Any

from gtao.errors import ConfigError, ShapeError
from gtao.gbuffer import GBuffer
from gtao.results import AmbientOcclusion

__all__ = ["check_estimate"]


def check_estimate(ao: Any, g: Any) -> None:
    """``ao`` is an estimate and ``g`` a frame of its size.

    Raises:
        ConfigError: one of them is something else.
        ShapeError: the estimate is of another frame.
    """
    for name, value, kind in (("g", g, GBuffer), ("ao", ao, AmbientOcclusion)):
        if not isinstance(value, kind):
            raise ConfigError(f"{name} must be a gtao.{kind.__name__}, got {type(value).__name__}")
    if tuple(ao.visibility.shape) != g.shape:
        raise ShapeError(
            f"the estimate has shape {tuple(ao.visibility.shape)}, the frame {g.shape}; pass its own frame"
        )
