"""From irradiance, pre-filtered light and occlusion to the radiance that reaches the viewer."""

import math
from typing import Any

import drjit as dr

from gtao import backend
from gtao.data.multibounce import JIMENEZ2016, MultibounceFit
from gtao.errors import ConfigError, ShapeError
from gtao.gbuffer import GBuffer
from gtao.planes import Planes
from gtao.results import AmbientOcclusion
from gtao.tensors import one_number, scalar, to_tensor

from .estimate import check_frame
from .multibounce import multibounce
from .specular import environment_terms, reflection_of
from .specular_pixels import View, shares

__all__ = ["reflected_directions", "shade", "specular_radiance"]


def reflected_directions(g: GBuffer, view_to_world: Any = None) -> Any:
    """Where a mirror at every pixel looks: directions to look pre-filtered light up in.

    Args:
        g: the frame. Normals that face away from the viewer are turned until they are seen edge-on, as for
            :func:`specular_occlusion`.
        view_to_world: 4x4 or 3x3 matrix of the camera, as ``gtao.render.view_to_world`` gives it; None leaves the
            directions in the view frame.

    Returns:
        (H, W, 3) tensor of unit vectors in the precision of ``g``; on the background of some direction or other.
        Gradients flow to normals.

    Raises:
        ConfigError: ``g`` is no frame.
        ShapeError: the matrix has another shape.
    """
    backend.require()
    check_frame(g)
    w = View.of(g, 0.0).reflected
    if view_to_world is not None:
        shape = tuple(map(int, getattr(view_to_world, "shape", ())))
        if shape not in ((3, 3), (4, 4)):
            what = shape if shape else type(view_to_world).__name__
            raise ShapeError(f"view_to_world must be a 3x3 or 4x4 matrix, got {what}")
        rows = [[scalar(float(view_to_world[i, j]), g.types.Float) for j in range(3)] for i in range(3)]
        w = tuple(a * w[0] + b * w[1] + c * w[2] for a, b, c in rows)
    return Planes(w, g.shape).tensor()


def specular_radiance(occlusion: Any, prefiltered_radiance: Any, g: GBuffer, roughness: Any, f0: Any = 0.04) -> Any:
    """Radiance that a glossy surface reflects to the viewer, S (F0 A + B) L; theory, eq. (141).

    With the occlusion of :func:`gtao.specular_occlusion` this is the composite of GTSO; with the share of a symmetric
    lobe that is visible, the composite of three splits; with 1, the split-integral approximation (Karis 2013).

    Args:
        occlusion: S: (H, W) or (H, W, 3), or a number, 1 for none.
        prefiltered_radiance: L, the mean radiance in the lobe about the reflected direction, from
            :meth:`gtao.lighting.PrefilteredEnvironment.lookup` at :func:`reflected_directions`: (H, W, 3) or (H, W),
            or a number.
        g: the frame.
        roughness: perceptual roughness in [0, 1]: a number or (H, W).
        f0: reflectance at normal incidence in [0, 1]: a number, (3,), (H, W) or (H, W, 3).

    Returns:
        (H, W, 3) tensor of linear RGB, in the units of L and the precision of ``g``; 0 on the background. Gradients
        flow to all arguments and to normals.

    Raises:
        ConfigError: ``g`` is no frame.
        ShapeError: an array has another shape, or roughness or F0 lie outside of [0, 1].
    """
    backend.require()
    check_frame(g)
    S = _colours(occlusion, "occlusion", g)
    L = _colours(prefiltered_radiance, "prefiltered_radiance", g)
    A, B = environment_terms(View.of(g, roughness), g.types)
    F = [dr.fma(f, A, B) for f in _three(shares(f0, "f0", g))]
    return _image([s * f * light for s, f, light in zip(S, F, L, strict=True)], g)


def shade(
    ao: AmbientOcclusion,
    g: GBuffer,
    irradiance: Any,
    prefiltered_radiance: Any,
    roughness: Any,
    f0: Any = 0.04,
    *,
    albedo: Any = None,
    method: Any = None,
    fit: MultibounceFit | None = JIMENEZ2016,
) -> Any:
    """Radiance toward the viewer of diffuse surfaces under a glossy coat, (1 - F) ρ/π E G + F S L.

    Jimenez et al. 2016, Eq. 4, with the probe's radiance for light from everywhere; theory, eq. (142). F = F0 A + B is
    what the coat reflects of a white dome; the rest reaches the diffuse layer. No light is made: under a white dome
    the result is at most 1 in all channels. Metals have albedo 0 and coloured F0.

    Args:
        ao: an estimate of the frame, with what ``method`` needs; its visibility must be cosine-weighted, or uniform
            with bent normals, which know both.
        g: the frame.
        irradiance: E, (H, W, 3) or (H, W), or a number: on open surfaces with these normals, as
            :meth:`gtao.lighting.EnvironmentMap.irradiance` has it, which is multiplied by multi-bounce visibility; or
            with ``fit=None`` through the occluders, as :func:`gtao.irradiance` has it, which is taken as it is.
        prefiltered_radiance: L, as of :func:`gtao.specular_radiance`.
        roughness: perceptual roughness of the coat in [0, 1]: a number or (H, W).
        f0: its reflectance at normal incidence in [0, 1]: a number, (3,), (H, W) or (H, W, 3).
        albedo: ρ of the diffuse layer in [0, 1]: a number, (3,), (H, W) or (H, W, 3); by default the frame's.
        method: of :func:`gtao.specular_occlusion`.
        fit: multi-bounce visibility G(A, ρ) of :func:`gtao.multibounce`, or None where E has its occlusion already.

    Returns:
        (H, W, 3) tensor of linear RGB in the precision of ``g``; 0 on the background. Gradients flow to all arguments,
        to the estimate's arrays and to normals.

    Raises:
        ConfigError: there is no albedo; the estimate does not hold what is needed; ``method`` or ``fit`` is none.
        ShapeError: the estimate is not of this frame, an array has another shape, or roughness, F0 or albedo lie
            outside of [0, 1].
    """
    reflection = reflection_of(ao, g, roughness, method)
    L = _colours(prefiltered_radiance, "prefiltered_radiance", g)
    E = _colours(irradiance, "irradiance", g)
    if albedo is None and g.albedo is None:
        raise ConfigError("the frame has no albedo; give GBuffer one, or pass albedo=")
    rho = _three(shares(g.albedo if albedo is None else albedo, "albedo", g))
    if fit is not None:
        E = [e * bounces for e, bounces in zip(E, _bounced(ao, g, rho, fit), strict=True)]
    channels = [
        dr.fma((1 - reflection.unoccluded(f)) * (1 / math.pi) * r, e, reflection.reflectance(f) * light)
        for f, r, e, light in zip(_three(shares(f0, "f0", g)), rho, E, L, strict=True)
    ]
    return _image(channels, g)


def _bounced(ao: AmbientOcclusion, g: GBuffer, rho: list[Any], fit: MultibounceFit) -> list[Any]:
    """Multi-bounce visibility in every channel."""
    A = ao.cosine_visibility
    if A is None:
        raise ConfigError(
            "multi-bounce visibility needs cosine-weighted visibility; estimate with weighting='cosine', with"
            " bent_normal=True, or give irradiance that knows its occlusion and fit=None"
        )
    wide = [r + dr.zeros(g.types.Float, g.shape[0] * g.shape[1]) for r in rho]
    return [multibounce(A, g.types.Tensor(r, g.shape), fit).array for r in wide]


def _colours(value: Any, name: str, g: GBuffer) -> list[Any]:
    """Flat arrays of red, green and blue, from an image with or without channels, or a number."""
    shape = tuple(map(int, getattr(value, "shape", ())))
    number = one_number(value)
    if number is not None:
        return [scalar(number, g.types.Float)] * 3
    if shape not in (g.shape, (*g.shape, 3)):
        what = shape if shape else type(value).__name__
        raise ShapeError(f"{name} must be a number or have shape {g.shape} or {(*g.shape, 3)}, got {what}")
    tensor = to_tensor(value, name, shape, like=g.types.Tensor, copy=False)
    return [tensor.array] * 3 if len(shape) == 2 else list(Planes.of(tensor).arrays)


def _three(channels: list[Any]) -> list[Any]:
    return channels * (3 // len(channels))


def _image(channels: list[Any], g: GBuffer) -> Any:
    return Planes(tuple(dr.select(g.mask.array, c, 0) for c in channels), g.shape).tensor()
