"""What every function of an estimate and its frame looks at first."""

import numbers
from typing import Any

from gtao.errors import ConfigError, ShapeError
from gtao.gbuffer import GBuffer
from gtao.results import AmbientOcclusion

__all__ = ["check_estimate", "check_frame", "check_frame_index"]


def check_estimate(ao: Any, g: Any) -> None:
    """``ao`` is an estimate and ``g`` a frame of its size.

    Raises:
        ConfigError: one of them is something else.
        ShapeError: the estimate is of another frame.
    """
    check_frame(g)
    if not isinstance(ao, AmbientOcclusion):
        raise ConfigError(f"ao must be a gtao.AmbientOcclusion, got {type(ao).__name__}")
    if tuple(ao.visibility.shape) != g.shape:
        raise ShapeError(
            f"the estimate has shape {tuple(ao.visibility.shape)}, the frame {g.shape}; pass its own frame"
        )


def check_frame(g: Any) -> None:
    """``g`` is a frame.

    Raises:
        ConfigError: it is something else.
    """
    if not isinstance(g, GBuffer):
        raise ConfigError(f"g must be a gtao.GBuffer, got {type(g).__name__}")


def check_frame_index(frame_index: Any) -> None:
    """``frame_index`` is a number of a frame.

    Raises:
        ConfigError: it is something else.
    """
    if isinstance(frame_index, bool) or not isinstance(frame_index, numbers.Integral) or frame_index < 0:
        raise ConfigError(f"frame_index must be a non-negative integer, got {frame_index!r}")
