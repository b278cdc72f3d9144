"""Cones of visibility by quadrature, in float64: what is inside the cone and above the tangent plane, ring by ring.

At the angle θ from the normal the cone of half angle α about an axis tilted by β covers the azimuths
|φ| < Φ(θ) = arccos((cos α - cos β cos θ) / (sin β sin θ)) around the axis. Quadrature over θ, nothing in closed form
but Φ; the rings between which it has its kinks are integrated one by one.
"""

from itertools import pairwise

import numpy as np

from oracles.slice_oracle import unit

_X, _W = np.polynomial.legendre.leggauss(160)
_AZIMUTH = 24
"""Gauss points in azimuth: exact for harmonics up to order 4 to rounding, cosines of up to 4 φ over [-π, π]."""


def directions(n, b, alpha: float):
    """(K, 3) unit directions and (K,) weights whose sums are integrals over the cone above the tangent plane."""
    n, b = unit(n), unit(b)
    beta = np.arctan2(np.linalg.norm(np.cross(n, b)), n @ b)
    across = b - (n @ b) * n
    if np.linalg.norm(across) < 1e-12:
        across = np.cross(n, [1.0, 0, 0] if abs(n[0]) < 0.7 else [0, 1.0, 0])
    # Of a short difference rounding leaves a share along the normal.
    f = unit(unit(across) - (unit(across) @ n) * n)
    g = np.cross(n, f)
    kinks = {0.0, np.pi / 2} | {abs(beta - alpha), beta + alpha, 2 * np.pi - alpha - beta}
    edges = sorted(k for k in kinks if 0 <= k <= np.pi / 2)
    theta, weight = [], []
    for low, high in pairwise(edges):
        # Φ starts like a square root at its kinks: θ = mid - half cos u is smooth in u there.
        u = np.pi * (_X + 1) / 2
        theta.append((low + high) / 2 - (high - low) / 2 * np.cos(u))
        weight.append(_W * np.pi / 2 * (high - low) / 2 * np.sin(u))
    theta, weight = np.concatenate(theta), np.concatenate(weight)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = (np.cos(alpha) - np.cos(beta) * np.cos(theta)) / (np.sin(beta) * np.sin(theta))
    inside = np.cos(alpha) <= np.cos(beta) * np.cos(theta)
    ratio = np.where(np.isfinite(ratio), ratio, np.where(inside, -1.0, 1.0))
    Phi = np.arccos(np.clip(ratio, -1, 1))
    x, w = np.polynomial.legendre.leggauss(_AZIMUTH)
    phi = Phi[:, None] * x
    s, c = np.sin(theta)[:, None, None], np.cos(theta)[:, None, None]
    d = c * n + s * (np.cos(phi)[..., None] * f + np.sin(phi)[..., None] * g)
    weights = (weight * np.sin(theta) * Phi)[:, None] * w
    return d.reshape(-1, 3), weights.ravel()


def moments(n, b, alpha: float):
    """Solid angle, and of the cosine to the normal: ∫ c, ∫ c ω, ∫ c ω ωᵀ."""
    d, w = directions(n, b, alpha)
    c = w * (d @ unit(n))
    return w.sum(), c.sum(), c @ d, np.einsum("k,ki,kj->ij", c, d, d)


def energy(alpha: float, beta: float) -> float:
    """Cosine-weighted visibility of a cone whose axis is tilted by ``beta``."""
    return moments([0, 0, 1], [np.sin(beta), 0, np.cos(beta)], alpha)[1] / np.pi
