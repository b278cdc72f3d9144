"""What surfaces reflect of the light that reaches them."""

import math
from typing import Any

import drjit as dr

from gtao import backend
from gtao.errors import ShapeError
from gtao.planes import Planes
from gtao.tensors import scalar, to_tensor

__all__ = ["diffuse_radiance"]


def diffuse_radiance(irradiance: Any, albedo: Any) -> Any:
    """Radiance that a Lambertian surface reflects, ρ/π E (theory, eq. (111)).

    The memo ATVI-TR-19-01 leaves the factor ρ/π out.

    Args:
        irradiance: (H, W) or (H, W, C), of :func:`gtao.irradiance`.
        albedo: (H, W) or (H, W, C) diffuse albedo in [0, 1], or one number for all pixels.

    Returns:
        (H, W, C) tensor, or (H, W) where neither has channels; gradients flow to both.

    Raises:
        ShapeError: shapes do not match, or an albedo lies outside [0, 1].
    """
    backend.require()
    shape = tuple(getattr(irradiance, "shape", ()))
    if len(shape) not in (2, 3):
        raise ShapeError(f"irradiance must be (H, W) or (H, W, C), got {shape if shape else type(irradiance).__name__}")
    E = to_tensor(irradiance, "irradiance", shape, copy=False)
    if not getattr(albedo, "shape", ()) or tuple(albedo.shape) == (1,):
        return _number(E, albedo)
    given = tuple(albedo.shape)
    if len(given) not in (2, 3) or given[:2] != shape[:2] or (len(given) == len(shape) and given != shape):
        raise ShapeError(f"albedo must be a number, {shape[:2]} or {(*shape[:2], 'C')} for an irradiance of {shape}")
    rho = to_tensor(albedo, "albedo", given, like=type(E), copy=False)
    _check(rho.array)
    if given == shape:
        return type(E)(E.array * rho.array * (1 / math.pi), shape)
    wide, grey = (E, rho) if len(shape) == 3 else (rho, E)
    channels = tuple(c * grey.array * (1 / math.pi) for c in Planes.of(wide).arrays)
    return Planes(channels, shape[:2]).tensor()


def _number(E: Any, albedo: Any) -> Any:
    if not (isinstance(albedo, int | float) or dr.is_array_v(albedo)) or isinstance(albedo, bool):
        raise ShapeError(f"albedo must be an array or a number, got {type(albedo).__name__}")
    rho = scalar(albedo, dr.leaf_t(type(E)))
    _check(rho)
    return type(E)(E.array * rho * (1 / math.pi), tuple(E.shape))


def _check(rho: Any) -> None:
    if dr.flag(dr.JitFlag.FreezingScope):
        return
    wrong = ~((dr.detach(rho) >= 0) & (dr.detach(rho) <= 1))
    if dr.any(wrong):
        raise ShapeError(f"albedo must be in [0, 1]: {dr.count(wrong)[0]} values are not")
