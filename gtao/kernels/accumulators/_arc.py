"""The open arc of a slice between two horizon cosines, in the weighting of the method."""

import math

import drjit as dr

from gtao.kernels import arcs

__all__ = ["blended_length", "full_arc", "open_arc"]


def open_arc(weighting, nV, nT, c0, c1, arccosine="exact", *, clamped=False):
    """|n_p| â ("cosine") or half the arc's share of solid angle ("uniform"); their means are theory, eq. (10).

    Args:
        weighting: "cosine" or "uniform".
        c0, c1: horizon cosines of the sides -T and +T.
        arccosine: how angles are found, see :func:`gtao.kernels.arcs.fast_acos`.
        clamped: limit approximate angles to the hemisphere about the approximate normal.
    """
    if weighting == "uniform":
        return 0.5 * arcs.uniform_arc(c0, c1)
    if arccosine == "exact":
        return arcs.cosine_arc(nV, nT, c0, c1)
    gamma = arcs.normal_angle(nV, nT, arccosine)
    h0, h1 = -arcs.fast_acos(c0, arccosine), arcs.fast_acos(c1, arccosine)
    if clamped:
        low, high = gamma - math.pi / 2, gamma + math.pi / 2
        h0, h1 = dr.select(h0 > low, h0, low), dr.select(h1 < high, h1, high)
    return arcs.cosine_arc_from_angles(nV, nT, gamma, h0, h1)


def full_arc(weighting, nV, nT, start, arccosine="exact"):
    """:func:`open_arc` of a slice with nothing in it: its horizons are the tangent plane's cosines ``start``."""
    if weighting == "uniform":
        return 1
    if arccosine == "exact":
        return arcs.tangent_arc(nV, nT, start[0])
    return open_arc(weighting, nV, nT, *start, arccosine)


def blended_length(value, sl, blend):
    """A cosine-weighted slice value with |n_p| moved to 1 by the share ``blend``, as shaders do to fight darkening."""
    rcp_length = dr.rsqrt(dr.fma(sl.nT, sl.nT, sl.nV * sl.nV))
    return value * dr.fma(blend, rcp_length - 1, 1)
