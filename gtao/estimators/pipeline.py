"""The stages of a pipeline, one after the other."""

from dataclasses import replace

import drjit as dr

from gtao.config import Pipeline
from gtao.gbuffer import GBuffer
from gtao.results import AmbientOcclusion

from .denoise import denoise
from .occlusion import ambient_occlusion

__all__ = ["run_pipeline"]


def run_pipeline(g: GBuffer, pipeline: Pipeline, *, frame_index: int = 0) -> AmbientOcclusion:
    """What :meth:`gtao.Pipeline.step` returns."""
    ao = ambient_occlusion(g, pipeline.occlusion, frame_index=frame_index)
    if pipeline.spatial is not None:
        ao = denoise(ao, g, pipeline.spatial, frame_index=frame_index)
    if not pipeline.clamp:
        return ao
    v = ao.visibility.array
    v = dr.select(v > 0, dr.select(v < 1, v, 1), 0)
    visibility = type(ao.visibility)(v, ao.visibility.shape)
    # Left alone, planes would be brought together into tensors.
    directions = {name: ao.planes(name) for name in ("mean_direction", "visibility_sh")}
    unshaped = ao.visibility if ao.unshaped is None and ao.normal_v is not None else ao.unshaped
    return replace(ao, visibility=visibility, **directions, unshaped=unshaped)
