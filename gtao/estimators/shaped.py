"""What a configuration does to the visibility after it was integrated, and to nothing else."""

import math
from typing import Any

import drjit as dr

from gtao.gbuffer import GBuffer
from gtao.kernels.shaping import shape, small_radius_fade

from .attached import is_attached
from .marching import opaque

__all__ = ["is_shaped", "shaped"]

# Options of some methods, and what they are where they change nothing.
_OPTIONS = {"power": 1.0, "floor": 0.0, "ceiling": math.inf}


def is_shaped(method: Any) -> bool:
    """Whether the visibility is not what its directions belong to."""
    return getattr(method, "small_radius_fade", False) or _is_curved(_values(method))


def shaped(flat: Any, g: GBuffer, method: Any):
    """The flat visibility after fade, power, floor and ceiling; the background stays 1, whatever has derivatives."""
    surface = g.mask.array
    if getattr(method, "small_radius_fade", False):
        z = dr.select(surface, g.view_z.array, 1)
        scale = opaque(g, method.search_radius * g.camera.fx)
        radius_px = scale if g.camera.is_orthographic else scale / z
        flat = flat + small_radius_fade(radius_px, method.n_slices)
    values = _values(method)
    if _is_curved(values):
        flat = shape(flat, *(opaque(g, value) for value in values))
    return dr.select(surface, flat, 1)


def _values(method: Any) -> tuple[Any, ...]:
    return tuple(getattr(method, name, default) for name, default in _OPTIONS.items())


def _is_curved(values: tuple[Any, ...]) -> bool:
    """Also where a value changes nothing, if its derivative is asked for."""
    return any(map(is_attached, values)) or values != tuple(_OPTIONS.values())
