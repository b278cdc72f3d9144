"""What is integrated over a cone: the two terms of GGX with Schlick's Fresnel term, or any BRDF times cosine."""

from collections.abc import Callable
from typing import Any

import drjit as dr

from .brdf_rings import Axis

__all__ = ["Integrand", "ggx_terms", "terms_of"]

#: Function of an axis and the displacement of a direction from ω_r to its channels.
Integrand = Callable[[Axis, Any, Any, Any], tuple[Any, ...]]


def ggx_terms(axis: Axis, dx: Any, dy: Any, dz: Any) -> tuple[Any, Any]:
    """(a, b) of f_r cos θ_i = F₀ a + b, theory, eqs. (135) to (137), from the displacement: no lobe is too narrow."""
    z, q = axis.c + dz, dr.fma(2, axis.c, dz)
    z = dr.select(z > 0, z, 0)
    a2 = axis.alpha * axis.alpha
    across = dr.fma(dx, dx, dy * dy)
    h2 = dr.fma(q, q, across)
    peak = axis.alpha * h2 / dr.fma(a2 * q, q, across)
    total = axis.c * dr.sqrt(dr.fma(1 - a2, z * z, a2)) + z * dr.sqrt(dr.fma(1 - a2, axis.c * axis.c, a2))
    lobe = (0.5 / dr.pi) * peak * peak * z / (total + 1e-300)
    m = 1 - 0.5 * dr.sqrt(h2)
    k = dr.square(dr.square(m)) * m
    return lobe - lobe * k, lobe * k


def terms_of(brdf: Callable[[Any, Any], Any]) -> Integrand:
    """One channel, a function of the directions to the light and to the camera (n = z) that returns f_r cos θ_i.

    The function gets arrays of double precision and returns one, or what converts to it. It is traced, not called for
    every direction: it may only use operations of Dr.Jit.
    """

    def terms(axis: Axis, dx: Any, dy: Any, dz: Any) -> tuple[Any]:
        Float = type(dx)
        Array = dr.replace_shape_t(Float, (3, -1))
        wi, wo = Array(dx + axis.s, dy, dz + axis.c), Array(-axis.s, Float(0), axis.c)
        return (Float(brdf(wi, wo)),)

    return terms
