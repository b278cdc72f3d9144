"""Oracles on the sphere that share nothing with the package: harmonics of SciPy, quadrature by panels, random turns."""

import math

import numpy as np
from scipy.special import sph_harm_y


def directions(n, seed=0):
    d = np.random.default_rng(seed).normal(size=(n, 3))
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def harmonics(d, order):
    """Real harmonics from SciPy's complex ones, whose factor (-1)^m is taken away: (K, n)."""
    theta, phi = np.arctan2(np.hypot(d[:, 0], d[:, 1]), d[:, 2]), np.arctan2(d[:, 1], d[:, 0])
    columns = []
    for l in range(order + 1):  # noqa: E741  (the letter of bands)
        for m in range(-l, l + 1):
            y = sph_harm_y(l, abs(m), theta, phi) * (-1) ** abs(m)
            columns.append(math.sqrt(2) * y.imag if m < 0 else (math.sqrt(2) if m else 1) * y.real)
    return np.stack(columns, axis=-1)


def rotation(seed=0):
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def local_direction(theta, phi):
    """Latitude-longitude by hand: +y is up, column 0 begins at -z, a quarter to the right is +x."""
    return np.array([math.sin(phi) * math.sin(theta), math.cos(theta), -math.cos(phi) * math.sin(theta)])


def _panels(edges, n):
    x, w = np.polynomial.legendre.leggauss(n)
    width = np.diff(edges)[:, None]
    return (edges[:-1, None] + width * (x + 1) / 2).ravel(), (width * w / 2).ravel()


def cell_nodes(height, width, n):
    """Gauss-Legendre nodes on every cell in which an interpolated map is smooth: local directions, weights."""
    centres = math.pi * (np.arange(height) + 0.5) / height
    theta, w_theta = _panels(np.concatenate([[0], centres, [math.pi]]), n)
    phi, w_phi = _panels(2 * math.pi * (np.arange(width + 1) + 0.5) / width, n)
    s = np.sin(theta)[:, None]
    d = np.stack([np.sin(phi) * s, np.cos(theta)[:, None] + 0 * phi, -np.cos(phi) * s], axis=-1)
    return d.reshape(-1, 3), (w_theta[:, None] * s * w_phi).ravel()
