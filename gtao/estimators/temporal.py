"""Image-level driver of the temporal filter."""

from typing import Any

import drjit as dr

from gtao.camera import camera_from_dict
from gtao.config import TemporalFilter
from gtao.errors import ConfigError, ShapeError
from gtao.gbuffer import GBuffer
from gtao.history import Contents, History
from gtao.planes import Planes
from gtao.results import AmbientOcclusion

from .channels import Channels, channels_of, estimate_of
from .estimate import check_estimate
from .motion import still_motion
from .temporal_stage import accumulated, first

__all__ = ["accumulate"]


def accumulate(ao: AmbientOcclusion, g: GBuffer, temporal: TemporalFilter, history: History | None) -> AmbientOcclusion:
    """What :meth:`gtao.TemporalFilter.step` returns."""
    check_estimate(ao, g)
    if history is None:
        return ao
    if not isinstance(history, History):
        raise ConfigError(f"history must be a gtao.History, got {type(history).__name__}")
    if dr.flag(dr.JitFlag.FreezingScope):
        raise ConfigError("inside dr.freeze a history would stay that of the recorded frame; take the step outside")
    channels, before = channels_of(ao, g.types), history.contents
    motion = _motion(g, before)
    if before is None:
        result, estimate = first(channels, g), ao
    else:
        _check_same_kind(before, channels, g)
        result = accumulated(channels, before, motion, g, temporal)
        estimate = estimate_of(result.channels, ao, g)
    count = dr.detach(result.count)
    kept = {name: tuple(map(dr.detach, arrays)) for name, arrays in result.channels.items()}
    for name in ("visibility", "unshaped"):
        if name in kept:
            # An array of its own: a caller may write into the memory of the result.
            kept[name] = (dr.select(count > 0, kept[name][0], 0),)
    moved = None if motion is None else tuple(map(dr.detach, motion[:2]))
    deviation = None if result.deviation is None else dr.detach(result.deviation)
    normal = None if temporal.crease is None else tuple(map(dr.detach, g.normal_arrays()))
    dr.eval(result.channels, count, deviation, kept, normal, moved)
    history.take(
        Contents(
            channels=kept,
            count=count,
            deviation=deviation,
            view_z=dr.detach(g.view_z.array),
            normal=normal,
            motion=moved,
            camera=camera_from_dict(g.camera.to_dict()),
            view_to_world=g.view_to_world,
        )
    )
    return estimate


def _check_same_kind(before: Contents, channels: Channels, g: GBuffer) -> None:
    if before.camera.shape != g.shape:
        (h0, w0), (h, w) = before.camera.shape, g.shape
        raise ShapeError(
            f"the history is of frames of {w0}x{h0} pixels, this one has {w}x{h}; call history.reset(), or keep one"
            " history for each size"
        )
    if before.channels.keys() != channels.keys():
        raise ConfigError(
            f"the history holds {', '.join(before.channels)}, the estimate {', '.join(channels)}; call"
            " history.reset(), or estimate the same every frame"
        )


def _motion(g: GBuffer, before: Contents | None) -> tuple[Any, ...] | None:
    """Pixels to the right and down and change of depth from the previous frame, flat; None where nothing moves."""
    T = g.types
    if g.motion is not None:
        *moved, change = (*Planes.of(g.motion).arrays, T.Float(0))[:3]
        return (*moved, change)
    if before is None or before.view_to_world is None or g.view_to_world is None:
        return None
    return still_motion(g, before.camera, before.view_to_world)
