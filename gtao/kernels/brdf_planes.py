"""Planes through the view vector, along which the reflection of a rough surface is summed.

A plane at the azimuth ψ about the view vector has the half vectors of all its directions in it: that of ω(θ), at the
angle θ from the view vector, is at τ = θ/2. The cone and the hemisphere are intervals of the plane, the distribution of
half vectors along it is one curve in another unit, and one warp of Gauss's nodes fits all widths (theory, eq. (166)).
What the sums change by is summed with them: loops that are differentiated by machine take ten times as long.
"""

import math
from functools import cache
from typing import Any, NamedTuple

import drjit as dr

from .gauss import legendre
from .loops import while_loop
from .microfacet import schlick

__all__ = ["Cone", "Plane", "Surface", "in_plane"]

#: How much of the way from even nodes to nodes that are dense at the ends of a plane's interval: a narrow lobe's tails,
#: which carry the Fresnel term, are near them.
DENSE = 0.75
#: Cosine below which both directions graze: Smith's denominator stays what it is there.
GRAZING = 1e-5
#: Least sine of the half angle that a cone has in a plane, squared, for the derivatives of where it ends.
LEAST = 1e-14


class Surface(NamedTuple):
    """Numbers of a pixel that all planes share: the width squared, the view vector's angle, Smith's term for it."""

    a2: Any
    cos_o: Any
    sin_o: Any
    smith_o: Any


class Cone(NamedTuple):
    """cos α_v, sin α_v, and the axis: along the view vector, and across it in the plane of incidence and out of it."""

    cos_v: Any
    sin_v: Any
    along: Any
    across: Any
    aside: Any


class Plane(NamedTuple):
    """Its azimuth ψ, the normal's projection, of length C at the angle γ, and the unit w of tan x = w tan y."""

    sin_psi: Any
    cos_psi: Any
    C: Any
    cos_g: Any
    sin_g: Any
    gamma: Any
    w: Any
    w2: Any


def in_plane(surface, cone, sin_psi, cos_psi, n_nodes, slopes):
    """Sums over the directions of one plane that are above the surface, and in the cone if there is one.

    Args:
        surface, cone: numbers of a pixel; ``cone`` may be None.
        sin_psi, cos_psi: of the plane's azimuth about the view vector; 0 is the plane of incidence.
        n_nodes: nodes for each side of the view vector.
        slopes: whether to sum derivatives, too.

    Returns:
        a and b per azimuth; with ``slopes`` their derivatives by α² and by θ_o at fixed directions, and with a cone
        those by its four numbers, for a and then for b.
    """
    plane = _plane(surface, sin_psi, cos_psi)
    low, high = plane.gamma - 0.5 * math.pi, plane.gamma + 0.5 * math.pi
    edges, moves = [], None
    if cone is not None:
        enter, leave, moves = _in_cone(cone, plane)
        edges = [(enter, -1), (leave, 1)] if slopes else []
        # Below the surface nothing is summed, and there the ends may change places.
        low, high = dr.select(enter > low, enter, low), dr.select(leave < high, leave, high)
    sides: list[Any] = []
    for choose in (lambda t: dr.select(t < 0, t, 0), lambda t: dr.select(t > 0, t, 0)):
        ends = (_warp(0.5 * choose(t) - plane.gamma, plane.w) for t in (low, high))
        sides.append(_on_side(surface, plane, *ends, n_nodes, slopes))
    scale = surface.a2 * (4 / math.pi) / (plane.w2 * plane.w)
    sums = [(x + y) * scale for x, y in zip(*sides, strict=True)]
    if edges:
        sums += _at_edges(surface, plane, edges, moves)
    return sums


def _plane(surface, sin_psi, cos_psi):
    a2, cos_o, sin_o, _ = surface
    n_e = sin_o * cos_psi
    C2 = dr.fma(cos_o, cos_o, n_e * n_e)
    C = dr.sqrt(C2)
    cos_g, sin_g = cos_o / C, n_e / C
    w2 = dr.fma((1 - a2) * sin_psi * sin_psi, sin_o * sin_o, a2)
    return Plane(sin_psi, cos_psi, C, cos_g, sin_g, dr.atan2(sin_g, cos_g), dr.sqrt(w2), w2)


def _in_cone(cone, plane):
    """Angles at which the plane enters and leaves the cone, within half a turn of the normal's; equal if it misses it.

    Also what moves them: the part of the axis across the view vector, the squared length of the axis in the plane, and
    by how much that exceeds cos² α_v.
    """
    e = dr.fma(cone.across, plane.cos_psi, cone.aside * plane.sin_psi)
    # L² - cos² α_v keeps its digits as sin² α_v less what of the axis is out of the plane.
    out = dr.fma(cone.aside, plane.cos_psi, -cone.across * plane.sin_psi)
    excess = (cone.sin_v - out) * (cone.sin_v + out)
    middle = dr.atan2(e, cone.along)
    half = dr.atan2(dr.sqrt(dr.select(excess > 0, excess, 0)), cone.cos_v)
    # Never above: a cone that reaches past half a turn holds -ω_o, and all planes then have γ >= 0.
    middle = dr.select(middle - plane.gamma < -math.pi, middle + 2 * math.pi, middle)
    return middle - half, middle + half, (cone, e, dr.fma(e, e, cone.along * cone.along), excess)


def _warp(x, w):
    """y of tan x = w tan y, for |x| <= ½π."""
    s, c = dr.sincos(x)
    return dr.atan2(s, w * c)


def _direction(surface, plane, sin_x, cos_x):
    """cos τ, sin τ, cos θ_i, Smith's root for it, and ½ |sin τ cos τ| over what his denominator is, at x = τ - γ."""
    cos_t = dr.fma(plane.cos_g, cos_x, -plane.sin_g * sin_x)
    sin_t = dr.fma(plane.sin_g, cos_x, plane.cos_g * sin_x)
    cos_i = plane.C * dr.fma(cos_t, cos_x, -sin_t * sin_x)
    cos_i = dr.select(cos_i > 0, cos_i, 0)
    smith_i = dr.sqrt(dr.fma((1 - surface.a2) * cos_i, cos_i, surface.a2))
    total = dr.fma(surface.cos_o, smith_i, cos_i * surface.smith_o)
    least = GRAZING * surface.smith_o
    total = dr.select(total > least, total, least)
    return cos_t, sin_t, cos_i, smith_i, 0.5 * abs(sin_t * cos_t) / total, total


def _on_side(surface, plane, first, last, n_nodes, slopes):
    span = last - first
    Float = type(span)
    UInt = dr.uint32_array_t(Float)
    nodes, weights = (Float(list(column)) for column in zip(*_dense(n_nodes), strict=True))

    def body(j, *sums):
        s, c = dr.sincos(dr.fma(span, dr.gather(Float, nodes, j), first))
        # D dx = α² / π w³ · spread dy.
        spread = dr.fma(plane.w2 * s, s, c * c)
        scale = dr.rcp(dr.sqrt(spread))
        s, c = plane.w * s * scale, c * scale
        cos_t, sin_t, cos_i, smith_i, lobe, total = _direction(surface, plane, s, c)
        lobe = lobe * spread * dr.gather(Float, weights, j)
        k = schlick(cos_t)
        terms = [lobe * cos_i]
        if slopes:
            terms += _slopes(surface, plane, (s, c, cos_t, sin_t, cos_i, smith_i, total), lobe)
        split = [part for x in terms for part in ((1 - k) * x, k * x)]
        return j + 1, *(old + new for old, new in zip(sums, split, strict=True))

    zeros = [dr.zeros(Float, dr.width(span)) for _ in range(6 if slopes else 2)]
    _, *sums = while_loop((UInt(0), *zeros), lambda j, *_: j < n_nodes, body, label="nodes")
    return [x * span for x in sums]


def _slopes(surface, plane, direction, lobe):
    """Derivatives of D 𝒱 cos θ_i by α² and θ_o where the direction stays; ``lobe`` is D 𝒱 times a constant."""
    a2, cos_o, sin_o, smith_o = surface
    s, c, cos_t, sin_t, cos_i, smith_i, total = direction
    lean = cos_o * plane.cos_psi
    by_D = 1 / dr.fma(plane.w2 * c, c, s * s)
    cos_h = plane.C * c
    by_width = 1 / a2 - 2 * cos_h * cos_h * by_D
    smith = 0.5 * (cos_o * dr.fma(-cos_i, cos_i, 1) / smith_i + cos_i * sin_o * sin_o / smith_o)
    by_width = by_width - smith / total
    # Of the cosines to the normal: it turns away from the view vector.
    turn_h = dr.fma(lean, sin_t, -sin_o * cos_t)
    turn_i = 2 * lean * sin_t * cos_t - sin_o * dr.fma(cos_t, cos_t, -sin_t * sin_t)
    smith = turn_i * dr.fma((1 - a2) * cos_i, cos_o / smith_i, smith_o)
    smith = smith - sin_o * dr.fma((1 - a2) * cos_i, cos_o / smith_o, smith_i)
    by_angle = 4 * (1 - a2) * cos_h * turn_h * by_D - smith / total
    return lobe * cos_i * by_width, lobe * dr.fma(cos_i, by_angle, turn_i)


def _at_edges(surface, plane, edges, moves):
    """What the rim sweeps in the plane when the four numbers of the cone change, of a and then of b."""
    cone, e, length2, excess = moves
    sine = dr.sqrt(dr.select(excess > LEAST, excess, LEAST))
    by_length2 = 1 / length2
    results: list[Any] = [0] * 8
    for angle, sign in edges:
        s, c = dr.sincos(0.5 * angle - plane.gamma)
        cos_t, _, cos_i, _, lobe, _ = _direction(surface, plane, s, c)
        by_D = 1 / dr.fma(plane.w2 * c, c, s * s)
        lobe = dr.select(excess > 0, lobe * cos_i * surface.a2 * (2 / math.pi) * by_D * by_D, 0)
        k = schlick(cos_t)
        # Middle and half angle: atan2(e, along) and arccos(cos α_v / √(e² + along²)).
        radial = cone.cos_v / sine
        by_e = dr.fma(radial, e, sign * cone.along) * by_length2
        by_along = dr.fma(radial, cone.along, -sign * e) * by_length2
        by = -1 / sine, by_along, by_e * plane.cos_psi, by_e * plane.sin_psi
        for i, x in enumerate(by):
            results[i] = dr.fma(lobe * (1 - k), x, results[i])
            results[4 + i] = dr.fma(lobe * k, x, results[4 + i])
    return results


@cache
def _dense(n):
    """Gauss's nodes in (0, 1), pushed toward the ends, and their weights."""
    rule = []
    for x, w in legendre(n):
        angle = math.pi * (x - 0.5)
        even, pushed = 1 - DENSE, 0.5 * DENSE
        rule.append((even * x + pushed * (1 + math.sin(angle)), w * (even + pushed * math.pi * math.cos(angle))))
    return tuple(rule)
