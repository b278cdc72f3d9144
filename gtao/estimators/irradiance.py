"""Light from afar on occluded surfaces."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import drjit as dr

from gtao import backend
from gtao.config import (
    BentNormalIrradiance,
    ClippedCone,
    ConeSH,
    MomentZH,
    OcclusionTimesIrradiance,
    SliceMoments,
    TripleProduct,
)
from gtao.errors import ConfigError, ShapeError
from gtao.gbuffer import GBuffer
from gtao.kernels import cones, gaunt
from gtao.kernels.clipped_cone import clipped_cone, tilt
from gtao.kernels.sh import CLAMPED_COSINE, basis, cone, cone_cosine, to_moments, zonal
from gtao.planes import Planes
from gtao.results import AmbientOcclusion
from gtao.tensors import to_tensor

from .estimate import check_estimate

__all__ = ["irradiance"]


def irradiance(sh: Any, g: GBuffer, ao: AmbientOcclusion, method: Any = None) -> Any:
    """Irradiance of every pixel under distant light, given in spherical harmonics, through what occludes it.

    E = Σ L_lm V'_lm with the harmonics V'_lm of visibility times cosine (theory, eq. (111)), which the methods
    approximate in different ways. A Lambertian surface reflects ρ/π of it: :func:`gtao.diffuse_radiance`.

    Args:
        sh: (n,) or (n, C) coefficients of radiance in the view frame, n = 1, 4, 9, 16 or 25, in the order and with
            the signs of :mod:`gtao.lighting` (no Condon-Shortley phase), whose ``to_view`` turns them. Arrays of NumPy,
            PyTorch, JAX or Dr.Jit; gradients of Dr.Jit's flow.
        g: the frame.
        ao: an estimate of that frame, with the directions that the method needs. It is evaluated, if it has not been.
        method: :class:`gtao.SliceMoments` (the default), :class:`gtao.MomentZH`, :class:`gtao.ConeSH`,
            :class:`gtao.ClippedCone`, :class:`gtao.TripleProduct`, :class:`gtao.BentNormalIrradiance` or
            :class:`gtao.OcclusionTimesIrradiance`.

    Returns:
        (H, W) or (H, W, C) tensor in the precision of ``g``, in the units of the light times steradians; 0 on the
        background. Not clamped: light that was cut to few bands may be negative in places. Lazily evaluated in one
        kernel. Gradients flow to the estimate's arrays, normals and light, where they are attached.

    Raises:
        ConfigError: ``method`` is no method of irradiance, or needs another estimate; ``g`` is no frame or ``ao`` no
            estimate.
        ShapeError: the estimate is not of this frame; the light has another shape, or numbers that are not finite.
    """
    backend.require()
    method = SliceMoments() if method is None else method
    project = _METHODS.get(type(method))
    if project is None:
        choices = ", ".join(f"gtao.{kind.__name__}" for kind in _METHODS)
        raise ConfigError(f"method must be one of {choices}, got {type(method).__name__}")
    check_estimate(ao, g)
    _check_needs(method, ao)
    coefficients, n_bands, n_channels = _light(sh, g)
    order = min(method.order, n_bands - 1)
    pixels = _Pixels.of(g, ao)
    projected = project(pixels, method, order)
    surface = g.mask.array
    channels = []
    for channel in range(n_channels or 1):
        total = g.types.Float(0)
        for i in range((order + 1) ** 2):
            total = dr.fma(coefficients(i * (n_channels or 1) + channel), projected[i], total)
        channels.append(dr.select(surface, total, 0))
    return Planes(tuple(channels), g.shape).tensor() if n_channels else g.types.Tensor(channels[0], g.shape)


def _check_needs(method: Any, ao: AmbientOcclusion) -> None:
    """Raise a ConfigError where the estimate does not hold what the method computes from."""
    name, config = type(method).__name__, ao.config
    weighting = getattr(config, "weighting", "cosine")
    if isinstance(method, OcclusionTimesIrradiance):
        return
    if isinstance(method, SliceMoments) and ao.planes("visibility_sh") is None:
        raise ConfigError(
            f"{name} needs an estimate with directional=True, whose visibility_sh it sums; this one has none"
        )
    if not isinstance(method, SliceMoments) and ao.planes("mean_direction") is None:
        raise ConfigError(f"{name} needs an estimate with bent_normal=True, or directional=True; this one has neither")
    if isinstance(method, SliceMoments | MomentZH) and weighting != "cosine":
        raise ConfigError(
            f"{name} needs an estimate with weighting='cosine': its moments are of visibility times cosine, and this"
            f" one has weighting {weighting!r}"
        )
    if isinstance(method, MomentZH) and getattr(config, "bent_normal", None) == "average_horizon":
        raise ConfigError(
            f"{name} needs the length of the mean direction, which 'average_horizon' does not have; estimate with"
            " bent_normal=True"
        )
    if isinstance(method, ClippedCone | ConeSH) and method.aperture == "matched" and weighting != "cosine":
        raise ConfigError(
            f"matching the aperture of {name} needs cosine-weighted visibility, and this estimate has weighting"
            f" {weighting!r}; choose aperture='seed'"
        )
    if isinstance(method, ClippedCone | ConeSH | TripleProduct) and weighting not in ("cosine", "uniform"):
        raise ConfigError(
            f"{name} needs an estimate with cosine or uniform weighting to find an aperture from, not {weighting!r}"
        )


def _light(value: Any, g: GBuffer) -> tuple[Callable[[int], Any], int, int | None]:
    """Function from an index to a coefficient, the number of bands, and of channels if there is an axis of them."""
    shape = tuple(map(int, getattr(value, "shape", ())))
    n = shape[0] if len(shape) in (1, 2) and 0 not in shape else 0
    n_bands = math.isqrt(n)
    if n_bands**2 != n or not 1 <= n_bands <= 5:
        raise ShapeError(
            "sh must be an array of shape (n,) or (n, C) with n = 1, 4, 9, 16 or 25 coefficients, got"
            f" {shape if shape else type(value).__name__}"
        )
    T = g.types
    flat = to_tensor(value, "sh", shape, like=T.Tensor).array
    if not dr.flag(dr.JitFlag.FreezingScope) and not dr.all(dr.isfinite(dr.detach(flat))):
        raise ShapeError("the coefficients in sh must be finite")
    # With a gradient each pixel reads a coefficient for itself: what they all add to it then comes together in the
    # kernel of the backward pass, not in a sum of its own.
    zero = dr.opaque(T.UInt, 0)
    if dr.grad_enabled(flat):
        zero = zero + dr.zeros(T.UInt, g.shape[0] * g.shape[1])
    return lambda i: dr.gather(T.Float, flat, zero + i), n_bands, shape[1] if len(shape) == 2 else None


@dataclass(frozen=True)
class _Pixels:
    """What the methods know of each pixel: flat arrays.

    Attributes:
        A: visibility.
        whole: the visibility that belongs to the mean direction.
        B: (x, y, z) of the mean direction, or None.
        v: the nine harmonics of visibility times cosine, or None.
        n: (x, y, z) of the normal.
        uniform: whether A and B are weighted by solid angle.
    """

    A: Any
    whole: Any
    B: Any
    v: Any
    n: Any
    uniform: bool

    @classmethod
    def of(cls, g: GBuffer, ao: AmbientOcclusion) -> "_Pixels":
        Float = g.types.Float
        directions, harmonics = (ao.planes(name) for name in ("mean_direction", "visibility_sh"))
        # What is still to be estimated would be estimated once more by everybody who looks at it.
        dr.eval([v.arrays if isinstance(v, Planes) else v for v in vars(ao).values() if v is not ao.config])
        B, v = (None if p is None else tuple(Float(a) for a in p.arrays) for p in (directions, harmonics))
        uniform = getattr(ao.config, "weighting", "cosine") == "uniform"
        A = Float(ao.visibility.array)
        whole = A if ao.unshaped is None else Float(ao.unshaped.array)
        return cls(A, whole, B, v, tuple(g.normal_arrays()), uniform)

    def axis(self):
        """Unit mean direction, the normal where there is none, and the length."""
        length2 = sum(b * b for b in self.B)
        seen = length2 > 0
        length = dr.sqrt(dr.select(seen, length2, 1))
        b = tuple(dr.select(seen, k / length, n) for k, n in zip(self.B, self.n, strict=True))
        return b, dr.select(seen, length, 0)

    def aperture(self) -> Any:
        """cos α of a cone about the normal."""
        return cones.uniform_aperture(self.A) if self.uniform else cones.aperture(self.A)


def _slice_moments(p: _Pixels, method: SliceMoments, order: int):
    if order <= 2:
        return p.v
    m0, m1, _ = to_moments(p.v)
    mean = {"whole": m0 * (1 / math.pi), "B": tuple(m * (1 / math.pi) for m in m1)}
    guess = _moment_zh(replace(p, **mean), MomentZH(order=order), order)
    return [*p.v, *guess[9:]]


def _moment_zh(p: _Pixels, method: MomentZH, order: int):
    b, length = p.axis()
    kernel = cone_cosine(math.pi * p.whole, cones.equivalent_cone(p.whole, length), order)
    projected = zonal(kernel, basis(*b, order))
    # Band 1 is the mean direction itself.
    band1 = [math.sqrt(3 * math.pi) / 2 * p.B[axis] for axis in (1, 2, 0)]
    return [*projected[:1], *band1, *projected[4:]]


def _cone_sh(p: _Pixels, method: ConeSH, order: int):
    b, _ = p.axis()
    if method.aperture == "seed":
        x = p.aperture()
        energy = math.pi * (1 - x * x) if p.uniform else math.pi * p.A
    else:
        cb, sb, _ = tilt(p.n, b)
        x, energy = cones.matched_aperture(p.A, cb, sb), math.pi * p.A
        x = dr.select(x > 0, x, 0)
    return zonal(cone_cosine(energy, x, order), basis(*b, order))


def _clipped_cone(p: _Pixels, method: ClippedCone, order: int):
    b, _ = p.axis()
    cb, sb, f = tilt(p.n, b)
    c = p.aperture() if method.aperture == "seed" else cones.matched_aperture(p.A, cb, sb)
    return clipped_cone(p.n, c, cb, sb, f, order)


def _triple_product(p: _Pixels, method: TripleProduct, order: int):
    b, _ = p.axis()
    own = method.order
    visible = zonal(cone(p.aperture(), own), basis(*b, own))
    return gaunt.product(visible, zonal(CLAMPED_COSINE[: own + 1], basis(*p.n, own)), own, order)


def _facing(p: _Pixels, axis: Any, order: int):
    """Visibility times the clamped cosine to an axis."""
    return zonal([p.A * K for K in CLAMPED_COSINE[: order + 1]], basis(*axis, order))


#: The coefficients V'_lm of every pixel up to an order, by method.
_METHODS: dict[type, Callable[[_Pixels, Any, int], Any]] = {
    SliceMoments: _slice_moments,
    MomentZH: _moment_zh,
    ConeSH: _cone_sh,
    ClippedCone: _clipped_cone,
    TripleProduct: _triple_product,
    BentNormalIrradiance: lambda p, method, order: _facing(p, p.axis()[0], order),
    OcclusionTimesIrradiance: lambda p, method, order: _facing(p, p.n, order),
}
