"""Polynomials for functions of single precision, made from the function itself where a kernel is imported."""

import math

import drjit as dr

__all__ = ["evaluate", "interpolated"]


def interpolated(f, low, high, n):
    """Coefficients, lowest first, of the polynomial that meets f at the n Chebyshev points of [low, high]."""
    points = [low + (high - low) * (1 + math.cos(math.pi * (k + 0.5) / n)) / 2 for k in range(n)]
    differences = [f(x) for x in points]
    for order in range(1, n):
        for k in reversed(range(order, n)):
            differences[k] = (differences[k] - differences[k - 1]) / (points[k] - points[k - order])
    coefficients = [0.0] * n
    for x, difference in zip(reversed(points), reversed(differences), strict=True):
        coefficients = [low - x * high for low, high in zip([0.0, *coefficients[:-1]], coefficients, strict=True)]
        coefficients[0] += difference
    return tuple(coefficients)


def evaluate(coefficients, x):
    """The polynomial at x."""
    value = dr.fma(x, coefficients[-1], coefficients[-2])
    for coefficient in coefficients[-3::-1]:
        value = dr.fma(value, x, coefficient)
    return value
