"""What a microfacet surface reflects of a white dome: the two terms of its albedo, by quadrature."""

import functools
import math
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from gtao.kernels.microfacet import LEAST_ALPHA, schlick, smith_visibility

__all__ = ["hemisphere_terms"]

#: Gauss nodes of each half of the azimuth and of the polar angle: error below 2e-7 for all widths from 1e-4 to 1.
N_AZIMUTH, N_POLAR = 16, 24
# Powers that crowd the nodes: towards the azimuth where, seen edge-on, normals begin to reflect into the ground, and
# towards the polar angle from which they do.
AZIMUTH_POWER, POLAR_POWER = 3, 4


def hemisphere_terms(cos_o: Any, alpha: Any) -> tuple[Any, Any]:
    """The terms A and B of the reflected share F0 A + B of a white dome (theory, eqs. (143) and (144)).

    Args:
        cos_o: cosine of the angle between normal and view direction, in [1e-3, 1]; flat float array.
        alpha: microfacet width, in [0, 1]; below 1e-4 it counts as that.

    Returns:
        Two flat arrays of ``mitsuba.Float64``.
    """
    co, al = mi.Float64(cos_o), mi.Float64(alpha)
    al = dr.select(al > LEAST_ALPHA, al, LEAST_ALPHA)
    sin_o = dr.safe_sqrt(dr.fma(-co, co, 1))
    cos_phi, d_phi = (mi.Float64(row) for row in _azimuth())
    polar = _polar()
    n = dr.opaque(mi.UInt32, dr.width(d_phi))

    def more(i: Any, A: Any, B: Any) -> Any:
        return i < n

    def body(i: Any, A: Any, B: Any) -> tuple:
        c = sin_o * dr.gather(mi.Float64, cos_phi, i)
        # tan θ = α tan ξ spreads half vectors by the distribution; the last one reflects along the horizon.
        last = (dr.sqrt(dr.fma(co, co, c * c)) - c) / (al * co)
        last = last / (1 + dr.sqrt(dr.fma(last, last, 1)))
        a, b = mi.Float64(0), mi.Float64(0)
        for share, weight in polar:
            # q = tan ξ/2 makes all of it algebraic.
            q = last * share
            p2, m2 = dr.fma(q, q, 1), dr.fma(-q, q, 1)
            t = 2 * al * q / m2
            h2 = 1 / dr.fma(t, t, 1)
            slope = dr.fma(-c, t, co)
            ci = dr.fma(2 * h2, slope, -co)
            ci = dr.select(ci > 0, ci, 0)
            f = weight * slope * q * m2 / (p2 * p2 * p2) * ci * smith_visibility(ci, co, al)
            k = schlick(slope * dr.sqrt(h2))
            a, b = dr.fma(f, 1 - k, a), dr.fma(f, k, b)
        scale = last * dr.gather(mi.Float64, d_phi, i)
        return i + 1, dr.fma(scale, a, A), dr.fma(scale, b, B)

    zero = dr.zeros(mi.Float64, max(dr.width(co), dr.width(al)))
    state = (dr.zeros(mi.UInt32, dr.width(zero)), zero, mi.Float64(zero))
    _, A, B = dr.while_loop(state, more, body, labels=("i", "A", "B"))
    return A, B


@functools.cache
def _azimuth() -> np.ndarray:
    """Rows: cosine of the azimuth, and dφ."""
    y, w = _gauss(N_AZIMUTH)
    off, d_off = 0.5 * math.pi * y**AZIMUTH_POWER, 0.5 * math.pi * AZIMUTH_POWER * y ** (AZIMUTH_POWER - 1) * w
    return np.stack([np.concatenate([np.sin(off), -np.sin(off)]), np.tile(d_off, 2)])


@functools.cache
def _polar() -> tuple[tuple[float, float], ...]:
    """Pairs of tan ξ/2 over its last value, and the weight with all constants."""
    y, w = _gauss(N_POLAR)
    share, d_share = 1 - y**POLAR_POWER, POLAR_POWER * y ** (POLAR_POWER - 1) * w
    # D cos θ dω = 2 sin ξ cos ξ dξ dφ / 2π, dω_i = 4 ⟨v, h⟩ dω, both halves of the azimuth are alike, and
    # sin ξ cos ξ dξ = 4 q (1 - q²) / (1 + q²)³ dq.
    return tuple(zip(share.tolist(), (32 / math.pi * d_share).tolist(), strict=True))


def _gauss(n: int) -> tuple[np.ndarray, np.ndarray]:
    x, w = np.polynomial.legendre.leggauss(n)
    return 0.5 * (x + 1), 0.5 * w
