"""Where the points that a frame shows were in the frame before: reprojection of a static scene."""

from dataclasses import dataclass
from typing import Any

import drjit as dr

__all__ = ["FARTHEST_PX", "View", "motion", "reprojected"]

#: Motion of what was not in front of the previous camera: beyond any frame, and a number that halves keep exact.
FARTHEST_PX = float(2**20)


@dataclass(frozen=True)
class View:
    """Numbers of a camera, of width one: (X, Y) is at (fx X + cx, cy - fy Y), in perspective divided by depth."""

    fx: Any
    fy: Any
    cx: Any
    cy: Any
    orthographic: bool


def reprojected(x, y, view_z, now: View, previous: View, rows):
    """Pixel coordinates and depth in the previous frame of what is seen at (x, y); theory, the motion of a still scene.

    Args:
        x, y: pixel coordinates, centres at half-integers.
        view_z: depth there, inf on the background.
        rows: three rows of four numbers, the map from this view frame to the previous one.

    Returns:
        Pixel coordinates and depth, and whether the point was in front of the camera; depth of the background is inf.
    """
    surface = dr.isfinite(view_z)
    # Of what is infinitely far only the direction counts: points on the unit plane, without the translation.
    z = dr.select(surface, view_z, 1)
    here = dr.select(surface, 1, 0)
    X, Y = (x - now.cx) / now.fx, (now.cy - y) / now.fy
    P = (X, Y, -z) if now.orthographic else (X * z, Y * z, -z)
    Q = tuple(dr.fma(r[0], P[0], dr.fma(r[1], P[1], dr.fma(r[2], P[2], r[3] * here))) for r in rows)
    z_before = -Q[2]
    ahead = z_before > 0
    scale = 1 if previous.orthographic else 1 / dr.select(ahead, z_before, 1)
    x_before, y_before = previous.cx + previous.fx * Q[0] * scale, previous.cy - previous.fy * Q[1] * scale
    if now.orthographic or previous.orthographic:
        # All rays of a parallel camera meet at infinity in one point, which does not tell them apart.
        x_before, y_before = dr.select(surface, x_before, x), dr.select(surface, y_before, y)
        ahead = ahead | ~surface
    return x_before, y_before, dr.select(surface, z_before, dr.inf), ahead


def motion(x, y, view_z, now: View, previous: View, rows):
    """Motion in pixels and change of depth from the previous frame to this one, finite everywhere."""
    x_before, y_before, z_before, ahead = reprojected(x, y, view_z, now, previous, rows)
    dx, dy = (_limited(dr.select(ahead, d, FARTHEST_PX)) for d in (x - x_before, y - y_before))
    return dx, dy, dr.select(dr.isfinite(view_z), view_z - z_before, 0)


def _limited(d):
    d = dr.select(d < FARTHEST_PX, d, FARTHEST_PX)
    return dr.select(d > -FARTHEST_PX, d, -FARTHEST_PX)
