"""Image-level driver of the occlusion kernels."""

import math
from collections.abc import Callable
from typing import Any

import drjit as dr

from gtao.config import GTAO, HBAO, HeightfieldHorizon, HeightfieldRayMarch, VisibilityBitmask
from gtao.errors import ConfigError
from gtao.gbuffer import GBuffer
from gtao.planes import Planes
from gtao.results import AmbientOcclusion

from .adjoint import estimate
from .bitmask import bitmask_job
from .estimate import check_frame_index
from .hbao import hbao_job
from .heightfield import horizon_truth, march_truth
from .horizons import horizon_job
from .job import Job
from .shaped import is_shaped, shaped

__all__ = ["JOBS", "ambient_occlusion"]

#: The march of each method that has slices: from a frame, a configuration and the number of the frame.
JOBS: dict[type, Callable[[GBuffer, Any, int], Job]] = {
    GTAO: horizon_job,
    HBAO: hbao_job,
    VisibilityBitmask: bitmask_job,
}
# What makes the flat visibility of each other method, and the directions it was asked for; of Monte Carlo methods with
# the variance of the visibility.
_TRUTHS: dict[type, Callable[..., Any]] = {HeightfieldHorizon: horizon_truth}
_MONTE_CARLO: dict[type, Callable[..., tuple[Any, Any]]] = {HeightfieldRayMarch: march_truth}


# Normalisation of the real spherical harmonics of bands 0 and 1.
_Y0, _Y1 = math.sqrt(1 / math.pi) / 2, math.sqrt(3 / math.pi) / 2


def ambient_occlusion(
    g: GBuffer, method: Any = None, *, frame_index: int = 0, max_pixels: int | None = None
) -> AmbientOcclusion:
    """Visibility of every pixel, estimated from depth and normals alone.

    Args:
        g: the frame.
        method: a strategy object; ``GTAO()`` if left out.
        frame_index: position in the temporal noise sequence, at least 0.
        max_pixels: estimate bands of rows one after the other, of at most so many pixels each but one row at least.
            The result is the same; its gradients then need no memory for what the search found, but a second search.
            Not for the ground truths.

    Returns:
        The visibility as an (H, W) tensor in the precision of ``g`` and the directions that the method was asked for,
        lazily evaluated in one kernel; from Monte Carlo methods with its variance, all evaluated; evaluated as well if
        anything carries gradients or in bands.

    Gradients flow to depth, normals, numbers of the camera and continuous options, in reverse and in forward mode, if
    they were enabled before the frame was made. They are those of the samples that define the horizons (theory, eq.
    (88)), and of every sample where the horizon depends on all of them (a running thickness, an index falloff, a
    falloff toward the horizon, HBAO's attenuation by sample, soft horizons).

    Raises:
        ConfigError: ``method`` is no strategy object, ``frame_index`` is negative, ``max_pixels`` is not positive or
            asked of a ground truth; or gradients are asked of a ground truth, a bitmask, an option that has none, or
            through more samples than can be unrolled.
    """
    method = GTAO() if method is None else method
    kinds = JOBS | _TRUTHS | _MONTE_CARLO
    if type(method) not in kinds:
        choices = ", ".join(f"gtao.{kind.__name__}" for kind in kinds)
        raise ConfigError(f"method must be one of {choices}, got {type(method).__name__}")
    if not isinstance(g, GBuffer):
        raise ConfigError(f"g must be a gtao.GBuffer, got {type(g).__name__}")
    check_frame_index(frame_index)
    if max_pixels is not None and (isinstance(max_pixels, bool) or not isinstance(max_pixels, int) or max_pixels < 1):
        raise ConfigError(f"max_pixels must be a positive integer or None, got {max_pixels!r}")
    if max_pixels is not None and type(method) not in JOBS:
        raise ConfigError(f"{type(method).__name__} estimates whole frames: leave max_pixels out")
    variance = None
    if type(method) in _MONTE_CARLO:
        (flat, *directions), variance = _MONTE_CARLO[type(method)](g, method, frame_index)
        variance = g.types.Tensor(variance, g.shape)
    elif type(method) in _TRUTHS:
        flat, *directions = _TRUTHS[type(method)](g, method, frame_index)
    else:
        flat, *directions = estimate(JOBS[type(method)](g, method, frame_index), max_pixels)
    mean_direction, visibility_sh = _directions(flat, directions, g, method)
    unshaped = None
    if is_shaped(method):
        unshaped = g.types.Tensor(flat, g.shape) if directions else None
        flat = shaped(flat, g, method)
    return AmbientOcclusion(
        visibility=g.types.Tensor(flat, g.shape),
        mean_direction=mean_direction,
        visibility_sh=visibility_sh,
        normal_v=g.normal_v if directions else None,
        unshaped=unshaped,
        variance=variance,
        config=method,
    )


def _directions(flat: Any, directions: Any, g: GBuffer, method: Any) -> tuple[Planes | None, Planes | None]:
    """Mean direction and harmonics from what :meth:`gtao.kernels.march.March.mean` returns."""
    if not directions:
        return None, None
    B, band2 = tuple(directions[:3]), directions[3:]
    if not band2:
        return Planes(B, g.shape), None
    # Means over slices are integrals over π, or 2π.
    unit = math.pi if method.weighting == "cosine" else 2 * math.pi
    band0 = dr.select(g.mask.array, flat * (unit * _Y0), 0)
    x, y, z = (b * (unit * _Y1) for b in B)
    return Planes(B, g.shape), Planes((band0, y, z, x, *(b * unit for b in band2)), g.shape)
