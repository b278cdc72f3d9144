"""From a frame and the options of a slice method to the arguments of the march."""

import math
from typing import Any

import drjit as dr

from gtao.config import LinearFalloff, SliceMethod, plain
from gtao.gbuffer import GBuffer
from gtao.kernels import noise, pyramid
from gtao.kernels.march_types import Scalars, Switches
from gtao.tensors import scalar

from .attached import is_attached
from .job import Job
from .noise_inputs import noise_inputs
from .without_derivative import refuse_what_has_no_derivative

__all__ = ["march_job", "opaque"]

#: A search limited to a share of the frame is limited to this many pixels at least.
SHORTEST_SHARE_PX = 16.0

#: Share of the radius over which nearer texels of a weighted pyramid fade out, where no linear falloff says it.
DEFAULT_RANGE = 0.615

_INTERPOLATING = ("linear", "bilinear")


def opaque(g: GBuffer, value: Any):
    """A kernel input of width one; see :func:`gtao.tensors.scalar`."""
    return scalar(value, g.types.Float)


def _longest_px(g: GBuffer, method: SliceMethod) -> Any:
    """Upper limit of the search in pixels."""
    limit = math.inf if method.max_radius_px is None else method.max_radius_px
    if method.max_radius_share is None:
        return limit
    return min(limit, max(SHORTEST_SHARE_PX, method.max_radius_share * math.sqrt(g.shape[0] * g.shape[1])))


def _switches(g: GBuffer, method: Any, *, unlimited: bool) -> Switches:
    height, width = g.shape
    # There is nothing to interpolate across a single row or column.
    interpolates = method.fetch in _INTERPOLATING and min(width, height) > 1
    return Switches(
        width=width,
        height=height,
        orthographic=g.camera.is_orthographic,
        n_slices=method.n_slices,
        n_steps=method.n_steps,
        slice_measure=method.slice_measure,
        slice_angles=method.slice_angles,
        zenith=method.zenith,
        fetch=method.fetch if interpolates or method.fetch not in _INTERPOLATING else "nearest",
        snap_to_texel=method.snap_to_texel,
        noise=method.noise,
        # A number is worth a kernel of its own; who varies it gives a Dr.Jit float.
        step_exponent=None if dr.is_array_v(method.step_exponent) else plain(method.step_exponent),
        step_law=method.step_law,
        step_jitter=method.step_jitter,
        border=method.border,
        pyramid=None if method.pyramid is None else pyramid.Table.of(width, height, method.pyramid.n_levels),
        unlimited=unlimited,
        clamp_px=not math.isinf(plain(_longest_px(g, method))),
        square_pixels=_square_pixels(g.camera),
        pulled=is_attached(method.depth_bias) or plain(method.depth_bias) > 0,
        meets_itself=not _keeps_off(method),
    )


def _keeps_off(method: SliceMethod) -> bool:
    """Whether samples that snap to texels are known to be other ones than the pixel's own."""
    # From this distance on, in whatever direction, one coordinate is rounded away from the pixel's.
    away = plain(method.min_step_px) > math.sqrt(0.5)
    law = method.step_law in ("strata", "offset", "at_least")
    return away and law and method.fetch != "floor" and method.border != "clamp"


def _square_pixels(camera: Any) -> bool:
    """Whether pixels are known to be square to the last digit of single precision."""
    known = not (dr.is_array_v(camera.fx) or dr.is_array_v(camera.fy))
    return known and math.isclose(camera.fx, camera.fy, rel_tol=1e-7)


def _scalars(g: GBuffer, method: SliceMethod, radius: Any, frame_index: int) -> Scalars:
    camera, T = g.camera, g.types
    terms = noise.frame_terms(method.noise, frame_index, method.seed)
    values = {
        "ax": 1 / camera.fx,
        "bx": (0.5 - camera.cx) / camera.fx,
        "ay": -1 / camera.fy,
        "by": (camera.cy - 0.5) / camera.fy,
        "fx": camera.fx,
        "fy": camera.fy,
        "radius": radius,
        "step_exponent": method.step_exponent,
        "min_step_px": method.min_step_px,
        "max_radius_px": _longest_px(g, method),
        "level_scale": 1.0 if method.pyramid is None else 2 ** (0.5 - method.pyramid.level_offset),
        "pull": 1 - method.depth_bias,
        "frame_rotation": terms.frame_rotation,
        "frame_offset": terms.frame_offset,
    }
    return Scalars(
        **{name: opaque(g, value) for name, value in values.items()},
        **noise_inputs(method.noise, terms, T.UInt),
    )


def _near_and_far(method: Any) -> tuple[float, float]:
    """Depth differences between which the weighted filter of a pyramid lets go of nearer texels."""
    if method.pyramid.filter != "weighted":
        return 0.0, 1.0  # not looked at, so that every radius may share one pyramid
    radius, falloff = method.search_radius, getattr(method, "falloff", None)
    start, end = (1 - DEFAULT_RANGE) * radius, radius
    if isinstance(falloff, LinearFalloff):
        start, end = falloff.start, falloff.end
    return pyramid.RANGE_FACTOR * start, pyramid.RANGE_FACTOR * end


def march_job(g: GBuffer, method: Any, accumulator: Any, radius: Any, frame_index: int) -> Job:
    """What gives the mean over slices of what ``accumulator`` makes of each; see :class:`gtao.kernels.march.March`.

    Args:
        method: a configuration derived from :class:`gtao.config.SliceMethod`.
        radius: how far the search reaches in scene units; ``inf`` for as far as the frame.

    Raises:
        ConfigError: gradients are asked for an option that has none, or through more steps per side than can be
            unrolled.
    """
    switches = _switches(g, method, unlimited=math.isinf(plain(radius)))
    refuse_what_has_no_derivative(method, switches)
    field = g.view_z.array
    if switches.pyramid is not None:
        field = g.depth_pyramid(switches.pyramid, method.pyramid.filter, *_near_and_far(method))
    elif switches.fetch in _INTERPOLATING:
        field = g.affine_field()
        # The sign marks depth edges, which "bilinear" does not know.
        field = abs(field) if switches.fetch == "bilinear" else field
    normal, unit = g.normals_to_be_normalised()
    scalars = _scalars(g, method, radius, frame_index)
    return Job(g.view_z.array, normal, unit, field, accumulator, switches, scalars, g.types)
