"""The visibility bitmask's accumulator from its configuration."""

import math
from typing import Any

import drjit as dr

from gtao.config import (
    ConstantThickness,
    ContinuityThickness,
    LinearThickness,
    MeasuredThickness,
    NoCut,
    SampleCut,
    VisibilityBitmask,
    plain,
)
from gtao.errors import ConfigError
from gtao.gbuffer import GBuffer
from gtao.kernels import noise
from gtao.kernels.accumulators import Sectors

from .attached import attached_numbers
from .job import Job
from .marching import march_job, opaque

__all__ = ["bitmask_job"]

_MODELS: dict[type, str] = {
    type(None): "solid",
    ConstantThickness: "constant",
    ContinuityThickness: "continuity",
    LinearThickness: "linear",
    MeasuredThickness: "measured",
}


def bitmask_job(g: GBuffer, method: VisibilityBitmask, frame_index: int) -> Job:
    """The march of :class:`gtao.VisibilityBitmask`.

    Raises:
        ConfigError: gradients are asked for, which counting has none, or the measured thickness of a frame without
            layers.
    """
    if g.is_attached or attached_numbers(method):
        raise ConfigError(
            "a bitmask counts sectors and has no gradient; use gtao.GTAO, or detach the frame, the camera and the"
            " options"
        )
    radius = min(method.search_radius, getattr(method.falloff, "end", math.inf))
    thickness, camera = method.thickness, g.camera
    amount = next((getattr(thickness, n) for n in ("thickness", "slope", "continuing") if hasattr(thickness, n)), 0.0)
    key = noise.frame_terms(method.noise, frame_index, method.seed).key
    accumulator = Sectors(
        mapping=method.weighting,
        order=2 if method.directional else 1 if method.bent_normal else 0,
        n_sectors=method.n_sectors,
        rounding=method.sector_rounding,
        arccosine=method.arccosine,
        thickness="along_view" if getattr(thickness, "along", "ray") == "view" else _MODELS[type(thickness)],
        cut=_cut(method, radius),
        orthographic=camera.is_orthographic,
        radius=opaque(g, radius),
        amount=opaque(g, amount),
        isolated=opaque(g, getattr(thickness, "isolated", 0.0)),
        gap=opaque(g, getattr(thickness, "gap", 0.0)),
        key=dr.opaque(g.types.UInt, key),
        linked=isinstance(thickness, MeasuredThickness) if method.linked is None else method.linked,
        layers=_layers(g) if isinstance(thickness, MeasuredThickness) else (),
        size=(camera.width, camera.height),
        types=g.types,
    )
    return march_job(g, method, accumulator, radius, frame_index)


def _cut(method: VisibilityBitmask, radius: Any) -> str:
    if isinstance(method.falloff, SampleCut):
        return "sample"
    return "none" if isinstance(method.falloff, NoCut) or math.isinf(plain(radius)) else "sphere"


def _layers(g: GBuffer) -> tuple[tuple[Any, Any], ...]:
    if g.layers is None:
        raise ConfigError("MeasuredThickness needs a frame with layers; render them with gtao.render.layers")
    return tuple((g.layers.front[k].array, g.layers.back[k].array) for k in range(g.layers.n_layers))
