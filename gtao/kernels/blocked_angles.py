"""Which angles of a half-slice the solid behind a surface blocks.

The eye ray at angle α from the pixel's own passes the shaded point at the distance h = p sin α, and the angle from V of
its points grows with their distance from the eye: it is π/2 - α at the foot of the perpendicular and moves by
arctan(q/h) over the length q from there (theory, eq. (78)). The solid behind the surface therefore blocks the angles
from where the surface is, or the ray enters the sphere of the radius, to where it leaves the sphere.
"""

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr

__all__ = ["Line", "swept"]

FAR = 1e30
PARALLEL = 1e-9
# Pieces of the radius in which the surface is followed at least.
PIECES = 16


@dataclass(frozen=True)
class Line:
    """A half-slice over the image: a unit pixel direction, and angles as functions of the length t in pixels.

    The eye ray at t points (lean - t along_V) toward -V and t along_T toward T, where the pixel's own points lean
    toward -V: both reach the image plane at distance 1.
    """

    x: Any
    y: Any
    dx: Any
    dy: Any
    along_V: Any
    along_T: Any
    lean: Any
    p: Any  # distance of the shaded point from the eye; None in parallel projection
    radius: Any  # None if infinite
    rim: Any  # where the line leaves the sphere of the radius
    end: Any  # there, or at the border of the frame

    @classmethod
    def of(cls, T, V, point, cells, view, unlimited):
        """The image of the half-slice toward ``T``: where P + ε T moves, to first order (theory, eq. (19)).

        Args:
            point: texel coordinates (x, y), image-plane coordinates (X, Y), depth z and length of (X, Y, 1).
            cells, view: :class:`gtao.kernels.depth_cells.DepthCells` and :class:`gtao.kernels.depth_cells.View`.
        """
        x, y, X, Y, z, lean = point
        if cells.orthographic:
            gx, gy, along_V, along_T, p = T[0], T[1], 0, 1, None
        else:
            gx, gy, p = dr.fma(X, T[2], T[0]), dr.fma(Y, T[2], T[1]), z * lean
            along_V, along_T = dr.fma(gx, V[0], gy * V[1]), dr.fma(gx, T[0], gy * T[1])
        px, py = gx * view.fx, -gy * view.fy
        per_pixel = dr.rsqrt(dr.fma(px, px, py * py))
        dx, dy = px * per_pixel, py * per_pixel
        dx, dy = dr.select(abs(dx) > PARALLEL, dx, PARALLEL), dr.select(abs(dy) > PARALLEL, dy, PARALLEL)
        along_V, along_T = along_V * per_pixel, along_T * per_pixel
        end = (dr.select(dx > 0, cells.width - 0.5, -0.5) - x) / dx
        other = (dr.select(dy > 0, cells.height - 0.5, -0.5) - y) / dy
        end = dr.select(other < end, other, end)
        if unlimited:
            return cls(x, y, dx, dy, along_V, along_T, lean, p, None, FAR, end)
        if cells.orthographic:
            rim = view.radius / along_T
        else:
            # From outside, the eye sees the sphere's radius under the angle whose tangent is m.
            outside = dr.fma(p, p, -view.radius * view.radius)
            m = view.radius * dr.rsqrt(dr.select(outside > 0, outside, 1))
            rate = dr.fma(m, along_V, along_T)
            rim = dr.select((outside > 0) & (rate > 0), m * lean / rate, FAR)
        return cls(x, y, dx, dy, along_V, along_T, lean, p, view.radius, rim, dr.select(rim < end, rim, end))

    @property
    def course(self):
        return self.x, self.y, self.dx, self.dy

    def at(self, t):
        return dr.fma(self.dx, t, self.x), dr.fma(self.dy, t, self.y)

    def next_within_sphere(self, t):
        """How far a piece that begins at t may reach: on small spheres, and near their rim, angles change fast."""
        if self.radius is None:
            return FAR
        coarse, fine = self.rim * (1 / PIECES), self.rim * (1 / PIECES**2)
        half = 0.5 * (self.rim - t)
        return t + dr.select(half > coarse, coarse, dr.select(half > fine, half, fine))

    def surface(self, t, w):
        """Angle from V of the surface at t; its w is higher than the shaded point's by ``w``."""
        # D = S - P has the components z_S (p w + t along_V) toward V and z_S t along_T toward T.
        toward = w if self.p is None else dr.fma(self.p, w, t * self.along_V)
        return dr.atan2(t * self.along_T, toward)

    def sphere(self, t):
        """Angles from V at which the eye ray at t enters and leaves the sphere; behind the eye and at infinity."""
        away, across = dr.fma(-t, self.along_V, self.lean), t * self.along_T
        if self.radius is None:
            return 0, (math.pi if self.p is None else dr.atan2(across, -away))
        if self.p is None:
            sine, cosine, h = 0, 1, across
        else:
            per_length = dr.rsqrt(dr.fma(away, away, across * across))
            sine, cosine = across * per_length, away * per_length
            h = self.p * sine
        chord2 = dr.fma(self.radius, self.radius, -h * h)
        q = dr.sqrt(dr.select(chord2 > 0, chord2, 0))
        enter = dr.atan2(h * cosine - q * sine, h * sine + q * cosine)
        leave = dr.atan2(h * cosine + q * sine, h * sine - q * cosine)
        return enter, leave


def swept(at0, at1):
    """The angles that are blocked between two places of a line, as one interval; inf to -inf if there are none.

    In either place the angles of the surface and of both ends of the sphere block the interval from the larger of the
    first two to the last. Along a piece of the surface all three move continuously, so that it sweeps one interval.
    Besides in the two places, that can begin where the surface enters the sphere from the front, and begin or end
    where the surface leaves it at the back, both about where straight lines between the two places cross.
    """
    (surface0, enter0, leave0), (surface1, enter1, leave1) = at0, at1
    a0 = dr.select(surface0 > enter0, surface0, enter0)
    a1 = dr.select(surface1 > enter1, surface1, enter1)
    some0, some1 = a0 < leave0, a1 < leave1
    back = _crossing(a0 - leave0, a1 - leave1, leave0, leave1)
    front = _crossing(surface0 - enter0, surface1 - enter1, enter0, enter1)
    enters = (some0 | some1) & ((surface0 < enter0) != (surface1 < enter1))
    first, last = dr.inf, -dr.inf
    for counts, low, high in (
        (some0, a0, leave0),
        (some1, a1, leave1),
        (some0 != some1, back, back),
        (enters, front, -dr.inf),
    ):
        first = dr.select(counts & (low < first), low, first)
        last = dr.select(counts & (high > last), high, last)
    return first, last


def _crossing(gap0, gap1, value0, value1):
    """The value where the gap closes, both taken as linear in between."""
    fall = gap0 - gap1
    way = gap0 / dr.select(fall != 0, fall, 1)
    return dr.fma(way, value1 - value0, value0)
