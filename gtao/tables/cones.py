"""The intersection of two cones about a common apex, in double precision."""

from typing import Any

import numpy as np

__all__ = ["intersection", "visible_share"]


def intersection(a: Any, b: Any, beta: Any) -> np.ndarray:
    """Solid angle of the intersection of two cones, each within a hemisphere.

    Girard's theorem about the spherical triangle of the axes and a crossing of the rims, in the form that does not
    cancel for small cones.

    Args:
        a, b: half angles in [0, π/2], radians.
        beta: angle between the axes in [0, π].
    """
    a, b, beta = (np.asarray(x, np.float64) for x in (a, b, beta))
    s, s_a, s_b, s_beta = 0.5 * (a + b + beta), 0.5 * (b + beta - a), 0.5 * (a + beta - b), 0.5 * (a + b - beta)
    inside, apart = (s_a <= 0) | (s_b <= 0), s_beta <= 0
    crossing = ~inside & ~apart

    def where_crossing(function, x):
        return function(np.where(crossing, x, 1.0))

    sin_s, sin_a, sin_b, sin_beta = (where_crossing(np.sin, x) for x in (s, s_a, s_b, s_beta))
    t_a = 2 * np.arctan2(np.sqrt(sin_a * sin_beta), np.sqrt(sin_s * sin_b))
    t_b = 2 * np.arctan2(np.sqrt(sin_b * sin_beta), np.sqrt(sin_s * sin_a))
    tangents = np.prod([where_crossing(np.tan, 0.5 * x) for x in (s, s_a, s_b, s_beta)], axis=0)
    excess = 4 * np.arctan(np.sqrt(tangents))
    value = 4 * (t_a * np.sin(0.5 * a) ** 2 + t_b * np.sin(0.5 * b) ** 2) - 2 * excess
    whole = 4 * np.pi * np.sin(0.5 * np.minimum(a, b)) ** 2
    return np.where(apart, 0.0, np.where(inside, whole, value))


def visible_share(alpha_v: Any, alpha_s: Any, beta: Any) -> np.ndarray:
    """Share of the cone of half angle alpha_s > 0 that the cone of half angle alpha_v sees."""
    return intersection(alpha_v, alpha_s, beta) / (4 * np.pi * np.sin(0.5 * np.asarray(alpha_s, np.float64)) ** 2)
