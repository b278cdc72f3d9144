"""Integrals over all directions, in float64 NumPy."""

import numpy as np


def nodes(degree: int):
    """(K, 3) directions and (K,) weights that integrate polynomials up to ``degree``: Gauss in z, equal azimuths."""
    z, w = np.polynomial.legendre.leggauss(degree // 2 + 1)
    phi = 2 * np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1)
    s = np.sqrt(1 - z * z)[:, None]
    d = np.stack([s * np.cos(phi), s * np.sin(phi), z[:, None] + 0 * phi], axis=-1)
    return d.reshape(-1, 3), np.repeat(w * 2 * np.pi / (degree + 1), degree + 1)
