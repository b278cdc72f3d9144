"""Reflection of the light in a cone by brute force: stratified visible normals, counted if they reflect into it."""

import numpy as np


def frame(beta, theta_o, chi):
    """Axis of the cone, reflected direction and direction to the camera; the normal is z."""
    w_r = np.array([np.sin(theta_o), 0.0, np.cos(theta_o)])
    e_n = np.array([-np.cos(theta_o), 0.0, np.sin(theta_o)])
    y = np.array([0.0, 1.0, 0.0])
    b = np.cos(beta) * w_r + np.sin(beta) * (np.cos(chi) * e_n + np.sin(chi) * y)
    return b, w_r, np.array([-np.sin(theta_o), 0.0, np.cos(theta_o)])


def cone_terms(alpha_v, beta, alpha, theta_o, chi, n=2000):
    """(A_V, B_V) from n² microfacet normals in strata of the spherical cap of Dupuy and Benyoub (2023).

    The density of a reflected direction is D G1 / (4 cos θ_o), so that a normal counts for G2 / G1.
    """
    b, _, wo = frame(beta, theta_o, chi)
    u, v = np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(n) + 0.5) / n)
    stretched = np.array([alpha * wo[0], 0.0, wo[2]]) / np.hypot(alpha * wo[0], wo[2])
    z = 1 - v * (1 + stretched[2])
    r = np.sqrt(np.maximum(1 - z * z, 0))
    m = np.stack([r * np.cos(2 * np.pi * u), r * np.sin(2 * np.pi * u), z]) + stretched[:, None, None]
    h = np.stack([alpha * m[0], alpha * m[1], np.maximum(m[2], 0)])
    h /= np.sqrt((h * h).sum(0))
    vh = np.tensordot(wo, h, 1)
    wi = 2 * vh * h - wo[:, None, None]
    seen = (wi[2] > 0) & (np.tensordot(b, wi, 1) >= np.cos(alpha_v))

    def smith(c):
        """Λ of the slopes of GGX."""
        tangent2 = (1 - c * c) / np.maximum(c * c, 1e-300)
        return 0.5 * (np.sqrt(1 + alpha * alpha * tangent2) - 1)

    here, there = smith(wo[2]), smith(np.where(seen, wi[2], 1.0))
    weight = np.where(seen, (1 + here) / (1 + here + there), 0.0)
    k = (1 - vh) ** 5
    return np.array([(weight * (1 - k)).mean(), (weight * k).mean()])
