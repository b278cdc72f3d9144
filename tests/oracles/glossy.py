"""Reflection of GGX surfaces by quadrature of its definition, in float64: n = z, the viewer in the xz plane."""

import numpy as np


def frame(theta_o, beta, chi):
    """Unit vectors to the viewer and along a cone's axis, which is ``beta`` from the reflected direction."""
    c, s = np.cos(theta_o), np.sin(theta_o)
    v, reflected, upward = np.array([-s, 0, c]), np.array([s, 0, c]), np.array([-c, 0, s])
    aside = np.cos(chi) * upward + np.sin(chi) * np.array([0.0, 1, 0])
    return v, np.cos(beta) * reflected + np.sin(beta) * aside


def split_brdf(wi, wo, alpha):
    """f_r cos θ_i of directions (…, 3), for reflectance 1 - k and k: (2, …)."""
    h = wi + wo
    h /= np.linalg.norm(h, axis=-1, keepdims=True)
    ci, co = np.maximum(wi[..., 2], 0), wo[2]
    d = alpha**2 / (np.pi * (h[..., 2] ** 2 * (alpha**2 - 1) + 1) ** 2)
    roots = [np.sqrt(alpha**2 + (1 - alpha**2) * c * c) for c in (ci, co)]
    f = d * 0.5 / (co * roots[0] + ci * roots[1]) * ci
    k = (1 - h @ wo) ** 5
    return np.stack([f * (1 - k), f * k])


def in_cone(axis, alpha_v, wo, alpha, n_polar=400, n_azimuth=1600, light=None):
    """A_V and B_V of a cone about any axis, cut by the horizon: Gauss in the polar angle, midpoints in azimuth.

    With ``light``, a function of directions (…, 3), its three colours (2, 3) as they are reflected.
    """
    x, w = np.polynomial.legendre.leggauss(n_polar)
    theta, w = alpha_v * (x + 1) / 2, alpha_v * w / 2
    phi = 2 * np.pi * (np.arange(n_azimuth) + 0.5) / n_azimuth
    across = np.cross(axis, [1.0, 0, 0] if abs(axis[0]) < 0.7 else [0, 1.0, 0])
    across /= np.linalg.norm(across)
    ring = np.cos(phi)[:, None] * across + np.sin(phi)[:, None] * np.cross(axis, across)
    wi = np.cos(theta)[:, None, None] * axis + np.sin(theta)[:, None, None] * ring
    weight = (w * np.sin(theta))[:, None] * np.full(n_azimuth, 2 * np.pi / n_azimuth)
    terms = split_brdf(wi, wo, alpha) * weight
    return terms.sum((1, 2)) if light is None else np.einsum("kij,ijc->kc", terms, light(wi))


def whole(theta_o, alpha, n=400):
    """A and B of the hemisphere: Gauss in the polar angle and in the azimuth, crowded about the plane of incidence."""
    x, w = np.polynomial.legendre.leggauss(n)
    y, w = (x + 1) / 2, w / 2
    theta, phi = np.pi / 2 * y, np.pi * y**3
    s, c = np.sin(theta)[:, None], np.cos(theta)[:, None]
    wi = np.stack(np.broadcast_arrays(s * np.cos(phi), s * np.sin(phi), c), -1)
    terms = split_brdf(wi, frame(theta_o, 0, 0)[0], alpha)
    return 2 * terms @ (3 * np.pi * y**2 * w) @ (np.pi / 2 * w * s[:, 0])
