"""An estimate with directions over the sphere and the floor, and estimates that are known exactly."""

from functools import cache

import numpy as np
from _scene import camera, trace

import gtao
from gtao.io import Directions


@cache
def estimate(weighting="cosine"):
    z, _, n = trace()
    n = np.where(np.isfinite(z)[..., None], n, (0.0, 0.0, 1.0))
    g = gtao.GBuffer(z.astype(np.float32), n.astype(np.float32), camera())
    return gtao.ambient_occlusion(g, gtao.GTAO(radius=2.0, n_slices=4, weighting=weighting, directional=True))


def random_directions(n, seed=0):
    d = np.random.default_rng(seed).normal(size=(n, 3))
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def bent(directions, visibility=0.5):
    """Unit vectors in one row of pixels."""
    d = np.asarray(directions, dtype=np.float64).reshape(1, -1, 3)
    return Directions(visibility=np.broadcast_to(visibility, d.shape[:2]).astype(np.float64), bent_normal=d)


def cone(axis, x, weighting="cosine"):
    """Visibility, mean direction and coefficients where a cone about the normal ``axis`` with the cosine ``x`` of its
    half angle is all that is visible, by Gauss-Legendre quadrature of the definitions.
    """
    t, w = np.polynomial.legendre.leggauss(16)  # the integrands are polynomials of degree 3 at most
    t, w = 0.5 * (1 + x) + 0.5 * (1 - x) * t, 0.5 * (1 - x) * w
    f = t if weighting == "cosine" else np.ones_like(t)
    kernels = [2 * np.pi * np.sum(w * f * p) for p in (np.ones_like(t), t, (3 * t * t - 1) / 2)]
    measure = np.pi if weighting == "cosine" else 2 * np.pi
    X, Y, Z = axis
    y1, y2 = np.sqrt(3 / (4 * np.pi)), np.sqrt(15 / (4 * np.pi))
    basis = [
        *[np.sqrt(1 / (4 * np.pi))],
        *[y1 * Y, y1 * Z, y1 * X],
        *[y2 * X * Y, y2 * Y * Z, np.sqrt(5 / (16 * np.pi)) * (3 * Z * Z - 1), y2 * X * Z, y2 / 2 * (X * X - Y * Y)],
    ]
    sh = np.repeat(kernels, (1, 3, 5)) * np.array(basis)
    return kernels[0] / measure, np.asarray(axis) * kernels[1] / measure, sh
