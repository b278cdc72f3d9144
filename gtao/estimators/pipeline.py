"""The stages of a pipeline, one after the other."""

from copy import copy
from dataclasses import replace

import drjit as dr

from gtao.config import Pipeline
from gtao.errors import ConfigError
from gtao.gbuffer import GBuffer
from gtao.history import History
from gtao.results import AmbientOcclusion, Stages

from .denoise import denoise
from .downsample import downsample
from .estimate import check_frame
from .occlusion import ambient_occlusion
from .upsample import upsample

__all__ = ["run_pipeline"]


def run_pipeline(g: GBuffer, pipeline: Pipeline, history: History | None, frame_index: int | None) -> Stages:
    """What :meth:`gtao.Pipeline.stages` returns."""
    check_frame(g)
    if not (history is None or isinstance(history, History)):
        raise ConfigError(f"history must be a gtao.History or None, got {type(history).__name__}")
    memory = History() if history is None else copy(history)
    index = memory.frame_index if frame_index is None else frame_index
    frame = g if pipeline.downsample is None else downsample(g, pipeline.downsample)
    latest = occlusion = ambient_occlusion(frame, pipeline.occlusion, frame_index=index)
    spatial = temporal = upsampled = None
    if pipeline.spatial is not None:
        latest = spatial = denoise(latest, frame, pipeline.spatial, frame_index=index)
    if pipeline.temporal is not None:
        latest = temporal = pipeline.temporal.step(latest, frame, memory)
    else:
        memory.frame_index += 1
    if pipeline.upsample is not None:
        latest = upsampled = upsample(latest, frame, g, pipeline.upsample)
    result = _clamped(latest) if pipeline.clamp else latest
    if history is not None:
        # From here on nothing can fail.
        history.frame_index, history.contents = memory.frame_index, memory.contents
    return Stages(
        frame=frame, occlusion=occlusion, spatial=spatial, temporal=temporal, upsampled=upsampled, result=result
    )


def _clamped(ao: AmbientOcclusion) -> AmbientOcclusion:
    v = ao.visibility.array
    v = dr.select(v > 0, dr.select(v < 1, v, 1), 0)
    visibility = type(ao.visibility)(v, ao.visibility.shape)
    # Left alone, planes would be brought together into tensors.
    directions = {name: ao.planes(name) for name in ("mean_direction", "visibility_sh")}
    unshaped = ao.visibility if ao.unshaped is None and ao.normal_v is not None else ao.unshaped
    return replace(ao, visibility=visibility, **directions, unshaped=unshaped)
