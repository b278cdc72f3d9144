"""Spherical harmonics of a cone of visibility times the clamped cosine to a normal that leans away from its axis.

:mod:`gtao.kernels.cut_integrals` knows them in the frame of normal and axis. What is symmetric about the plane of the
two is in band l a sum of zonal functions about l + 1 directions in it, and those are turned by their axes alone.
"""

import math
from functools import cache
from typing import Any

import drjit as dr

from .cut_integrals import local
from .sh import basis, norm2, polar

__all__ = ["clipped_cone", "tilt"]


def tilt(n, b):
    """(cos β, sin β, f) of an axis: its angle to the normal and the unit vector across the normal toward it.

    An axis below the tangent plane counts as moved up to it. Where axis and normal are one, f is some vector across.

    Args:
        n, b: unit vectors, (x, y, z) each.
    """
    single = dr.type_v(n[0]) is dr.VarType.Float32
    cb = _dot(n, b)
    across = [dr.fma(-cb, n_k, b_k) for n_k, b_k in zip(n, b, strict=True)]
    # The axis itself is moved by a little where there is none, which keeps its derivatives.
    little = 1e-6 if single else 1e-10
    alone = _dot(across, across) < little * little
    aside = abs(n[0]) < 0.7
    ex, ey = dr.select(aside, 1, 0), dr.select(aside, 0, 1)
    along = ex * n[0] + ey * n[1]
    extra = dr.fma(-along, n[0], ex), dr.fma(-along, n[1], ey), -along * n[2]
    # Opposite to the normal no direction across is nearer than another: a long way has no derivatives to speak of.
    way = dr.select(cb > 0, 2 * little, 1)
    across = [dr.select(alone, dr.fma(way, e, a), a) for e, a in zip(extra, across, strict=True)]
    length = dr.sqrt(_dot(across, across))
    above = cb > 0
    sb = dr.select(above & (length < 1), length, 1)
    return dr.select(above, cb, 0), sb, [a / length for a in across]


def clipped_cone(n, c, cb, sb, f, order):
    """The (order + 1)² coefficients of cone × cosine, in the frame of the vectors.

    Args:
        n: unit normal (x, y, z).
        c: cosine of the cone's half angle, in [-sin β, 1].
        cb, sb, f: :func:`tilt` of its axis.
        order: highest band, 0 to 4.
    """
    # Parts of degree m fade out like sin^m β: below ``least`` they are scaled, with the right derivatives in b too.
    least = 1e-3 if dr.type_v(c) is dr.VarType.Float32 else 1e-5
    tilted = sb > least
    share = dr.select(tilted, 1, sb / least)
    cb, sb = dr.select(tilted, cb, math.sqrt(1 - least * least)), dr.select(tilted, sb, least)
    parts = local(c, cb, sb, order)
    power: Any = 1
    for m in range(1, order + 1):
        power = power * share
        parts |= {(band, m): parts[band, m] * power for band in range(m, order + 1)}
    result: list[Any] = [0] * (order + 1) ** 2
    for j, a in enumerate(_angles(order)):
        direction = [math.cos(a) * n_k + math.sin(a) * f_k for n_k, f_k in zip(n, f, strict=True)] if j else n
        harmonics = basis(*direction, order)
        for band in range(j, order + 1):
            weight = 0 if j else parts[band, 0] * math.sqrt(4 * math.pi / (2 * band + 1))
            for m in range(1, band + 1):
                weight = dr.fma(parts[band, m], _turn(order, band)[j][m], weight)
            for i in range(band * band, (band + 1) ** 2):
                result[i] = dr.fma(weight, harmonics[i], result[i])
    return result


def _angles(order):
    """Angles from the normal toward f whose zonal functions span what is symmetric: the first l + 1 of them band l."""
    return [math.pi * j / (order + 1) for j in range(order + 1)]


@cache
def _turn(order, band):
    """Rows j: how much of the zonal function Y_l about direction j is in each harmonic of degree m = 0, 1, … l."""
    angles = _angles(order)[: band + 1]
    values = [[_symmetric(band, m, math.sin(a), math.cos(a)) for a in angles] for m in range(band + 1)]
    return _inverse(values)


def _symmetric(band, m, x, z):
    factor = math.sqrt(norm2(band, m) / math.pi)
    return factor * x**m * sum(float(c) * z**k for k, c in enumerate(polar(band, m)))


def _inverse(matrix):
    """By Gauss and Jordan, largest pivots first."""
    n = len(matrix)
    rows = [[*row, *(float(i == k) for k in range(n))] for i, row in enumerate(matrix)]
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(rows[i][k]))
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [v / rows[k][k] for v in rows[k]]
        for i in range(n):
            if i != k:
                rows[i] = [v - rows[i][k] * w for v, w in zip(rows[i], rows[k], strict=True)]
    return [row[n:] for row in rows]


def _dot(a, b):
    return dr.fma(a[0], b[0], dr.fma(a[1], b[1], a[2] * b[2]))
