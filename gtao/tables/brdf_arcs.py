"""The part of a ring above the horizon, cut where the integrand has peaks, with the scales that nodes follow."""

from typing import Any, NamedTuple

import drjit as dr

from .brdf_rings import Ring, spread

__all__ = ["Arc", "arcs"]

#: Distance of poles, in radians, beyond which they leave no mark on the nodes.
FAR = 3.0
#: Least scale of nodes: a millionth of the width of the narrowest ridge that tables reach.
LEAST = 1e-14
#: Keeps quotients and roots of nothing finite.
TINY = 1e-300


class Arc(NamedTuple):
    """Azimuths from ``start`` on over ``length``, which may be negative; nodes crowd towards it over ``scale``."""

    start: Any
    length: Any
    scale: Any


def arcs(ring: Ring, in_plane: bool) -> tuple[Arc, ...]:
    """Arcs that cover the ring above the horizon, at whose starts alone the integrand may peak.

    Args:
        in_plane: the axis lies in the incidence plane: the arcs cover the half of the ring with φ in [0, π].
    """
    axis = ring.axis
    # Half-angle form of cos Φ = -cot t cot θ_b, the azimuth from the normal's at which the ring meets the horizon.
    above, below = dr.cos(ring.t - axis.theta_b), -dr.cos(ring.t + axis.theta_b)
    above, below = (dr.sqrt(dr.select(x > TINY, x, TINY)) for x in (above, below))
    if in_plane:
        turn, peaks = 0, _peaks_in_plane(ring)
        first = dr.select(axis.n_1 >= 0, 0, 2 * dr.atan2(below, above))
        last = dr.select(axis.n_1 >= 0, 2 * dr.atan2(above, below), dr.pi)
        ends = [first, last]
    else:
        turn, peaks = _peaks(ring)
        half = 2 * dr.atan2(above, below)
        one, other = (dr.select(p < -half, -half, dr.select(p > half, half, p)) for p, _ in peaks)
        ends = [-half, dr.select(one < other, one, other), dr.select(one < other, other, one), half]
    scales = [_scale(end, peaks) for end in ends]
    pieces = []
    for i in range(len(ends) - 1):
        length = 0.5 * (ends[i + 1] - ends[i])
        pieces += [Arc(ends[i] + turn, length, scales[i]), Arc(ends[i + 1] + turn, -length, scales[i + 1])]
    return tuple(pieces)


def _scale(end: Any, peaks: Any) -> Any:
    """Distance from an azimuth to the nearest pole."""
    least = FAR
    for where, width in peaks:
        apart = abs(end - where)
        apart = dr.select(apart > dr.pi, 2 * dr.pi - apart, apart)
        distance = dr.sqrt(dr.fma(apart, apart, width * width))
        least = dr.select(distance < least, distance, least)
    return dr.select(least > LEAST, least, LEAST)


def _peaks_in_plane(ring: Ring) -> tuple[tuple[Any, Any], ...]:
    """Azimuth and width of the peaks at φ = 0 and φ = π: on half a ring the spread is a concave parabola of cos φ."""
    axis = ring.axis
    near, far = spread(ring, 0 * ring.t), spread(ring, 0 * ring.t + dr.pi)
    bend = (1 - axis.alpha * axis.alpha) * dr.square(ring.sin_t * axis.h)

    def width(here: Any, there: Any) -> Any:
        slope = dr.fma(0.5, there - here, 2 * bend)
        root = dr.sqrt(dr.fma(4 * bend, here, slope * slope))
        # Distance in cos φ of the zero beyond the end of the parabola, by whichever form does not cancel.
        beyond = dr.select(slope > 0, 2 * here / (slope + root + TINY), (root - slope) / (2 * bend + TINY))
        return 2 * dr.asinh(dr.sqrt(0.5 * dr.select(beyond < FAR, beyond, FAR)))

    return (0, width(near, far)), (dr.pi, width(far, near))


def _peaks(ring: Ring) -> tuple[Any, tuple[tuple[Any, Any], ...]]:
    """Azimuth of the normal, then azimuth from there and width of two peaks.

    Along the ring the spread is E + B cos φ + D sin φ - A cos² φ, with A not negative. It is least in the quadrant
    where cos φ and sin φ have the signs of -B and -D; a second minimum, if any, lies where only cos φ has that of B.
    """
    axis = ring.axis
    h = dr.select(axis.h > 0, axis.h, 1)
    cos_n, sin_n = dr.select(axis.h > 0, axis.n_1 / h, 1), axis.n_2 / h
    turn = dr.atan2(sin_n, cos_n)
    o_1, o_2 = axis.o_1 * cos_n + axis.o_2 * sin_n, axis.o_2 * cos_n - axis.o_1 * sin_n
    m, rise = 1 - axis.alpha * axis.alpha, ring.sin_t * axis.h
    A, D = m * rise * rise, 2 * ring.sin_t * o_2
    B = 2 * ring.sin_t * o_1 - 2 * m * dr.fma(ring.cos_t, axis.n_b, axis.c) * rise
    b, d = abs(B) + TINY, abs(D)
    d = d + 1e-100 * (b + 2 * A)
    # With u = cot x of an azimuth x in its quadrant, minima are where g = u (d - 2 A / √(1 + u²)) is b, or -b for the
    # second. g is convex: Newton's steps from above do not overshoot.
    zero = dr.sqrt(dr.select(d < 2 * A, (2 * A - d) * (2 * A + d), 0)) / d
    beyond = zero + dr.cbrt(b / dr.fma(0.35, A, TINY))
    steep = dr.select(d > 2 * A, b / dr.select(d > 2 * A, d - 2 * A, 1), FAR)
    above = (b + 2 * A) / d
    above = dr.select((beyond < 1) & (beyond < above), beyond, above)
    above = dr.select((steep < 1) & (steep < above), steep, above)
    first = _root(above, A, b, d)
    root_b, root_d = dr.cbrt(b), dr.cbrt(d)
    bound = dr.fma(root_b, root_b, root_d * root_d)
    # An astroid of B and D bounds where there are two minima.
    second = dr.select(bound * bound * bound < 4 * A * A, _root(zero, A, -b, d), root_b / root_d)

    def peak(u: Any, sign: int) -> tuple[Any, Any]:
        x = dr.atan2(type(u)(1), u)
        sine, cosine = dr.sincos(x)
        curve = 0.5 * (sign * b * cosine + d * sine + 2 * A * (cosine * cosine - sine * sine))
        curve = dr.select(curve > 0, curve, 0)
        where = dr.select((B > 0) == (sign > 0), dr.pi - x, x)
        where = dr.select(D > 0, -where, where)
        least = spread(ring, turn + where)
        return where, dr.sqrt(least / (curve + TINY))

    return turn, (peak(first, 1), peak(second, -1))


def _root(u: Any, A: Any, b: Any, d: Any) -> Any:
    """Root of u (d - 2 A / √(1 + u²)) = b, from a u that is not below it."""
    for _ in range(8):
        r = dr.rsqrt(dr.fma(u, u, 1))
        # 1 - r without cancellation.
        bend = 2 * A * dr.square(u * r) / (1 + r)
        value, slope = u * (d - 2 * A + bend) - b, d - 2 * A + bend * dr.fma(r, r + 1, 1)
        u = dr.select((value > 0) & (slope > 0), u - value / slope, u)
    return dr.select(u > 0, u, 0)
