"""Rings about the axis of a cone: the directions at one angle t from it.

A ring has the azimuth φ, 0 towards the reflected direction ω_r. What counts of a direction ω is its displacement
d = ω - ω_r; it is computed without the directions themselves, so that lobes of any width keep their digits.
"""

from typing import Any, NamedTuple

import drjit as dr

__all__ = ["Axis", "Ring", "axis_of", "displacement", "ring_of", "spread"]


class Axis(NamedTuple):
    """Axis b of a cone about a point that is seen from ω_o = (-s, 0, c); the normal is z, and ω_r = (s, 0, c).

    The frame of its rings is b, the direction from there towards ω_r, and the one across the incidence plane if b lies
    in it: ``n_b, n_1, n_2`` are the coordinates of the normal, ``o_1, o_2`` two of those of ω_o. ``theta_b`` is the
    angle between normal and axis, ``h`` its sine.
    """

    alpha: Any
    s: Any
    c: Any
    sin_beta: Any
    cos_beta: Any
    sin_chi: Any
    cos_chi: Any
    n_b: Any
    n_1: Any
    n_2: Any
    h: Any
    theta_b: Any
    o_1: Any
    o_2: Any


class Ring(NamedTuple):
    """The directions at t = β + tb from an axis. ``along`` and ``up`` are the displacement at φ = 0, in its frame."""

    axis: Axis
    sin_t: Any
    cos_t: Any
    t: Any
    along: Any
    up: Any


def axis_of(beta: Any, alpha: Any, theta_o: Any, chi: Any, in_plane: bool) -> Axis:
    """From the angles, in radians, and the width of the lobe.

    Args:
        in_plane: every axis lies in the incidence plane, and ``chi`` is 0 or π.
    """
    (s, c), (sin_beta, cos_beta), (sin_chi, cos_chi) = dr.sincos(theta_o), dr.sincos(beta), dr.sincos(chi)
    if in_plane:
        sin_chi, cos_chi = 0, dr.select(cos_chi > 0, type(cos_chi)(1), -1)
    n_b = dr.fma(cos_beta, c, sin_beta * s * cos_chi)
    n_1 = dr.fma(sin_beta, c, -cos_beta * s * cos_chi)
    n_2 = -s * sin_chi
    h = abs(n_1) if in_plane else dr.sqrt(n_1 * n_1 + n_2 * n_2)
    o_1, o_2 = 2 * c * n_1 - sin_beta, 2 * c * n_2
    theta_b = dr.atan2(h, n_b)
    return Axis(alpha, s, c, sin_beta, cos_beta, sin_chi, cos_chi, n_b, n_1, n_2, h, theta_b, o_1, o_2)


def ring_of(axis: Axis, t: Any, tb: Any) -> Ring:
    """The ring at t, whose difference tb to β is known without rounding."""
    sin_t, cos_t = dr.sincos(t)
    half = dr.sin(0.5 * tb)
    return Ring(axis, sin_t, cos_t, t, -2 * half * half, -dr.sin(tb))


def displacement(ring: Ring, phi: Any) -> tuple[Any, Any, Any]:
    """d = ω - ω_r in the frame of the normal, theory, eq. (159)."""
    axis = ring.axis
    sin_half, cos_half = dr.sincos(0.5 * phi)
    side = 2 * ring.sin_t * sin_half
    off, side = side * sin_half, side * cos_half
    along, up = dr.fma(-off, axis.sin_beta, ring.along), dr.fma(off, axis.cos_beta, ring.up)
    tilt = axis.cos_chi * up - axis.sin_chi * side
    return (
        axis.s * along - axis.c * tilt,
        axis.sin_chi * up + axis.cos_chi * side,
        dr.fma(axis.c, along, axis.s * tilt),
    )


def spread(ring: Ring, phi: Any) -> Any:
    """|ω_o + ω|² (1 - (1 - α²) cos² θ_h) of the half vector: GGX is its inverse square but for smooth factors."""
    dx, dy, dz = displacement(ring, phi)
    q = ring.axis.alpha * dr.fma(2, ring.axis.c, dz)
    return dr.fma(dx, dx, dr.fma(dy, dy, q * q))
