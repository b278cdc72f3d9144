"""From a frame and the options of a slice method to the arguments of the march."""

import math
from typing import Any

import drjit as dr

from gtao.config import LinearFalloff, SliceMethod
from gtao.errors import ConfigError
from gtao.gbuffer import GBuffer
from gtao.kernels import march, noise, pyramid, steps

__all__ = ["march_frame", "opaque"]

#: A search limited to a share of the frame is limited to this many pixels at least.
SHORTEST_SHARE_PX = 16.0

#: Share of the radius over which nearer texels of a weighted pyramid fade out, where no linear falloff says it.
DEFAULT_RANGE = 0.615

_INTERPOLATING = ("linear", "bilinear")


def opaque(g: GBuffer, value: float):
    """A kernel input of width one: a literal would be baked into the kernel, and every new value compile it again."""
    return dr.opaque(g.types.Float, float(value))


def _longest_px(g: GBuffer, method: SliceMethod) -> float:
    """Upper limit of the search in pixels."""
    limit = math.inf if method.max_radius_px is None else float(method.max_radius_px)
    if method.max_radius_share is None:
        return limit
    return min(limit, max(SHORTEST_SHARE_PX, method.max_radius_share * math.sqrt(g.shape[0] * g.shape[1])))


def _switches(g: GBuffer, method: Any, *, unlimited: bool) -> march.Switches:
    height, width = g.shape
    # There is nothing to interpolate across a single row or column.
    interpolates = method.fetch in _INTERPOLATING and min(width, height) > 1
    return march.Switches(
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
        step_exponent=float(method.step_exponent),
        step_law=method.step_law,
        step_jitter=method.step_jitter,
        border=method.border,
        pyramid=None if method.pyramid is None else pyramid.Table.of(width, height, method.pyramid.n_levels),
        unlimited=unlimited,
        clamp_px=not math.isinf(_longest_px(g, method)),
        pulled=method.depth_bias > 0,
    )


def _scalars(g: GBuffer, method: SliceMethod, radius: float, frame_index: int) -> march.Scalars:
    camera, T = g.camera, g.types
    rotation, offset, key = noise.frame_terms(method.noise, frame_index, method.seed)
    values = {
        "ax": 1 / camera.fx,
        "bx": (0.5 - camera.cx) / camera.fx,
        "ay": -1 / camera.fy,
        "by": (camera.cy - 0.5) / camera.fy,
        "fx": camera.fx,
        "fy": camera.fy,
        "radius": radius,
        "min_step_px": method.min_step_px,
        "max_radius_px": _longest_px(g, method),
        "level_scale": 1.0 if method.pyramid is None else 2 ** (0.5 - method.pyramid.level_offset),
        "pull": 1 - method.depth_bias,
        "frame_rotation": rotation,
        "frame_offset": offset,
    }
    return march.Scalars(**{name: opaque(g, value) for name, value in values.items()}, key=dr.opaque(T.UInt, key))


def _near_and_far(method: Any) -> tuple[float, float]:
    """Depth differences between which the weighted filter of a pyramid lets go of nearer texels."""
    if method.pyramid.filter != "weighted":
        return 0.0, 1.0  # not looked at, so that every radius may share one pyramid
    radius, falloff = method.search_radius, getattr(method, "falloff", None)
    start, end = (1 - DEFAULT_RANGE) * radius, radius
    if isinstance(falloff, LinearFalloff):
        start, end = falloff.start, falloff.end
    return pyramid.RANGE_FACTOR * start, pyramid.RANGE_FACTOR * end


def march_frame(g: GBuffer, method: Any, accumulator: Any, radius: float, frame_index: int):
    """The mean over slices of what ``accumulator`` makes of each, flat; see :func:`gtao.kernels.march.march`.

    Args:
        method: a configuration derived from :class:`gtao.config.SliceMethod`.
        radius: how far the search reaches in scene units; ``inf`` for as far as the frame.

    Raises:
        ConfigError: gradients are asked through more steps per side than can be unrolled.
    """
    switches = _switches(g, method, unlimited=math.isinf(radius))
    if not switches.differentiable and (dr.grad_enabled(g.view_z) or dr.grad_enabled(g.normal_v)):
        raise ConfigError(
            f"gradients need all steps in one block: choose n_steps <= {steps.MAX_UNROLLED}, got {method.n_steps}"
        )
    field = g.view_z.array
    if switches.pyramid is not None:
        field = g.depth_pyramid(switches.pyramid, method.pyramid.filter, *_near_and_far(method))
    elif switches.fetch in _INTERPOLATING:
        field = g.affine_field()
        # The sign marks depth edges, which "bilinear" does not know.
        field = abs(field) if switches.fetch == "bilinear" else field
    n = g.normal_arrays()
    scalars = _scalars(g, method, radius, frame_index)
    return march.march(g.view_z.array, field, (n.x, n.y, n.z), accumulator, switches, scalars, g.types)
