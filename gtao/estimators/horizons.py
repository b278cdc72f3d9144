"""GTAO's accumulators from its configuration."""

import math
from typing import Any

from gtao.config import (
    GTAO,
    DepthCut,
    IndexFalloff,
    LinearFalloff,
    QuadraticFalloff,
    RunningThickness,
    SampleCut,
    plain,
)
from gtao.errors import ConfigError
from gtao.gbuffer import GBuffer
from gtao.kernels.accumulators import Horizon, SphereCut

from .attached import attached_numbers, is_attached
from .job import Job
from .marching import march_job, opaque
from .soft import softened

__all__ = ["horizon_job"]


def horizon_job(g: GBuffer, method: GTAO, frame_index: int) -> Job:
    """The march of :class:`gtao.GTAO`.

    Raises:
        ConfigError: gradients are asked for beside a baseline that has none.
    """
    if method.bent_normal == "average_horizon" and (g.is_attached or attached_numbers(method)):
        raise ConfigError(
            "bent_normal='average_horizon' is a baseline without derivative; choose bent_normal=True, or detach the"
            " frame, the camera and the options"
        )
    radius = min(method.search_radius, getattr(method.falloff, "end", math.inf))
    exact = method.falloff is None and not math.isinf(plain(radius))
    accumulator = _sphere_cut(g, method, radius) if exact else _horizon(g, method)
    if method.soft_horizon is not None:
        accumulator = softened(accumulator, opaque(g, method.soft_horizon))
    return march_job(g, method, accumulator, radius, frame_index)


def _moments(method: GTAO) -> dict[str, Any]:
    """The accumulators' options about moments."""
    order = 2 if method.directional else 1 if method.bent_normal else 0
    return {"order": order, "bent_normal": "average_horizon" if method.bent_normal == "average_horizon" else "exact"}


def _on(share: Any) -> bool:
    """Whether a heuristic is on: also at zero, if its derivative is asked for."""
    return is_attached(share) or plain(share) > 0


def _sphere_cut(g: GBuffer, method: GTAO, radius: Any) -> SphereCut:
    return SphereCut(
        weighting=method.weighting,
        **_moments(method),
        orthographic=g.camera.is_orthographic,
        blended=_on(method.length_blend),
        arccosine=method.arccosine,
        radius=opaque(g, radius),
        blend=opaque(g, method.length_blend),
    )


def _horizon(g: GBuffer, method: GTAO) -> Horizon:
    falloff, thickness = method.falloff, method.thickness
    kind, scale, offset = "none", 0.0, 0.0
    if isinstance(falloff, LinearFalloff):
        kind, scale = "linear", -1 / (falloff.end - falloff.start)
        offset = -scale * falloff.end
    elif isinstance(falloff, QuadraticFalloff):
        kind, scale, offset = "quadratic", -falloff.strength / falloff.end**2, 1.0
    elif isinstance(falloff, IndexFalloff):
        kind, scale = "index", falloff.strength
    elif isinstance(falloff, SampleCut):
        kind = "sample"
    toward = "horizon" if kind == "index" else getattr(falloff, "toward", "tangent")
    # Horizons that only rise, each time to the sample's own cosine, come out the same from either start.
    moved = toward == "horizon" or isinstance(thickness, RunningThickness)
    models: dict[type, str] = {RunningThickness: "running", DepthCut: "depth_cut"}
    values: dict[str, Any] = {
        "scale": scale,
        "offset": offset,
        "reach": getattr(falloff, "end", 0.0),
        "tau": getattr(thickness, "blend", 0.0),
        "depth": getattr(thickness, "depth", 0.0),
        "stretch": 1 + method.thin_occluder_compensation,
        "blend": method.length_blend,
    }
    return Horizon(
        weighting=method.weighting,
        **_moments(method),
        falloff=kind,
        toward=toward,
        from_tangent=method.horizon_start == "tangent" or not moved,
        thickness=models.get(type(thickness), "none"),
        stretched=_on(method.thin_occluder_compensation),
        blended=_on(method.length_blend),
        arccosine=method.arccosine,
        orthographic=g.camera.is_orthographic,
        **{name: opaque(g, value) for name, value in values.items()},
    )
