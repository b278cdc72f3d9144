"""The open arc of a slice between two horizon cosines, in the weighting of the method."""

import drjit as dr

from gtao.kernels import arcs

__all__ = ["blended_length", "open_arc"]


def open_arc(weighting, nV, nT, c0, c1):
    """|n_p| â ("cosine") or half the arc's share of solid angle ("uniform"); their means are theory, eq. (10)."""
    return 0.5 * arcs.uniform_arc(c0, c1) if weighting == "uniform" else arcs.cosine_arc(nV, nT, c0, c1)


def blended_length(value, sl, blend):
    """A cosine-weighted slice value with |n_p| moved to 1 by the share ``blend``, as shaders do to fight darkening."""
    rcp_length = dr.rsqrt(dr.fma(sl.nT, sl.nT, sl.nV * sl.nV))
    return value * dr.fma(blend, rcp_length - 1, 1)
