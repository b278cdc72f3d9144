"""From a frame and the options of a slice method to the arguments of the march."""

import math
from typing import Any

import drjit as dr

from gtao.config import SliceMethod
from gtao.errors import ConfigError
from gtao.gbuffer import GBuffer
from gtao.kernels import march, noise

__all__ = ["march_frame", "opaque"]


def opaque(g: GBuffer, value: float):
    """A kernel input of width one: a literal would be baked into the kernel, and every new value compile it again."""
    return dr.opaque(g.types.Float, float(value))


def _switches(g: GBuffer, method: Any, *, unlimited: bool) -> march.Switches:
    height, width = g.shape
    return march.Switches(
        width=width,
        height=height,
        orthographic=g.camera.is_orthographic,
        n_slices=method.n_slices,
        n_steps=method.n_steps,
        slice_measure=method.slice_measure,
        zenith=method.zenith,
        # There is nothing to interpolate across a single row or column.
        fetch=method.fetch if min(width, height) > 1 else "nearest",
        snap_to_texel=method.snap_to_texel,
        noise=method.noise,
        step_exponent=float(method.step_exponent),
        unlimited=unlimited,
        clamp_px=method.max_radius_px is not None,
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
        "max_radius_px": math.inf if method.max_radius_px is None else method.max_radius_px,
        "pull": 1 - method.depth_bias,
        "frame_rotation": rotation,
        "frame_offset": offset,
    }
    return march.Scalars(**{name: opaque(g, value) for name, value in values.items()}, key=dr.opaque(T.UInt, key))


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
            f"gradients need all steps in one block: choose n_steps <= {march.MAX_UNROLLED_STEPS}, got {method.n_steps}"
        )
    field = g.affine_field() if switches.fetch == "linear" else None
    n = g.normal_arrays()
    scalars = _scalars(g, method, radius, frame_index)
    return march.march(g.view_z.array, field, (n.x, n.y, n.z), accumulator, switches, scalars, g.types)
