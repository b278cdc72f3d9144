"""Slices about the view vector and the screen directions that march along them.

The depth-buffer line through a pixel is a plane through the eye, so every screen line is a slice. Azimuths that are
uniform in the image are however not uniform about V off the optical axis. :class:`SliceFrame` therefore starts from
azimuths about V (measure "view", exact) and derives the screen direction; :class:`ScreenFrame` does what the papers
print (measure "screen": image azimuths, no Jacobian).
"""

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr

from .roots import rsqrt

__all__ = [
    "BOUNDLESS",
    "ScreenFrame",
    "SliceFrame",
    "clamped_arc",
    "clamped_start",
    "frame",
    "listed",
    "minimal_rotation",
]

#: Stands for the tangent of an angle of 90° and more.
BOUNDLESS = 1e6


@dataclass(frozen=True)
class SliceFrame:
    """Per-pixel constants of the exact slice measure; V looks to the camera, V_z > 0."""

    V: tuple[Any, Any, Any]
    k: tuple[Any, Any]  # V_xy / (1 + V_z)
    g: tuple[Any, Any]  # V_xy / (V_z (1 + V_z))
    n: tuple[Any, Any, Any]
    n_k: Any  # ⟨N, (k, 1)⟩

    @classmethod
    def at(cls, V, n):
        Vx, Vy, Vz = V
        r = 1 / (1 + Vz)
        k = (Vx * r, Vy * r)
        r = r / Vz
        return cls(V, k, (Vx * r, Vy * r), n, dr.fma(n[0], k[0], dr.fma(n[1], k[1], n[2])))

    def tangent(self, c, s):
        """Unit tangent T(φ) ⊥ V for (c, s) = (cos φ, sin φ): the minimal rotation of (c, s, 0) from z to V.

        It is theory, eq. (18).
        """
        d = self._d(c, s)
        return dr.fma(-d, self.k[0], c), dr.fma(-d, self.k[1], s), -d

    def _d(self, c, s):
        return dr.fma(c, self.V[0], s * self.V[1])

    def azimuth(self, c, s):
        """(cos, sin) of the azimuth about V whose tangent this is."""
        return c, s

    def normal_and_direction(self, c, s):
        """⟨N, T⟩ and the direction to march in, in units of the image plane at distance 1 (x right, y up).

        The direction is T_xy - T_z P_xy / P_z (theory, eq. (19)) and its length matters: a step of τ along it is a
        rotation about the eye by arctan(τ V_z / (1 - τ d)) toward T (eq. (22)).
        """
        d = self._d(c, s)
        nT = dr.fma(-d, self.n_k, dr.fma(c, self.n[0], s * self.n[1]))
        return nT, dr.fma(d, self.g[0], c), dr.fma(d, self.g[1], s)

    def extents(self, m, c, s):
        """How far the two sides of the slice see a sphere about P, in units of the marching direction.

        The two are theory, eq. (23).

        Args:
            m: tangent of the angle under which the eye sees the sphere's radius; ``BOUNDLESS`` from inside of it.

        Returns:
            Extents toward -T and +T; infinite where the sphere reaches behind the image plane's horizon.
        """
        d = self._d(c, s)
        a, b = dr.fma(-m, d, self.V[2]), dr.fma(m, d, self.V[2])
        # m / a and m / b by one division; at most one of a and b is not positive.
        share = m / (a * b)
        e0, e1 = share * b, share * a
        outside = m < BOUNDLESS
        return dr.select(outside & (e0 > 0), e0, dr.inf), dr.select(outside & (e1 > 0), e1, dr.inf)


@dataclass(frozen=True)
class ScreenFrame:
    """The published measure: directions uniform in the image, tangent = their projection orthogonal to V.

    Slices lack the weight of theory, eq. (20); the bias of an open surface is eq. (21).

    Attributes:
        normalised: False projects the normal along ``cross(direction, V)`` as it is, no unit vector off the optical
            axis. What is left of the normal then leans out of the slice, and the angle γ of the listing, an arc
            cosine of ⟨N, V⟩ over its length, is too large (theory, eq. (64)).
    """

    V: tuple[Any, Any, Any]
    n: tuple[Any, Any, Any]
    nV: Any
    normalised: bool = True

    @classmethod
    def at(cls, V, n, nV, normalised=True):
        return cls(V, n, nV, normalised)

    def tangent(self, c, s):
        """Unit tangent of image direction (c, s); the published listings forget to normalise it."""
        d = self._d(c, s)
        r = rsqrt(dr.fma(-d, d, 1))
        return dr.fma(-d, self.V[0], c) * r, dr.fma(-d, self.V[1], s) * r, -d * self.V[2] * r

    def _d(self, c, s):
        return dr.fma(c, self.V[0], s * self.V[1])

    def azimuth(self, c, s):
        """(cos, sin) of the azimuth about V of the slice along an image direction; see :class:`SliceFrame`."""
        Tx, Ty, Tz = self.tangent(c, s)
        turn = Tz / (1 + self.V[2])
        return dr.fma(-turn, self.V[0], Tx), dr.fma(-turn, self.V[1], Ty)

    def normal_and_direction(self, c, s):
        d = self._d(c, s)
        nT = dr.fma(-d, self.nV, dr.fma(c, self.n[0], s * self.n[1])) * rsqrt(dr.fma(-d, d, 1))
        if not self.normalised:
            across2 = 1 - dr.fma(nT, nT, self.nV * self.nV)
            across = dr.select(across2 > 0, across2, 0) * (d * d) * (d * d)
            nT = dr.copysign(dr.sqrt(dr.fma(nT, nT, across)), nT)
        return nT, c, s

    def jacobian(self, c, s):
        """dφ_V/dφ = V_z / (1 - ⟨D, V⟩²): azimuth about V per image azimuth of D = (c, s, 0); its mean over φ is 1.

        Weighting each slice by it makes slices that are even in the image exact; ATVI-TR-19-01 leaves it out.
        """
        d = self._d(c, s)
        return self.V[2] / dr.fma(-d, d, 1)

    def extents(self, m, c, s):
        """The published radius: the same in every direction."""
        return m, m


def frame(measure, V, n, nV):
    """The frame of slice measure "view", "screen" or "screen_unnormalised"."""
    return SliceFrame.at(V, n) if measure == "view" else ScreenFrame.at(V, n, nV, measure == "screen")


def listed(values, i, Float):
    """Element ``i`` of a short tuple of numbers."""
    chosen = Float(values[0])
    for number, value in enumerate(values[1:], start=1):
        chosen = dr.select(i == number, value, chosen)
    return chosen


def clamped_start(nV, nT, relief=0.0):
    """Start values (c0, c1) of the horizon search: the tangent plane, cos(γ ∓ π/2) = ± n_T / |n_p| (theory, eq. (9)).

    Searching upwards from there leaves horizons that are already clamped to the normal's hemisphere (eq. (8)).

    Args:
        relief: angle above the tangent plane, in radians, to give the cosines of instead.
    """
    rcp = rsqrt(dr.fma(nT, nT, nV * nV))
    s = nT * rcp
    if relief == 0:
        return s, -s
    up, along = math.sin(relief) * nV * rcp, math.cos(relief) * s
    return up + along, up - along


def clamped_arc(nV, nT, h0, h1):
    """Signed horizons clamped to the normal's hemisphere, γ - π/2 <= h0 <= h1 <= γ + π/2, γ = atan2(n_T, n_V).

    n + clamp(h - n, -π/2, π/2) of ATVI-TR-19-01, for normals that face away too (n_V < 0); an empty arc has length 0.
    """
    gamma = dr.atan2(nT, nV)
    low, high = gamma - math.pi / 2, gamma + math.pi / 2
    h0, h1 = dr.select(h0 > low, h0, low), dr.select(h1 < high, h1, high)
    return h0, dr.select(h1 > h0, h1, h0)


def minimal_rotation(f, t):
    """Rows of the rotation R with R f = t by the smallest angle, for unit vectors f and t that are not opposite.

    R = e I + [v]ₓ + v vᵀ/(1 + e) with v = f × t, e = ⟨f, t⟩: ROTFROMTO of ATVI-TR-19-01. It degenerates at e = -1 only.
    """
    e = dr.fma(f[0], t[0], dr.fma(f[1], t[1], f[2] * t[2]))
    v = tuple(dr.fma(f[i], t[j], -f[j] * t[i]) for i, j in ((1, 2), (2, 0), (0, 1)))
    r = 1 / (1 + e)
    cross = ((0, -v[2], v[1]), (v[2], 0, -v[0]), (-v[1], v[0], 0))
    return tuple(tuple(dr.fma(v[i] * r, v[j], cross[i][j] + (e if i == j else 0)) for j in range(3)) for i in range(3))
