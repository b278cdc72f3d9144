"""What a slice with horizons amounts to, in the weighting of the method."""

import math

import drjit as dr

from gtao.kernels import arcs, moments
from gtao.kernels.visible_arc import visible_arc

__all__ = ["blended_length", "slice_values"]


def slice_values(method, sl, upper, lower=None, start=None, *, clamped=False):
    """The share of the open arcs and the moments of their directions; their means are theory, eqs. (10) and (124).

    Args:
        method: accumulator with ``weighting``, ``order``, ``bent_normal`` and ``arccosine``.
        upper, lower, start: see :func:`gtao.kernels.visible_arc.visible_arc`.
        clamped: limit approximate angles to the hemisphere about the approximate normal.
    """
    nV, nT, order = sl.nV, sl.nT, method.order
    averaged = method.bent_normal == "average_horizon"
    if averaged:
        order = 0
    if method.arccosine == "exact":
        values = visible_arc(method.weighting, order, nV, nT, upper, lower, start)
    else:
        values = _approximate(nV, nT, order, upper, method.arccosine, clamped)
        if lower is not None:
            gap, full = (_approximate(nV, nT, order, c, method.arccosine, clamped) for c in (lower, start))
            values = tuple(f - g + v for f, g, v in zip(full, gap, values, strict=True))
    return (*values, *moments.mean_horizon(*upper)) if averaged else values


def _approximate(nV, nT, order, cosines, arccosine, clamped):
    """The cosine-weighted arc between two horizons as engines compute it, from approximate angles."""
    gamma = arcs.normal_angle(nV, nT, arccosine)
    h0, h1 = -arcs.fast_acos(cosines[0], arccosine), arcs.fast_acos(cosines[1], arccosine)
    if clamped:
        low, high = gamma - math.pi / 2, gamma + math.pi / 2
        h0, h1 = dr.select(h0 > low, h0, low), dr.select(h1 < high, h1, high)
    values = (arcs.cosine_arc_from_angles(nV, nT, gamma, h0, h1),)
    if not order:
        return values
    length, (sine, cosine) = dr.sqrt(dr.fma(nV, nV, nT * nT)), dr.sincos(gamma)
    normal = length * cosine, length * sine
    for moment in (moments.first, moments.second)[:order]:
        values += moment(*normal, dr.cos(h0), dr.cos(h1))[:2]
    return values


def blended_length(values, sl, blend):
    """Cosine-weighted slice values with |n_p| moved to 1 by the share ``blend``, as shaders do to fight darkening."""
    rcp_length = dr.rsqrt(dr.fma(sl.nT, sl.nT, sl.nV * sl.nV))
    factor = dr.fma(blend, rcp_length - 1, 1)
    return tuple(value * factor for value in values)
