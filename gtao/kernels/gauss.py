"""Gauss's quadrature, as numbers that kernels are traced with."""

import math
from functools import cache

__all__ = ["legendre"]


@cache
def legendre(n: int) -> tuple[tuple[float, float], ...]:
    """The ``n`` nodes of Gauss and Legendre in (0, 1), ascending, and their weights, which add up to 1.

    Exact for polynomials up to the degree 2n - 1.
    """
    rule = []
    for k in range(n):
        # Newton steps from within 1e-2 of the root of P_n are exact to rounding after five.
        x = -math.cos(math.pi * (k + 0.75) / (n + 0.5))
        for _ in range(6):
            before, p = 0.0, 1.0
            for j in range(n):
                before, p = p, ((2 * j + 1) * x * p - j * before) / (j + 1)
            slope = n * (before - x * p) / (1 - x * x)
            x -= p / slope
        rule.append((0.5 * (1 + x), 1 / ((1 - x * x) * slope * slope)))
    return tuple(rule)
