"""Moments of the directions in the open sectors of a slice: what the bent normals of a bitmask are summed from.

Notation of :mod:`gtao.kernels.moments`. The integrals from θ = 0 to the ends of sectors telescope over a run of open
sectors (theory, eq. (147)), so that only the ends of runs count, and a mask has few: one or two, as a rule. Where the
sectors end follows from the maps of :mod:`gtao.kernels.bitmask` that measure solid angle, in closed form but for
:func:`cosine_end`.
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from .arcs import segment
from .loops import while_loop
from .roots import rsqrt
from .visible_arc import beside_zenith, visible_arc

__all__ = ["End", "Side", "cosine_end", "open_moments"]

# Of the first guess, chosen for the smallest error of the moments whatever the normal: 1.2e-6 before any Newton step.
_CUBIC, _EVEN = 0.68, 0.27


@dataclass(frozen=True)
class Side:
    """One side of a cosine-weighted slice, V to the tangent plane.

    Attributes:
        c, s: cosine and sine of the tangent plane's angle to V.
        half: what half of the side holds.
        rcp: its reciprocal.
        rise: 1 - cos h in the middle of the side.
        slope: n_V rise / half.
    """

    c: Any
    s: Any
    half: Any
    rcp: Any
    rise: Any
    slope: Any

    @classmethod
    def of(cls, nV, nT, c, full):
        """From the cosine of the tangent plane and from what the whole side holds."""
        # Of a surface seen edge-on one side may hold nothing but rounding.
        half = dr.select(full > 0, 0.5 * full, 0)
        rcp, rise = 1 / dr.select(half > 0, half, 1), 1 - _root(dr.fma(0.5, c, 0.5))
        # Of a cosine near 1 or -1 the sine would be rounding.
        s = nV * rsqrt(dr.fma(nT, nT, nV * nV))
        return cls(c, s, half, rcp, rise, nV * rise * rcp)

    @classmethod
    def either(cls, plus, sides):
        """The side of +T where ``plus``, else that of -T."""
        return cls(*(dr.select(plus, b, a) for a, b in zip(*(vars(side).values() for side in sides), strict=True)))


@dataclass(frozen=True)
class End:
    """An angle h >= 0 from V.

    Attributes:
        c, s: its cosine and sine.
        lacking: what a slice holds up to the angle that was asked for and does not hold up to this one.
        growth: what it holds per angle here; None where nothing is lacking.
    """

    c: Any
    s: Any
    lacking: Any = 0
    growth: Any = None


def cosine_end(y, nV, nT, side):
    """Where the side of +T of a cosine-weighted slice holds y, up from V: theory, eqs. (148) and (149).

    The content grows as fast beside V as beside the tangent plane, so that the half beside V stands for the other.

    Args:
        y: at least 0, at most twice ``side.half``.
        nV, nT: components of the normal in the slice, n_V > 0.
        side: the :class:`Side`.
    """
    far = y > side.half
    inner = dr.select(far, dr.fma(2, side.half, -y), y)
    inner = dr.select(inner > 0, inner, 0)
    square = inner * side.rcp
    share = dr.sqrt(square)
    bent = dr.fma(_EVEN * side.slope * side.slope, share - square, side.slope)
    cubic = (1 - side.slope) * (1 + _CUBIC) * share
    denominator = dr.fma(bent, share + _CUBIC, cubic)
    rise = side.rise * square * (share + _CUBIC) / dr.select(denominator > 0, denominator, 1)
    if dr.type_v(y) is not dr.VarType.Float32:
        for _ in range(3):
            rise = _newton(rise, inner, nV, nT)
    c, s, held, growth = _content(rise, nV, nT)
    lacking = inner - held
    return End(
        dr.select(far, dr.fma(side.c, c, side.s * s), c),
        dr.select(far, dr.fma(side.s, c, -side.c * s), s),
        dr.select(far, -lacking, lacking),
        s * growth,
    )


def _content(rise, nV, nT):
    """Cosine and sine of the angle with 1 - cos h = rise, what lies up to it, and its derivative by the rise."""
    c = 1 - rise
    k, q = segment(c)
    s = dr.sqrt(q)
    return c, s, 0.5 * dr.fma(nV, q, nT * k), dr.fma(nV, c, nT * s)


def _newton(rise, y, nV, nT):
    """A step on the square roots of both: one is nearly linear in the other."""
    _, _, held, growth = _content(rise, nV, nT)
    root = dr.sqrt(rise)
    slope = root * growth
    root = root + (dr.sqrt(y * held) - held) / dr.select(slope > 0, slope, 1)
    return root * root


def open_moments(weighting, order, nV, nT, start, constants, full, closed, n):
    """The moments of :func:`gtao.kernels.visible_arc.visible_arc`, of all open sectors.

    Args:
        weighting: the mapping of the sectors, "cosine" or "uniform".
        order: of the highest moment, 1 or 2.
        nV, nT: components of the normal in the slice, n_V > 0.
        start: cosines of the tangent plane on the two sides.
        constants, full: of :func:`gtao.kernels.bitmask.slice_map`.
        closed: masks of the closed sectors.
        n: number of sectors.

    Returns:
        |n_p| (t0, t1); from order 2 on (ss, sc) as well. They belong to the share
        :func:`gtao.kernels.bitmask.visible_share` times ``full``.
    """
    UInt, Float = type(closed[0]), type(nV)
    if weighting == "cosine":
        zenith = constants[0]
        parts = full * zenith, full * (1 - zenith)
        sides = tuple(Side.of(nV, nT, c, part) for c, part in zip(start, parts, strict=True))
    else:
        zenith = constants[0] + 0.5

    def between_zenith_and(x):
        """The moments up to share x of the hemisphere, along T or -T, and the sign of the side."""
        y = x - zenith
        plus = y > 0
        sign, y = dr.select(plus, 1, -1), abs(y)
        if weighting == "cosine":
            end = cosine_end(full * y, nV, sign * nT, Side.either(plus, sides))
        else:
            end = End(dr.fma(-2, y, 1), 2 * _root(dr.fma(-y, y, y)))
        return sign, _completed(end, beside_zenith(weighting, order, nV, sign * nT, end.c, end.s))

    def step(ends, sums, word, first):
        j = dr.tzcnt(ends) & 31
        sign, found = between_zenith_and(Float(j + (first + 1)) * (1 / n))
        # Open below the end or above it. Toward -T an integral runs backwards, and what is odd in T is so twice.
        run = dr.select(((word >> j) & 1) == 0, 1, -1)
        signs = (run, run * sign, run * sign, run)
        return ends & (ends - 1), tuple(dr.fma(s, m, a) for s, m, a in zip(signs, found, sums, strict=False))

    # The ends of the hemisphere, where the outermost sectors are open.
    outermost = (closed[0] & 1) == 0, closed[-1] >> ((n - 1) % 32) == 0
    upper = tuple(dr.select(is_open, c, 1) for is_open, c in zip(outermost, start, strict=True))
    sums = visible_arc(weighting, order, nV, nT, upper)[1:]
    for number, word in enumerate(closed):
        last = min(n - 32 * number, 32) - 1
        after = word >> last if word is closed[-1] else closed[number + 1] & 1
        ends = word ^ ((word >> 1) | (after << last))

        def body(ends, sums, word=word, first=32 * number):
            return step(ends, sums, word, first)

        _, sums = while_loop((UInt(ends), sums), lambda ends, _: ends != 0, body, label="ends")
    return sums


def _completed(end, found):
    """Moments up to an end with what is lacking there, to second order."""
    if end.growth is None:
        return found
    c, s, first = end.c, end.s, end.lacking
    second = 0.5 * first * first / dr.select(end.growth > 0, end.growth, 1)
    directions = (s, c, s * s, s * c), (c, -s, 2 * s * c, dr.fma(c, c, -s * s))
    return [m + dr.fma(first, f, second * g) for m, f, g in zip(found, *directions, strict=False)]


def _root(x):
    return dr.sqrt(dr.select(x > 0, x, 0))
