"""Importance sampling of slices: azimuths about V in proportion to what an open slice holds.

With slices drawn so, the mean of arc / full arc (:func:`gtao.kernels.visible_arc.visible_arc` over
:func:`gtao.kernels.arcs.full_slice`) estimates visibility; every term lies in [0, 1], and an open surface is exactly 1
with a single slice. It pays for one random slice per pixel. Several evenly spaced slices are better left even: their
errors cancel, those of random ones do not.

Γ is the angle between N and V, in [0, π/2]; φ the azimuth of the slice about V, counted from that of N, in [0, π].
"""

import math

import drjit as dr

from . import arcs

__all__ = ["cdf", "density", "sample"]

# From its start value Newton's iteration gains digits as 2e-3, 1e-5, 1e-9, 2e-16 over all tilts and all u.
_ITERATIONS = 4


def density(cos_tilt, sin_tilt, phi):
    """p(φ) = (n_V + γ n_T)/π with n_V = cos Γ, n_T = sin Γ cos φ; its integral over [0, π] is 1 at every tilt.

    The azimuth of directions that are cosine-distributed about N has this density: the full slice of Jimenez et al.
    2016, Eq. 7, open to both sides.
    """
    return arcs.full_slice(cos_tilt, sin_tilt * dr.cos(phi)) * (1 / math.pi)


def cdf(cos_tilt, sin_tilt, phi):
    """F(φ) = (1/π) [atan2(cos Γ sin φ, cos φ) + γ(φ) sin Γ sin φ], γ(φ) = atan2(sin Γ cos φ, cos Γ).

    The integral of :func:`density` from 0 to φ.
    """
    s, c = dr.sincos(phi)
    # π rounded up has a negative sine, on the other side of the arc tangent's cut.
    s = dr.select(s > 0, s, 0)
    gamma = dr.atan2(sin_tilt * c, cos_tilt)
    return dr.fma(gamma, sin_tilt * s, dr.atan2(cos_tilt * s, c)) * (1 / math.pi)


def sample(cos_tilt, sin_tilt, u):
    """φ with F(φ) = u for u in [0, 1], by Newton's iteration on :func:`cdf`.

    F is symmetric about π/2 and on [0, π/2] concave and between φ/π (Γ = 0) and ½ sin φ (Γ = π/2), which brackets the
    root and, mixed by sin Γ, starts the iteration. A step of a concave function never passes the root from the left,
    so that keeping to the bracket is all the safeguard it needs.
    """
    mirrored = u > 0.5
    v = dr.select(mirrored, 1 - u, u)
    low, high = dr.asin(2 * v), math.pi * v
    phi = dr.fma(sin_tilt, low - high, high)
    for _ in range(_ITERATIONS):
        phi = phi - (cdf(cos_tilt, sin_tilt, phi) - v) / density(cos_tilt, sin_tilt, phi)
        # Edge-on the density vanishes at π/2; 0/0 compares false, which leaves the lower bound, the root there.
        phi = dr.select(phi > low, dr.select(phi < high, phi, high), low)
    return dr.select(mirrored, math.pi - phi, phi)
