"""Image-level driver of the spatial filters."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from gtao.errors import ConfigError, ShapeError
from gtao.gbuffer import GBuffer
from gtao.results import AmbientOcclusion

__all__ = ["denoise"]

# What filters the flat visibility for each class of filter: (visibility, g, filter) -> visibility.
_FILTERS: dict[type, Callable[..., Any]] = {}


def denoise(ao: AmbientOcclusion, g: GBuffer, spatial: Any) -> AmbientOcclusion:
    """The estimate ``ao`` of frame ``g``, filtered in the image.

    Raises:
        ConfigError: ``spatial`` is no filter.
        ShapeError: the estimate is not of this frame.
    """
    apply = _FILTERS.get(type(spatial))
    if apply is None:
        choices = ", ".join(f"gtao.{kind.__name__}" for kind in _FILTERS)
        raise ConfigError(f"the filter must be one of {choices}, got {type(spatial).__name__}")
    if tuple(ao.visibility.shape) != g.shape:
        raise ShapeError(
            f"the estimate has shape {tuple(ao.visibility.shape)}, the frame {g.shape}; pass its own frame"
        )
    return replace(ao, visibility=g.types.Tensor(apply(ao.visibility.array, g, spatial), g.shape))
