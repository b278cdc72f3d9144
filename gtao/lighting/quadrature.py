"""Quadrature over the sphere: Gauss-Legendre in the cosine of the polar angle, trapezoids in the azimuth."""

import math
from functools import cache

import numpy as np

__all__ = ["sphere_nodes"]


@cache
def sphere_nodes(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Directions (K, 3) and weights (K,) that integrate polynomials up to ``degree`` exactly; weights sum to 4π."""
    z, w = np.polynomial.legendre.leggauss(degree // 2 + 1)
    n_azimuths = degree + 1
    phi = 2 * math.pi * np.arange(n_azimuths) / n_azimuths
    s = np.sqrt(1 - z * z)[:, None]
    directions = np.stack(
        [s * np.cos(phi), s * np.sin(phi), np.broadcast_to(z[:, None], (len(z), n_azimuths))], axis=-1
    ).reshape(-1, 3)
    weights = np.repeat(w * 2 * math.pi / n_azimuths, n_azimuths)
    directions.flags.writeable = weights.flags.writeable = False
    return directions, weights
