"""What methods of specular occlusion know of each pixel: visibility, directions and the angles between them."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import drjit as dr

from gtao.errors import ShapeError
from gtao.gbuffer import GBuffer
from gtao.kernels import cones
from gtao.kernels.clipped_cone import tilt
from gtao.kernels.shaded_point import edge_on
from gtao.planes import Planes
from gtao.results import AmbientOcclusion
from gtao.surface import view_directions
from gtao.tensors import one_number, scalar, to_tensor

__all__ = ["Pixels", "View", "image_or_number", "limited", "shares", "spread"]


@dataclass(frozen=True)
class View:
    """How each pixel is seen: flat arrays.

    Attributes:
        n: (x, y, z) of the normal, turned until it is seen edge-on where it faces away.
        v: (x, y, z) of the direction to the viewer.
        nv: their cosine, positive.
        roughness: perceptual, in [0, 1].
    """

    n: tuple[Any, ...]
    v: tuple[Any, ...]
    nv: Any
    roughness: Any

    @classmethod
    def of(cls, g: GBuffer, roughness: Any) -> "View":
        roughness = spread(image_or_number(roughness, "roughness", g, g.shape), g)
        v = tuple(view_directions(g.camera, g.types))
        n, nv = edge_on(tuple(g.normal_arrays()), v)
        return cls(n, v, nv, roughness)

    @cached_property
    def alpha(self) -> Any:
        """Microfacet width."""
        return self.roughness * self.roughness

    @cached_property
    def theta_o(self) -> Any:
        """Angle between normal and view direction."""
        return _angle(self.n, self.v)

    @cached_property
    def reflected(self) -> tuple[Any, ...]:
        """The view direction mirrored at the normal."""
        return tuple(dr.fma(2 * self.nv, n, -v) for n, v in zip(self.n, self.v, strict=True))


@dataclass(frozen=True)
class Pixels:
    """A pixel's view and its estimate: flat arrays.

    Attributes:
        view: how it is seen.
        A: visibility, in [0, 1].
        diffuse: cosine-weighted visibility, in [0, 1], where the estimate knows it; else as it is weighted.
        b: unit mean direction, the normal where there is none; None of estimates without directions.
        uniform: whether visibility and directions are weighted by solid angle.
    """

    view: View
    A: Any
    diffuse: Any
    b: tuple[Any, ...] | None
    uniform: bool

    @classmethod
    def of(cls, g: GBuffer, ao: AmbientOcclusion, view: View) -> "Pixels":
        Float = g.types.Float
        directions = ao.planes("mean_direction")
        # What is still to be estimated would be estimated once more by everybody who looks at it.
        dr.eval([v.arrays if isinstance(v, Planes) else v for v in vars(ao).values() if v is not ao.config])
        uniform = getattr(ao.config, "weighting", "cosine") == "uniform"
        b, own = None, ao.visibility
        if directions is not None:
            own = ao.visibility if ao.unshaped is None else ao.unshaped
            b = _unit(tuple(Float(a) for a in directions.arrays), view.n)
        diffuse = ao.cosine_visibility
        A, diffuse = (limited(Float(x.array)) for x in (own, ao.visibility if diffuse is None else diffuse))
        return cls(view, A, diffuse, b, uniform)

    def alpha_v(self, aperture: str) -> Any:
        """Half angle of the visibility cone."""
        c = self._cosine(aperture)
        return dr.atan2(cones.root(dr.fma(-c, c, 1)), c)

    def _cosine(self, aperture: str) -> Any:
        if aperture == "matched":
            cb, sb, _ = tilt(self.view.n, self.b)
            match = cones.matched_uniform_aperture if self.uniform else cones.matched_aperture
            return match(self.A, cb, sb)
        if self.uniform:
            return cones.uniform_aperture(self.A)
        return (
            cones.aperture(self.A) if aperture == "seed" else cones.tilted_aperture(self.A, _dot(self.view.n, self.b))
        )

    @cached_property
    def beta(self) -> Any:
        """Angle between mean and reflected direction."""
        return _angle(self.b, self.view.reflected)

    @cached_property
    def tilted(self) -> Any:
        """Angle between mean and reflected direction, at most ½π: between normal and viewer if the former is both."""
        return dr.select(self.beta < 0.5 * math.pi, self.beta, 0.5 * math.pi)

    @cached_property
    def chi(self) -> Any:
        """Azimuth, in [0, π], of the mean direction about the reflected one, 0 toward the normal."""
        w, n = self.view.reflected, self.view.n
        across, along = _dot(self.b, _cross(w, n)), dr.fma(-_dot(self.b, w), self.view.nv, _dot(self.b, n))
        return dr.atan2(_length((across,)), along)


def image_or_number(value: Any, name: str, g: GBuffer, *shapes: tuple[int, ...]) -> Any:
    """Flat array of a number, or of an array of one of some shapes, with values in [0, 1]; gradients stay.

    Raises:
        ShapeError: it is something else, or a value lies outside of [0, 1].
    """
    T = g.types
    shape = tuple(map(int, getattr(value, "shape", ())))
    if shape in ((), (1,)):
        number = one_number(value)
        if number is None:
            raise ShapeError(f"{name} must be a number or an array, got {type(value).__name__}")
        flat = scalar(number, T.Float)
    elif shape not in shapes:
        choices = ", ".join(map(str, shapes))
        raise ShapeError(f"{name} must be a number or have shape {choices}, got {shape}")
    else:
        flat = to_tensor(value, name, shape, like=T.Tensor, copy=False).array
    if not dr.flag(dr.JitFlag.FreezingScope):
        values = dr.detach(flat)
        wrong = ~((values >= 0) & (values <= 1))
        if dr.any(wrong):
            raise ShapeError(f"{name} must be in [0, 1]: {dr.count(wrong)[0]} value(s) are not")
    return flat


def shares(value: Any, name: str, g: GBuffer) -> list[Any]:
    """One flat array, or three where there are channels, of a number, (3,), (H, W) or (H, W, 3) in [0, 1].

    Raises:
        ShapeError: it is something else, or a value lies outside of [0, 1].
    """
    image = (*g.shape, 3)
    flat = image_or_number(value, name, g, (3,), g.shape, image)
    shape = tuple(map(int, getattr(value, "shape", ())))
    if shape == image:
        return list(Planes.of(g.types.Tensor(flat, image)).arrays)
    if shape == (3,):
        return [spread(dr.gather(g.types.Float, flat, dr.opaque(g.types.UInt, k)), g) for k in range(3)]
    return [spread(flat, g)]


def spread(number: Any, g: GBuffer) -> Any:
    """A number that every pixel reads for itself if it carries a gradient.

    What they all add to it then comes together in the kernel of the backward pass, not in a sum of its own.
    """
    if dr.width(number) != 1 or not dr.grad_enabled(number):
        return number
    zero = dr.opaque(g.types.UInt, 0) + dr.zeros(g.types.UInt, g.shape[0] * g.shape[1])
    return dr.gather(g.types.Float, number, zero)


def limited(x: Any) -> Any:
    """``x``, 0 below 0 and 1 above 1."""
    x = dr.select(x > 0, x, 0)
    return dr.select(x < 1, x, 1)


def _unit(B, fallback):
    length2 = _dot(B, B)
    seen = length2 > 0
    length = dr.sqrt(dr.select(seen, length2, 1))
    return tuple(dr.select(seen, k / length, n) for k, n in zip(B, fallback, strict=True))


def _angle(a, b):
    """Between unit vectors, in [0, π]; its derivative, which is that of a distance, is 0 at 0 and at π."""
    return dr.atan2(_length(_cross(a, b)), _dot(a, b))


def _length(x):
    length2 = sum(k * k for k in x)
    # Below, nothing but rounding.
    some = length2 > 1e-24
    return dr.select(some, dr.sqrt(dr.select(some, length2, 1)), 0)


def _cross(a, b):
    (ax, ay, az), (bx, by, bz) = a, b
    return dr.fma(ay, bz, -az * by), dr.fma(az, bx, -ax * bz), dr.fma(ax, by, -ay * bx)


def _dot(a, b):
    return dr.fma(a[0], b[0], dr.fma(a[1], b[1], a[2] * b[2]))
