"""Cones that stand for visibility: their apertures from visibility, and what the tangent plane leaves of them.

A cone has the axis b and the half angle α, the normal n leans away from the axis by β in [0, π/2]. Cosines and sines of
these angles come in; c = cos α may be negative, a cone wider than a hemisphere. The rim of the cone is inside the
normal's hemisphere for 2t of its azimuths, and the tangent plane is inside the cone for 2p of its (theory, eq. (117)):
t = π, p = 0 for a cone that is not cut; t = 0, p = π where the hemisphere is all inside the cone.
"""

import math
from typing import Any

import drjit as dr

__all__ = [
    "aperture",
    "energy",
    "equivalent_cone",
    "matched_aperture",
    "matched_uniform_aperture",
    "rim",
    "root",
    "solid_angle",
    "tilted_aperture",
    "uniform_aperture",
]

#: Newton steps that match apertures to rounding, in single and in double precision.
STEPS = {dr.VarType.Float32: 5, dr.VarType.Float64: 8}


def _is_single(x):
    return dr.type_v(x) is dr.VarType.Float32


def root(x):
    """√x, 0 below 0; its derivative is that of √x but bounded near 0, and 0 below."""
    positive = x > 0
    x = dr.select(positive, x, 0)
    value = dr.sqrt(dr.detach(x))
    least = 1e-3 if _is_single(x) else 1e-6
    return dr.replace_grad(value, x * (0.5 / dr.select(value > least, value, least)))


def _within(x, low, high):
    x = dr.select(x > low, x, low)
    return dr.select(x < high, x, high)


def aperture(A):
    """cos α = √(1 - A) of a cone about the normal with cosine-weighted visibility A (ATVI-TR-19-01).

    Beyond A = 1, where estimates may be, it stays a hemisphere; its derivative is bounded there.
    """
    return root(1 - A)


def tilted_aperture(A, cb):
    """cos α = √(1 - A / cos β) of the cone that has the cosine-weighted visibility A if it is not cut, A in [0, 1].

    Theory, eq. (151). A hemisphere from A = cos β on. The derivatives are bounded where the cone is as wide as that.
    """
    A = _within(A, 0, 1)
    whole = cb > A
    return root(1 - dr.select(whole, A / dr.select(whole, cb, 1), 1))


def uniform_aperture(A):
    """cos α = 1 - A of a cone whose solid angle is the share A of the hemisphere's, A limited to [0, 1]."""
    return 1 - _within(A, 0, 1)


def equivalent_cone(A, length):
    """cos α >= 0 of the cone about its own axis whose mean direction has the length that A and |B| say.

    The root y of ⅔ (1 + y + y²) / (1 + y) = |B| / A (theory, eq. (115)): 0, a hemisphere, for an open surface and
    whatever spreads further; 1 where all that is visible lies in one direction.
    """
    some = A > 0
    g = dr.select(some, length / dr.select(some, A, 1), 1)
    k = _within(dr.fma(g, 1.5, -1), 0, 0.5)
    return 0.5 * (k + root(k * (k + 4)))


def rim(c, cb, sb):
    """(t, p, r) of a cut cone: half arcs of the rim above the tangent plane and of the plane inside the cone.

    They share r = √(sin² β - c²), so that its rounding error where the cut begins cancels in what they are put into.
    Without derivatives.
    """
    cut = (sb - c) * (sb + c)
    # Tiny instead of 0: two angles, never NaN, that add up to π where the cone is the hemisphere itself.
    r = dr.sqrt(dr.select(cut > 1e-30, cut, 1e-30))
    return dr.atan2(r, -c * cb), dr.atan2(r, c), r


def solid_angle(c, cb, sb):
    """Of the part of the cone above the tangent plane; theory, eq. (118)."""
    t, _, r = rim(c, cb, sb)
    return 2 * (math.pi - dr.atan2(r, cb) - t * c)


def energy(c, cb, sb):
    """m0 / π, the cosine-weighted visibility of the cone above the tangent plane, with its derivatives.

    m0 = t cos β sin² α - r cos α + p of theory, eq. (118).
    """
    attached = any(map(dr.grad_enabled, (c, cb, sb)))
    with dr.suspend_grad():
        t, p, r = rim(c, cb, sb)
        s2 = dr.fma(-c, c, 1)
        value = dr.fma(t * cb, s2, dr.fma(-r, c, p)) * (1 / math.pi)
        if not attached:
            return value
        by_c = (-2 / math.pi) * dr.fma(t * c, cb, r)
        by_beta = (-1 / math.pi) * dr.fma(s2 * sb, t, c * cb * (r / dr.select(sb > 0, sb, 1)))
        still = cb * 1, sb * 1
    return dr.replace_grad(value, by_c * c + by_beta * (still[0] * sb - still[1] * cb))


def matched_aperture(A, cb, sb) -> Any:
    """cos α of the cone that the tangent plane leaves the cosine-weighted visibility A, in [-sin β, 1].

    √(1 - A / cos β) where it leaves the cone whole, that is up to A = cos³ β; else the root of :func:`energy`, by
    Newton steps on the square root of what is missing to 1, kept between bounds (theory, eq. (121)). A is limited to
    [0, 1]. The derivative is that of the implicit function, bounded where visibility hardly changes with the aperture.
    """
    attached = any(map(dr.grad_enabled, (A, cb, sb)))
    with dr.suspend_grad():
        A0 = _within(A, 0, 1)
        until = cb * cb * cb
        whole = until >= A0
        closed = 1 - A0 / dr.select(whole & (cb > 0), cb, 1)
        closed = dr.sqrt(dr.select(closed > 0, closed, 0))
        c = dr.select(whole, closed, sb * _cut_cosine(A0, cb, sb))
        if not attached:
            return c
        # 0 where the cone is the hemisphere itself.
        t, _, r = rim(c, cb, sb)
        slope = (2 / math.pi) * dr.fma(t * c, cb, r)
        least = 1e-3 if _is_single(c) else 1e-6
        slope = dr.select(slope > least, slope, least)
    A = dr.select((A >= 0) & (A <= 1), A, A0)
    return dr.replace_grad(c, (energy(c, cb, sb) - A) / slope)


def _cut_cosine(A, cb, sb):
    """cos p of the cut cone with visibility A, for A >= cos³ β: cos α = sin β cos p."""
    missing = math.pi * (1 - A)
    most = math.pi * dr.fma(-cb * cb, cb, 1)
    low, high = type(A)(-1), type(A)(1)
    ratio = missing / dr.select(most > 0, most, 1)
    k = dr.fma(2, dr.sqrt(dr.select(ratio < 1, ratio, 1)), -1)
    s2b = sb * sb
    for _ in range(STEPS[dr.type_v(A)]):
        s = dr.sqrt(dr.fma(-k, k, 1))
        t = dr.atan2(s, -k * cb)
        # π - m0 and its derivative by k.
        found = dr.fma(s2b * k, s, dr.atan2(s, -k)) - t * cb * dr.fma(-s2b * k, k, 1)
        slope = 2 * s2b * dr.fma(t * k, cb, s)
        low, high = dr.select(found < missing, k, low), dr.select(found < missing, high, k)
        usable = (found > 0) & (slope > 0)
        step = found / dr.select(usable, slope, 1)
        step = 2 * step * (dr.sqrt(missing / dr.select(usable, found, 1)) - 1)
        next_k = k + step
        inside = usable & (next_k >= low) & (next_k <= high)
        k = dr.select(inside, next_k, 0.5 * (low + high))
    return k


def matched_uniform_aperture(A, cb, sb) -> Any:
    """cos α of the cone of which the tangent plane leaves the solid angle 2π A, in [-sin β, 1].

    1 - A where it leaves the cone whole, that is up to A = 1 - sin β; else the root of :func:`solid_angle`, by Newton
    steps on the power ⅔ of what is missing to 2π, which is nearly straight in cos α (theory, eq. (152)). A is limited
    to [0, 1]. The derivative is that of the implicit function, bounded where the plane leaves little of the rim.
    """
    attached = any(map(dr.grad_enabled, (A, cb, sb)))
    with dr.suspend_grad():
        A0 = _within(A, 0, 1)
        whole = 1 - sb >= A0
        c = dr.select(whole, 1 - A0, sb * _cut_uniform_cosine(A0, cb, sb))
        if not attached:
            return c
        t, _, r = rim(c, cb, sb)
        # Of the share of the hemisphere.
        least = 1e-3 if _is_single(c) else 1e-6
        by_c = (-1 / math.pi) * dr.select(t > least, t, least)
        by_beta = (-1 / math.pi) * (r / dr.select(sb > 0, sb, 1))
        still = cb * 1, sb * 1
    A = dr.select((A >= 0) & (A <= 1), A, A0)
    return dr.replace_grad(c, (A - by_beta * (still[0] * sb - still[1] * cb)) / by_c)


def _cut_uniform_cosine(A, cb, sb):
    """cos α / sin β of the cut cone that leaves the share A of the hemisphere, for A >= 1 - sin β."""
    missing = math.pi * (1 - A)
    ratio = (1 - A) / dr.select(sb > 0, sb, 1)
    k = dr.fma(2, _two_thirds(dr.select(ratio < 1, ratio, 1)), -1)
    low, high = type(A)(-1), type(A)(1)
    for _ in range(STEPS[dr.type_v(A)]):
        s = dr.sqrt(dr.fma(-k, k, 1))
        t = dr.atan2(s, -k * cb)
        found = dr.fma(sb * k, t, dr.atan2(sb * s, cb))
        low, high = dr.select(found < missing, k, low), dr.select(found < missing, high, k)
        usable = (found > 0) & (t > 0)
        step = 1.5 * found / dr.select(usable, sb * t, 1)
        next_k = dr.fma(step, _two_thirds(missing / dr.select(usable, found, 1)) - 1, k)
        inside = usable & (next_k >= low) & (next_k <= high)
        k = dr.select(inside, next_k, 0.5 * (low + high))
    return k


def _two_thirds(x):
    root = dr.cbrt(x)
    return root * root
