"""What two cones have in common, as a solid angle and as a share of one of them.

The rims of two caps of half angles α₁ and α₂, with axes β apart, meet in two points. Seen from the axis of cap i they
are 2 t_i of azimuth apart (theory, eq. (128)). The great circle through them cuts what the caps share into two
segments, the area of each of which is a sum of what is positive: no digit is lost however narrow a cap is (theory,
eq. (129)). Only where the points are nearly opposite on the sphere is that circle badly determined; there Girard's
excess takes its place, eq. (130).

Angles are radians in [0, π].
"""

import math
from typing import Any, NamedTuple

import drjit as dr

__all__ = ["cap_intersection", "cap_share", "oat_intersection", "oat_share"]

#: Series of a segment in the square of the sine: ∫ x² / ((1 - q x²) √(1 - x²)) has the coefficients Σ_j q^(n-j) B_j.
BINOMIALS = tuple(math.comb(2 * j, j) / 4**j for j in range(6))
#: Sine of half an arc up to which six terms are enough, for single and double precision.
SERIES_UNTIL = {True: 0.25, False: 0.05}
#: Stands for a half angle of 0 where it divides: its square is a normal number in single precision.
POINT = 1e-15
#: No reflection cone narrower than this, twice, makes a derivative larger.
LEAST = {True: 1e-4, False: 1e-7}


class _Lens(NamedTuple):
    """Two half angles of arcs, the half chord's sine, and the solid angle divided by 4 π ``unit``."""

    t1: Any
    t2: Any
    k: Any
    share: Any


def cap_intersection(a1, a2, beta):
    """Solid angle that two cones share, theory, eq. (129), in [0, 4π].

    The relative error is that of a few roundings unless all that is shared is thin and as long as a great circle. The
    derivatives are those of the rims that move, theory, eq. (131): bounded everywhere, and finite where one cone
    begins to hold the other or they touch.

    Args:
        a1, a2: half angles of the cones.
        beta: angle between their axes.
    """
    attached = any(map(dr.grad_enabled, (a1, a2, beta)))
    with dr.suspend_grad():
        lens = _lens(a1, a2, beta, 1)
        value = (4 * math.pi) * lens.share
        if not attached:
            return value
        by_1, by_2, by_beta = 2 * lens.t1 * dr.sin(a1), 2 * lens.t2 * dr.sin(a2), -2 * lens.k
    return dr.replace_grad(value, by_1 * a1 + by_2 * a2 + by_beta * beta)


def cap_share(alpha_v, alpha_s, beta):
    """V_s, the share of a cone of reflection that a cone of visibility leaves, in [0, 1]; theory, eq. (132).

    For narrow cones of reflection it is the share of a disc on one side of a line, and for α_s = 0 a step, ½ where the
    rim of visibility goes through the reflected direction. The derivatives are exact down to α_s = 2e-4 (2e-7 in double
    precision), and below that bounded by those at it.

    Args:
        alpha_v: half angle of the cone of visibility.
        alpha_s: half angle of the cone of reflection.
        beta: angle between their axes.
    """
    attached = any(map(dr.grad_enabled, (alpha_v, alpha_s, beta)))
    with dr.suspend_grad():
        a_s = dr.select(alpha_s > POINT, alpha_s, POINT)
        s, c = dr.sincos(0.5 * a_s)
        lens = _lens(alpha_v, a_s, beta, s * s)
        if not attached:
            return lens.share
        least = LEAST[_is_single(lens.share)]
        wide = dr.select(s > least, s, least)
        scale = 1 / (2 * math.pi * s * wide)
        # What is inside a cap is no longer than its rim, which rounding forgets where a cone ends in a point.
        arc, most = lens.t1 * dr.sin(alpha_v), 2 * math.pi * s
        by_v, by_beta = scale * _lesser(dr.select(arc > 0, arc, 0), most), -scale * lens.k
        by_s = (c / wide) * dr.fma(lens.t2, 1 / math.pi, -lens.share)
    return dr.replace_grad(lens.share, by_v * alpha_v + by_s * alpha_s + by_beta * beta)


def oat_intersection(a1, a2, beta):
    """The solid angle by the smoothstep of Oat and Sander 2007 instead, theory, eq. (133); cones up to hemispheres.

    Args:
        a1, a2: half angles of the cones.
        beta: angle between their axes.
    """
    s = dr.sin(0.5 * _lesser(a1, a2))
    return (4 * math.pi) * s * s * _smoothstep(a1, a2, beta)


def oat_share(alpha_v, alpha_s, beta):
    """V_s with :func:`oat_intersection`; for α_s = 0 a step, whose derivatives are bounded like :func:`cap_share`'s."""
    least = 2 * LEAST[_is_single(alpha_v + alpha_s + beta)]
    a_s = dr.select(alpha_s > POINT, alpha_s, POINT)
    ratio = dr.sin(0.5 * _lesser(alpha_v, a_s)) / dr.sin(0.5 * a_s)
    value = ratio * ratio * _smoothstep(alpha_v, a_s, beta)
    if not any(map(dr.grad_enabled, (alpha_v, alpha_s, beta))):
        return value
    # The wider step's derivative where the step is too steep.
    a_s = dr.select(alpha_s > least, alpha_s, least)
    ratio = dr.sin(0.5 * _lesser(alpha_v, a_s)) / dr.sin(0.5 * a_s)
    return dr.replace_grad(value, ratio * ratio * _smoothstep(alpha_v, a_s, beta))


def _smoothstep(a1, a2, beta):
    least, most = _lesser(a1, a2), dr.select(a1 < a2, a2, a1)
    x = 0.5 * ((most - beta) + least) / dr.select(least > POINT, least, POINT)
    x = dr.select(x > 0, x, 0)
    x = dr.select(x < 1, x, 1)
    return x * x * dr.fma(-2, x, 3)


def _is_single(x):
    return dr.type_v(x) is dr.VarType.Float32


def _lesser(x, y):
    return dr.select(x < y, x, y)


def _excess(x, y, z):
    """(x + y - z) / 2, where it is small without any rounding error: the larger of x and y is then within 2 of z."""
    return 0.5 * ((dr.select(x > y, x, y) - z) + _lesser(x, y))


def _lens(a1, a2, beta, unit):
    # σ, σ - α₁, σ - α₂ and σ - β. Not below 0: one cone within the other, or apart.
    h1, h2, hb = _excess(a2, beta, a1), _excess(a1, beta, a2), _excess(a1, a2, beta)
    apart, holds_2, holds_1 = hb <= 0, h1 <= 1e-20, h2 <= 1e-20
    h = 0.5 * (a1 + a2 + beta)
    sines, cosines = zip(*(dr.sincos(0.5 * dr.select(x > 0, x, 0)) for x in (h, h1, h2, hb)), strict=True)
    double = [2 * s * c for s, c in zip(sines, cosines, strict=True)]
    S, S1, S2, Sb = (dr.select(x > 0, x, 0) for x in double)
    t1, sin_1, cos_1 = _twice(S1 * Sb, S * S2)
    t2, sin_2, cos_2 = _twice(S2 * Sb, S * S1)
    half_1, half_2 = dr.sin(0.5 * a1), dr.sin(0.5 * a2)
    k = dr.sin(a1) * sin_1
    whole = apart | holds_1 | holds_2
    t1 = dr.select(apart | holds_2, 0, dr.select(holds_1, math.pi, t1))
    t2 = dr.select(apart | holds_1, 0, dr.select(holds_2, math.pi, t2))
    # Equal cones about one axis: either holds the other, one of them counts.
    t1 = dr.select(holds_1 & holds_2 & (~apart), math.pi, t1)
    sin_1, sin_2, k = (dr.select(whole, 0, x) for x in (sin_1, sin_2, k))
    cos_1, cos_2 = (dr.select(whole, dr.select(t < 1, 1, -1), c) for t, c in ((t1, cos_1), (t2, cos_2)))
    area = _segment(a1, t1, sin_1, cos_1) + _segment(a2, t2, sin_2, cos_2)
    half = 0.5 * math.pi
    by_chord = dr.select((a1 > half) & (a2 > half), area + 2 * math.pi, area)
    product_s, product_c = (x[0] * x[1] * x[2] * x[3] for x in (sines, cosines))
    excess = 4 * dr.atan2(dr.sqrt(product_s), dr.sqrt(dr.select(product_c > 0, product_c, 0)))
    by_excess = 2 * dr.fma(t1, half_1 * half_1, t2 * half_2 * half_2) - excess
    shared = dr.select(k * k > 0.5, by_excess, by_chord)
    share = dr.select(shared > 0, shared, 0) / (2 * math.pi * unit)
    return _Lens(t1, t2, k, share)


def _twice(p, q):
    """Angle whose half has the squared tangent p / q, its sine and cosine; nothing in particular where both are 0."""
    root_p, root_q, total = dr.sqrt(p), dr.sqrt(q), p + q
    scale = 1 / dr.select(total > 0, total, 1)
    return 2 * dr.atan2(root_p, root_q), 2 * root_p * root_q * scale, (q - p) * scale


def _segment(a, t, sin_t, cos_t):
    """Half of the solid angle between a cap's rim and the chord of the arc 2t, negative for caps beyond hemispheres."""
    obtuse = a > 0.5 * math.pi
    s, c = dr.sincos(0.5 * a)
    m = dr.select(obtuse, c * c, s * s)
    x2 = sin_t * sin_t
    closed = 2 * m * t - dr.atan2(2 * m * sin_t * cos_t, dr.fma(-2 * m, x2, 1))
    q = 4 * m * (1 - m)
    # Horner's rule for Σ_n x^(2n) Σ_{j<=n} q^(n-j) B_j / (2n + 3).
    inner, coefficients = 0, []
    for n, B in enumerate(BINOMIALS):
        inner = dr.fma(inner, q, B)
        coefficients.append(inner / (2 * n + 3))
    total = coefficients.pop()
    while coefficients:
        total = dr.fma(total, x2, coefficients.pop())
    series = dr.fma(-2, m, 1) * q * x2 * sin_t * total
    until = SERIES_UNTIL[_is_single(closed)]
    area = dr.select((sin_t < until) & (cos_t > 0), series, closed)
    return dr.select(obtuse, -area, area)
