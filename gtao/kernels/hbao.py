"""Horizon-based ambient occlusion: what a direction blocks between the tangent plane and its horizon.

Bavoil et al. 2008. The sketch speaks of elevations above the plane orthogonal to a zenith axis: the tangent angle t,
the horizon angle h, the elevation α of a sample. Only their sines enter its integral (theory, eq. (79)), and the sine
of an elevation is the cosine to the zenith: no angle is ever computed. A direction blocks (sin h - sin t) W, its share
of an open hemisphere is 1.
"""

import drjit as dr

from .roots import rsqrt

__all__ = ["attenuation", "by_horizon", "by_sample", "left_of", "tangent"]


def left_of(ux, uy, X=0, Y=0):
    """Normal of the slice plane that an image direction marches in, pointing to its left; of any length.

    Args:
        ux, uy: direction in the image plane at distance 1, y up.
        X, Y: the shaded point's coordinates there; 0 with parallel eye rays.
    """
    return -uy, ux, dr.fma(Y, ux, -X * uy)


def tangent(n, left, zenith):
    """sin t ahead, theory, eq. (82): elevation of the line in which the tangent plane meets the slice.

    Behind it is the opposite. Eye rays of the slice meet the tangent plane on this line, which is how the sketch finds
    t. With the view vector as zenith it is the start of the horizon search (eq. (9)), with parallel eye rays
    t = -arctan((n_x cos θ + n_y sin θ) / n_z).

    Args:
        n: unit normal that faces the viewer.
        left: what :func:`left_of` returned.
        zenith: unit axis that elevations are measured from, orthogonal to a plane of elevation 0.
    """
    line = tuple(dr.fma(left[i], n[j], -left[j] * n[i]) for i, j in ((1, 2), (2, 0), (0, 1)))
    rise, length2 = (dr.fma(line[0], v[0], dr.fma(line[1], v[1], line[2] * v[2])) for v in (zenith, line))
    return rise * rsqrt(length2)


def attenuation(distance2, rcp_radius):
    """W = max(0, 1 - r/R) from the squared distance r² (Bavoil et al. 2008, Eq. 3)."""
    w = dr.fma(-rcp_radius, dr.sqrt(distance2), 1)
    return dr.select(w > 0, w, 0)


def by_sample(c, w, h, blocked):
    """One more sample of a direction, attenuated by itself: it blocks (sin α - sin h) W(S) above the horizon so far.

    Theory, eq. (80). Samples come outward; another order gives another result.

    Args:
        c: sin α of the sample, NaN where there is none.
        w: its attenuation.
        h, blocked: sin h so far, at first sin t, and what the direction blocks so far, at first 0.

    Returns:
        ``h`` and ``blocked`` with the sample.
    """
    rises = h < c
    return dr.select(rises, c, h), dr.select(rises, dr.fma(c - h, w, blocked), blocked)


def by_horizon(c, w, h, w_h):
    """One more sample of a direction that is attenuated as a whole: it blocks (sin h - sin t) W(S), S defining h.

    Args:
        c, w, h: as for :func:`by_sample`.
        w_h: attenuation of the sample that defines ``h``, at first anything.

    Returns:
        ``h`` and ``w_h`` with the sample.
    """
    rises = h < c
    return dr.select(rises, c, h), dr.select(rises, w, w_h)
