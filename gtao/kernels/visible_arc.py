"""What is visible in a slice: the share of its open arcs and the moments of their directions, with derivatives.

Notation of :mod:`gtao.kernels.arcs` and :mod:`gtao.kernels.moments`. A slice is open from the horizons ``upper`` up to
the zenith; where something hangs over a gap, it is open again from the tangent plane up to the cosines ``lower``. Every
integral is linear in a few functions of each end's cosine c = cos h, with s = sin h >= 0,

    q = s², k = h - s c; for the first moments also c, c³, s³; for the second q² and s³ c,

so that all ends are added up before the normal enters: moments cost no more than powers of what the visibility needs.
"""

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr

from .arcs import segment

__all__ = ["beside_zenith", "visible_arc"]

#: The signs of q, k, c, c³, s³, q² and s³ c on the side of -T, where angles are negative.
_PARITY = (1, -1, 1, 1, -1, 1, -1)


@dataclass(frozen=True)
class _End:
    """An end of an open arc: the cosine of its angle, the side it is on, and whether what is above it is open."""

    c: Any
    side: int
    sign: int

    @property
    def outward(self):
        """-1 on the side of -T, 1 on that of +T."""
        return 2 * self.side - 1


def visible_arc(weighting, order, nV, nT, upper, lower=None, start=None):
    """The visible share of a slice and its moments along the zenith V and the tangent T.

    Args:
        weighting: "cosine", whose means over slices are integrals over the hemisphere divided by π, or "uniform",
            without the cosine and divided by 2π.
        order: of the highest moment, 0 to 2.
        nV, nT: ⟨N, V⟩ and ⟨N, T⟩.
        upper: cosines of the horizons on the sides of -T and +T, within the normal's hemisphere.
        lower: cosines of the lower ends of what is blocked, between ``start`` and ``upper``; ``start`` where it reaches
            down to the tangent plane.
        start: cosines of the tangent plane; needed with ``lower`` only.

    Returns:
        The share |n_p| â; from order 1 on |n_p| (t0, t1), its integrals of sin θ and cos θ; from order 2 on (ss, sc) of
        sin² θ and sin θ cos θ. That of cos² θ is the share less ss (theory, eqs. (12), (14) and (122)).
    """
    attached = any(map(dr.grad_enabled, (nV, nT, *upper, *(lower or ()), *(start or ()))))
    with dr.suspend_grad():
        totals, ends = _totals(weighting, order, upper, lower, start)
        by_normal, values = _values(weighting, order, nV, nT, totals)
        if not attached:
            return tuple(values)
        by_ends = [_by_end(end, None if by_normal is None else (nV, nT), order) for end in ends]
    result = []
    for m, value in enumerate(values):
        # The derivatives of the terms are longer, and infinite at c = 1 (theory, eqs. (89) and (123)).
        change = 0 if by_normal is None else by_normal[m][0] * nV + by_normal[m][1] * nT
        for end, by_c in zip(ends, by_ends, strict=True):
            change = change + by_c[m] * _limited(end.c)
        result.append(dr.replace_grad(value, change))
    return tuple(result)


def beside_zenith(weighting, order, nV, nT, c, s):
    """The first and second moments of :func:`visible_arc` between V and an angle toward +T, without derivatives.

    Args:
        c, s: cosine and sine of the angle, c <= 1.
    """
    k, q = segment(c)
    s3 = s * s * s
    # The other end lies at the zenith.
    totals = q, k, 1 + c, dr.fma(c * c, c, 1), s3, q * q, s3 * c
    return _values(weighting, order, nV, nT, totals[: 7 if order > 1 and weighting == "cosine" else 5])[1][1:]


def _values(weighting, order, nV, nT, totals):
    """The factors of the normal in the share and the moments, if it counts, and these themselves."""
    if weighting == "uniform":
        return None, _uniform(order, *totals)
    by_normal = _cosine(order, *totals)
    return by_normal, [dr.fma(nV, by_nV, nT * by_nT) for by_nV, by_nT in by_normal]


def _by_end(end, normal, order):
    """Derivatives of the share and the moments by the cosine of an end: what is seen there."""
    c = _limited(end.c)
    s2 = dr.fma(-c, c, 1)
    s = end.outward * dr.sqrt(dr.select(s2 > 0, s2, 0))
    seen = -0.5 * end.sign if normal is None else -end.sign * dr.fma(normal[0], c, normal[1] * s)
    by_c = [seen]
    if order:
        by_c += [seen * s, seen * c]
    if order > 1:
        by_c += [seen * s2, seen * s * c]
    return by_c


def _limited(c):
    return dr.select(c < 1, c, 1)


def _totals(weighting, order, upper, lower, start):
    """Sums of the functions over all ends, and those ends that have derivatives."""
    ends = [_End(c, side, 1) for side, c in enumerate(upper)]
    # Without the cosine one of the first moments' functions is the share itself, and no more are needed for the second.
    order = 1 if weighting == "uniform" else order
    totals = [_functions(end, order) for end in ends]
    if lower is not None:
        gaps = [_End(c, side, -1) for side, c in enumerate(lower)]
        # Ends of arcs that nothing opens cancel exactly.
        totals = [
            [a - b for a, b in zip(t, _functions(g, order), strict=True)] for t, g in zip(totals, gaps, strict=True)
        ]
        totals.append(_tangent(start, order))
        ends += gaps
        if weighting == "uniform":
            # Cosine-weighted, nothing is added at the tangent plane however far it turns.
            ends += [_End(c, side, 1) for side, c in enumerate(start)]
    return [sum(column[1:], column[0]) for column in zip(*totals, strict=True)], ends


def _functions(end, order):
    """The functions of one end, with the signs of its side."""
    k, q = segment(end.c)
    found = [q, k]
    if order:
        c = _limited(end.c)
        s3 = q * dr.sqrt(q)
        found += [c, c * c * c, s3]
        if order > 1:
            found += [q * q, s3 * c]
    return found if end.side else [p * f for p, f in zip(_PARITY, found, strict=False)]


def _tangent(start, order):
    """Their sums over the two ends of the tangent plane, with cosines c and -c."""
    k, q = segment(start[1])
    found = [2 * q, 2 * k - math.pi]
    if order:
        zero = type(q)(0)
        found += [zero, zero, zero]
        if order > 1:
            s3 = q * dr.sqrt(q)
            found += [2 * q * q, 2 * s3 * start[1]]
    return found


def _cosine(order, q, k, *others: Any):
    """Pairs of the factors of n_V and n_T in the share and the moments."""
    pairs = [(0.5 * q, 0.5 * k)]
    if order:
        c, c3, s3 = others[:3]
        across = s3 * (1 / 3)
        pairs += [(across, dr.fma(c, -3, 4 + c3) * (1 / 3)), ((2 - c3) * (1 / 3), across)]
    if order > 1:
        q2, s3c = others[3:]
        across = 0.25 * q2
        pairs += [(across, dr.fma(k, 3, -2 * s3c) * (1 / 8)), (dr.fma(s3c, 2, k) * (1 / 8), across)]
    return pairs


def _uniform(order, q, k, c, c3, s3):
    """The share and the moments themselves."""
    values = [0.5 * (2 - c)]
    if order:
        values += [0.25 * k, 0.25 * q]
    if order > 1:
        values += [dr.fma(c, -3, 4 + c3) * (1 / 6), s3 * (1 / 6)]
    return values
