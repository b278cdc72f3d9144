"""Integrals of products of three real spherical harmonics, Γ_ijk = ∫ Y_i Y_j Y_k dω, and products of functions by them.

Computed from the harmonics as polynomials, in fractions: exact up to one square root.
"""

import math
from fractions import Fraction
from functools import cache

import drjit as dr

from .sh import norm2, polar

__all__ = ["product", "table"]


@cache
def _polynomial(band, m):
    """Y_lm without its norm, as {(i, j, k): coefficient of x^i y^j z^k}."""
    # Re or Im of (x + iy)^|m|: every second term of the binomial.
    degree, odd = abs(m), int(m < 0)
    plane = {(degree - j, j): (-1) ** (j // 2) * math.comb(degree, j) for j in range(odd, degree + 1, 2)}
    return {(i, j, k): a * c for (i, j), a in plane.items() for k, c in enumerate(polar(band, degree)) if c}


def _times(a, b):
    result = {}
    for p, u in a.items():
        for q, v in b.items():
            key = (p[0] + q[0], p[1] + q[1], p[2] + q[2])
            result[key] = result.get(key, 0) + u * v
    return result


@cache
def _odd_factorial(n):
    """(n - 1)!! of an even number n."""
    return math.prod(range(n - 1, 0, -2))


def _integral(polynomial):
    """∫ over the sphere, divided by 4π: (i-1)!! (j-1)!! (k-1)!! / (i+j+k+1)!! of even powers, 0 of others."""
    total = Fraction(0)
    for powers, c in polynomial.items():
        if not any(n % 2 for n in powers):
            total += c * math.prod(map(_odd_factorial, powers)) / _odd_factorial(sum(powers) + 2)
    return total


@cache
def table(order):
    """All Γ_ijk with i <= j <= k < (order + 1)² that are not 0, as (i, j, k, value); theory, eq. (116)."""
    names = [(band, m) for band in range(order + 1) for m in range(-band, band + 1)]
    entries = []
    for i, first in enumerate(names):
        for j, second in enumerate(names[i:], i):
            pair = _times(_polynomial(*first), _polynomial(*second))
            for k, third in enumerate(names[j:], j):
                # Sums of angles about z and of bands: others integrate to 0, and the parity of the product too.
                if third[0] > first[0] + second[0] or (first[0] + second[0] + third[0]) % 2:
                    continue
                value = _integral(_times(pair, _polynomial(*third)))
                if value:
                    scale = math.prod(norm2(band, abs(m)) for band, m in (first, second, third))
                    entries.append((i, j, k, 4 * math.sqrt(scale / math.pi) * float(value)))
    return tuple(entries)


def product(f, g, order, wanted):
    """Coefficients up to band ``wanted`` of the product of two functions that have no bands above ``order``.

    Args:
        f, g: (order + 1)² coefficients each.
        wanted: at most ``order``.
    """
    total = [0] * (wanted + 1) ** 2
    for i, j, k, value in table(order):
        for a, b, c in {(i, j, k), (j, i, k), (k, i, j)}:
            if a >= len(total):
                continue
            # Γ is symmetric: what multiplies Y_a Y_b Y_c also multiplies Y_a Y_c Y_b.
            pair = f[b] * g[c] if b == c else dr.fma(f[b], g[c], f[c] * g[b])
            total[a] = dr.fma(pair, value, total[a])
    return total
