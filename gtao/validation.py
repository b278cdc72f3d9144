"""What may be wrong with the arrays of a frame: found in one pass over its pixels, explained only if there is any."""

from typing import Any

import drjit as dr

from .errors import ConfigError, ShapeError
from .layers import DepthLayers
from .tensors import to_tensor

__all__ = ["check", "check_layers", "motion_tensor"]

#: Largest tolerated deviation of a normal's length from 1; half-float buffers reach 1e-3.
UNIT_TOLERANCE = 5e-3
#: Depths whose squares neither overflow nor vanish in float32.
NEAREST, FARTHEST = 1e-12, 1e12
#: The first layer of the frame is its depth, up to the rounding of a conversion.
LAYER_TOLERANCE = 1e-6


def check_layers(layers: Any, view_z: Any) -> DepthLayers:
    """``layers``, which have to be of the size and precision of the frame.

    Raises:
        ShapeError: they are not, or no layers at all.
    """
    if not isinstance(layers, DepthLayers):
        raise ShapeError(f"layers must be gtao.DepthLayers, got {type(layers).__name__}")
    (height, width), (rows, columns) = layers.shape[1:], view_z.shape
    if (height, width) != (rows, columns):
        raise ShapeError(f"the layers are of a frame of {width}x{height}, not {columns}x{rows}")
    if type(layers.front) is not type(view_z):
        raise ShapeError("the layers and view_z must both be single or both be double precision")
    return layers


def motion_tensor(motion: Any, view_z: Any) -> Any:
    """``motion`` as a tensor of the frame's precision.

    Raises:
        ShapeError: it has neither two nor three channels, or another size.
    """
    shape = tuple(getattr(motion, "shape", ()))
    return to_tensor(motion, "motion", (*view_z.shape, 2 if shape[2:] == (2,) else 3), like=type(view_z))


def check(view_z: Any, normal: Any, albedo: Any, layers: DepthLayers | None, also: Any, *, motion: Any = None) -> None:
    """Evaluate ``also`` together with one flag per pixel that says whether anything is wrong there.

    Args:
        view_z: tensor of depth.
        normal: flat normals, or None.
        albedo: tensor of albedo, or None.
        layers: the depth layers of the frame, or None.
        also: array that is needed anyway, evaluated by the same kernel; or None.
        motion: tensor of motion, or None.

    Raises:
        ConfigError: a function is being recorded by ``dr.freeze``, so that there are no values yet.
        ShapeError: depth is NaN, not positive or beyond 1e-12 … 1e12; the normal of a surface is not finite or not
            unit; albedo is not in [0, 1]; motion is not finite; the first layer does not begin at the depth.
    """
    if dr.flag(dr.JitFlag.FreezingScope):
        raise ConfigError("inside dr.freeze no value can be looked at; make the frame with validate=False")
    view_z = dr.detach(view_z.array)
    normal, albedo = _channels(normal), _channels(None if albedo is None else albedo.array)
    motion = None if motion is None else _channels(motion.array, motion.shape[2])
    front = None if layers is None else _first(layers.front.array, dr.width(view_z))
    surface = dr.isfinite(view_z)
    bad = ~((view_z >= NEAREST) & ((view_z <= FARTHEST) | (view_z == dr.inf)))
    length = None if normal is None else dr.norm(normal)
    if length is not None:
        bad |= surface & ~(abs(length - 1) <= UNIT_TOLERANCE)
    if albedo is not None:
        for a in albedo:
            bad |= _outside(a)
    if motion is not None:
        for m in motion:
            bad |= ~dr.isfinite(m)
    if front is not None:
        bad |= _elsewhere(front, view_z)
    dr.eval(bad, also)
    if not dr.any(bad):
        return
    _explain_depth(view_z, surface)
    if length is not None:
        _explain_normals(length, surface)
    if albedo is not None:
        n_wrong = sum(dr.count(_outside(a))[0] for a in albedo)
        if n_wrong:
            raise ShapeError(f"albedo must be in [0, 1]: {n_wrong} values are not")
    if motion is not None:
        n_wrong = sum(dr.count(~dr.isfinite(m))[0] for m in motion)
        if n_wrong:
            raise ShapeError(
                f"motion must be finite: {n_wrong} values are not; where a point was behind the previous camera, give"
                " any motion that leads out of the frame"
            )
    raise ShapeError(
        f"the first layer must begin at view_z, but does not at {dr.count(_elsewhere(front, view_z))[0]} pixels; are"
        " they one view?"
    )


def _channels(flat, n=3):
    return None if flat is None else dr.detach(dr.unravel(dr.replace_shape_t(type(flat), (n, -1)), flat))


def _first(flat, n):
    """The first ``n`` numbers."""
    return dr.gather(type(flat), dr.detach(flat), dr.arange(dr.uint32_array_t(type(flat)), n))


def _outside(albedo):
    return ~((albedo >= 0) & (albedo <= 1))


def _elsewhere(front, view_z):
    """Where the first layer does not begin at the depth; both are infinite on the background."""
    near = dr.isfinite(view_z) & (abs(front - view_z) <= LAYER_TOLERANCE * view_z)
    return ~((front == view_z) | near)


def _example(values, where):
    return dr.gather(type(values), values, dr.compress(where)[0])[0]


def _explain_depth(z, surface) -> None:
    n_nan, n_bad = dr.count(dr.isnan(z))[0], dr.count(z <= 0)[0]
    if n_nan:
        raise ShapeError(f"view_z is NaN at {n_nan} pixels; mark the background with inf and repair the rest")
    if n_bad:
        raise ShapeError(
            f"view_z must be positive (distance in front of the camera), got {n_bad} pixels down to {dr.min(z)[0]:g};"
            " mark the background with inf"
        )
    beyond = surface & ((z < NEAREST) | (z > FARTHEST))
    if dr.any(beyond):
        raise ShapeError(
            f"view_z must lie between {NEAREST:g} and {FARTHEST:g}, got {_example(z, beyond):g} among"
            f" {dr.count(beyond)[0]} pixels; mark the background with inf, or choose another unit of length"
        )


def _explain_normals(length, surface) -> None:
    wild = surface & ~dr.isfinite(length)
    if dr.any(wild):
        raise ShapeError(f"normal_v is not finite at {dr.count(wild)[0]} surface pixels")
    off = surface & (abs(length - 1) > UNIT_TOLERANCE)
    if dr.any(off):
        raise ShapeError(
            f"normal_v must be unit vectors: {dr.count(off)[0]} surface pixels are not"
            f" (a length of {_example(length, off):.4g}); normalise them first"
        )
