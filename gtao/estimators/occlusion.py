"""Image-level driver of the occlusion kernels."""

import math

import drjit as dr

from gtao.config import GTAO
from gtao.errors import ConfigError
from gtao.gbuffer import GBuffer
from gtao.kernels import noise
from gtao.kernels.visibility import MAX_UNROLLED_STEPS, Scalars, Switches, visibility
from gtao.results import AmbientOcclusion

__all__ = ["ambient_occlusion"]


def _switches(g: GBuffer, method: GTAO) -> Switches:
    height, width = g.shape
    return Switches(
        width=width,
        height=height,
        orthographic=g.camera.is_orthographic,
        n_slices=method.n_slices,
        n_steps=method.n_steps,
        weighting=method.weighting,
        slice_measure=method.slice_measure,
        # There is nothing to interpolate across a single row or column.
        fetch=method.fetch if min(width, height) > 1 else "nearest",
        snap_to_texel=method.snap_to_texel,
        noise=method.noise,
        step_exponent=float(method.step_exponent),
        unlimited=math.isinf(method.radius) and method.falloff is None,
        falloff=method.falloff is not None,
        clamp_px=method.max_radius_px is not None,
    )


def _scalars(g: GBuffer, method: GTAO, frame_index: int) -> Scalars:
    camera, T = g.camera, g.types
    rotation, offset, key = noise.frame_terms(method.noise, frame_index, method.seed)
    radius, scale, bias = method.radius, 0.0, 0.0
    if method.falloff is not None:
        start, end = float(method.falloff.start), float(method.falloff.end)
        radius = min(radius, end)
        scale, bias = -1 / (end - start), end / (end - start)
    values = {
        "ax": 1 / camera.fx,
        "bx": (0.5 - camera.cx) / camera.fx,
        "ay": -1 / camera.fy,
        "by": (camera.cy - 0.5) / camera.fy,
        "fx": camera.fx,
        "fy": camera.fy,
        "radius": float(radius),
        "falloff_scale": scale,
        "falloff_offset": bias,
        "max_radius_px": math.inf if method.max_radius_px is None else float(method.max_radius_px),
        "frame_rotation": rotation,
        "frame_offset": offset,
    }
    # Literals would be baked into the kernel, and every new value would compile it again.
    opaque = {name: dr.opaque(T.Float, value) for name, value in values.items()}
    return Scalars(**opaque, key=dr.opaque(T.UInt, key))


def ambient_occlusion(g: GBuffer, method: GTAO | None = None, *, frame_index: int = 0) -> AmbientOcclusion:
    """Visibility of every pixel, estimated from depth and normals alone.

    Args:
        g: the frame.
        method: a strategy object; ``GTAO()`` if left out.
        frame_index: position in the temporal noise sequence, at least 0.

    Returns:
        The visibility as an (H, W) tensor in the precision of ``g``; lazily evaluated, in one kernel.

    Raises:
        ConfigError: ``method`` is no strategy object, ``frame_index`` is negative, or gradients are asked through
            more steps per side than can be unrolled.
    """
    method = GTAO() if method is None else method
    if not isinstance(method, GTAO):
        raise ConfigError(f"method must be a gtao.GTAO, got {type(method).__name__}")
    if not isinstance(g, GBuffer):
        raise ConfigError(f"g must be a gtao.GBuffer, got {type(g).__name__}")
    if isinstance(frame_index, bool) or not isinstance(frame_index, int) or frame_index < 0:
        raise ConfigError(f"frame_index must be a non-negative integer, got {frame_index!r}")
    switches = _switches(g, method)
    if not switches.differentiable and (dr.grad_enabled(g.view_z) or dr.grad_enabled(g.normal_v)):
        raise ConfigError(
            f"gradients need all steps in one block: choose n_steps <= {MAX_UNROLLED_STEPS}, got {method.n_steps}"
        )
    field = g.affine_field() if switches.fetch == "linear" else None
    n = g.normal_arrays()
    flat = visibility(g.view_z.array, field, (n.x, n.y, n.z), switches, _scalars(g, method, frame_index), g.types)
    return AmbientOcclusion(visibility=g.types.Tensor(flat, g.shape), config=method)
