"""Image-level driver of the occlusion kernels."""

import math
from collections.abc import Callable
from typing import Any

from gtao.config import GTAO, HBAO, HeightfieldHorizon, HeightfieldRayMarch, VisibilityBitmask
from gtao.errors import ConfigError
from gtao.gbuffer import GBuffer
from gtao.kernels.shaping import shape
from gtao.results import AmbientOcclusion

from .attached import is_attached
from .bitmask import bitmask_visibility
from .hbao import hbao_visibility
from .heightfield import horizon_truth, march_truth
from .horizons import horizon_visibility
from .marching import opaque

__all__ = ["ambient_occlusion"]

# What makes the flat visibility of each method, of Monte Carlo methods with its variance.
_METHODS: dict[type, Callable[..., Any]] = {
    GTAO: horizon_visibility,
    HBAO: hbao_visibility,
    VisibilityBitmask: bitmask_visibility,
    HeightfieldHorizon: horizon_truth,
}
_MONTE_CARLO: dict[type, Callable[..., tuple[Any, Any]]] = {HeightfieldRayMarch: march_truth}

# What :func:`gtao.kernels.shaping.shape` does to the results of methods that have these options.
_SHAPING = {"power": 1.0, "floor": 0.0, "ceiling": math.inf}


def ambient_occlusion(g: GBuffer, method: Any = None, *, frame_index: int = 0) -> AmbientOcclusion:
    """Visibility of every pixel, estimated from depth and normals alone.

    Args:
        g: the frame.
        method: a strategy object; ``GTAO()`` if left out.
        frame_index: position in the temporal noise sequence, at least 0.

    Returns:
        The visibility as an (H, W) tensor in the precision of ``g``, lazily evaluated in one kernel; from Monte Carlo
        methods with its variance, both evaluated.

    Raises:
        ConfigError: ``method`` is no strategy object, ``frame_index`` is negative, or gradients are asked through
            more steps per side than can be unrolled or of a ground truth.
    """
    method = GTAO() if method is None else method
    kinds = _METHODS | _MONTE_CARLO
    if type(method) not in kinds:
        choices = ", ".join(f"gtao.{kind.__name__}" for kind in kinds)
        raise ConfigError(f"method must be one of {choices}, got {type(method).__name__}")
    if not isinstance(g, GBuffer):
        raise ConfigError(f"g must be a gtao.GBuffer, got {type(g).__name__}")
    if isinstance(frame_index, bool) or not isinstance(frame_index, int) or frame_index < 0:
        raise ConfigError(f"frame_index must be a non-negative integer, got {frame_index!r}")
    variance = None
    if type(method) in _MONTE_CARLO:
        flat, variance = _MONTE_CARLO[type(method)](g, method, frame_index)
        variance = g.types.Tensor(variance, g.shape)
    else:
        flat = _METHODS[type(method)](g, method, frame_index)
    shaped = tuple(getattr(method, name, default) for name, default in _SHAPING.items())
    if any(map(is_attached, shaped)) or shaped != tuple(_SHAPING.values()):
        flat = shape(flat, *(opaque(g, value) for value in shaped))
    return AmbientOcclusion(visibility=g.types.Tensor(flat, g.shape), variance=variance, config=method)
