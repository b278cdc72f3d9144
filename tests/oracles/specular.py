"""Specular occlusion from its definitions, in float64: rings about one axis, Gauss's rule between their kinks.

The azimuths of a ring that are inside a cone come from the law of cosines; all else is summed. Angles in radians.
"""

from itertools import pairwise

import numpy as np

_X, _W = np.polynomial.legendre.leggauss(48)


def panels(edges, x=_X, w=_W):
    """(nodes, weights) of Gauss's rule between consecutive edges, for integrands with square roots at the edges."""
    u, w = np.pi * (x + 1) / 2, w * np.pi / 2
    nodes, weights = [np.empty(0)], [np.empty(0)]
    for low, high in pairwise(edges):
        nodes.append((low + high) / 2 - (high - low) / 2 * np.cos(u))
        weights.append(w * (high - low) / 2 * np.sin(u))
    return np.concatenate(nodes), np.concatenate(weights)


def half_azimuth(t, alpha, beta):
    """Half of the azimuth of rings at the angle ``t`` that is in a cone of half angle ``alpha``, axis ``beta`` away."""
    numerator = np.cos(alpha) - np.cos(beta) * np.cos(t)
    denominator = np.sin(beta) * np.sin(t)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(denominator > 0, numerator / denominator, np.where(numerator <= 0, -1.0, 1.0))
    return np.arccos(np.clip(ratio, -1, 1))


def kinks(alpha, beta):
    return {abs(alpha - beta), alpha + beta, 2 * np.pi - alpha - beta}


def _edges(low, high, inner):
    return sorted({low, high} | {float(k) for k in inner if low < k < high})


def cap_intersection(a1, a2, beta):
    """Solid angle of two caps: rings of the first, which is narrow in what needs digits."""
    t, w = panels(_edges(0.0, a1, kinks(a2, beta)))
    return float(np.sum(w * 2 * half_azimuth(t, a2, beta) * np.sin(t)))


def cap(alpha):
    return 4 * np.pi * np.sin(alpha / 2) ** 2


def cap_share(alpha_v, alpha_s, beta):
    return cap_intersection(alpha_s, alpha_v, beta) / cap(alpha_s)


def planar_share(alpha_v, alpha_s, beta):
    """Share of a disc that is on one side of a line: what :func:`cap_share` tends to for narrow reflection cones."""
    x = np.clip((alpha_v - beta) / alpha_s, -1, 1)
    return (np.arccos(-x) + x * np.sqrt(1 - x * x)) / np.pi


def ggx(cos_h, alpha):
    return alpha**2 / (np.pi * (cos_h**2 * (alpha**2 - 1) + 1) ** 2)


def cone_lobe(alpha_v, beta, lobe, width):
    """Share of an isotropic lobe about a direction that a cone leaves.

    Args:
        lobe: function of the angle from the direction, up to 90°.
        width: angle at which the lobe has fallen off, for the choice of rings.
    """
    rings = {width * 4.0**k for k in range(-3, 8)}
    t, w = panels(_edges(0.0, np.pi / 2, kinks(alpha_v, beta) | rings))
    mass = w * lobe(t) * np.sin(t)
    return float(np.sum(mass * half_azimuth(t, alpha_v, beta)) / (np.pi * np.sum(mass)))


def lobe_ggx(alpha):
    return lambda t: ggx(np.cos(t / 2), alpha) * np.cos(t)


def lobe_phong(p):
    return lambda t: np.cos(t / 2) ** p * np.cos(t)


def lobe_reflection(p):
    return lambda t: np.cos(t) ** (p + 1)


def brdf(wi, wo, alpha):
    """(a, b) of f_r cos_i = F₀ a + b of directions about the normal z, (…, 3)."""
    h = wi + wo
    h = h / np.linalg.norm(h, axis=-1, keepdims=True)
    ci, co = wi[..., 2], wo[..., 2]
    k = (1 - np.sum(wo * h, axis=-1)) ** 5
    g_i, g_o = (np.sqrt(alpha**2 + (1 - alpha**2) * c**2) for c in (ci, co))
    lobe = ggx(h[..., 2], alpha) * 0.5 / (co * g_i + ci * g_o) * ci
    lobe = np.where(ci > 0, lobe, 0.0)
    return lobe * (1 - k), lobe * k


def geometry(beta, chi, theta_o):
    """(ω_o, ω_r, b) where the normal is z and b is ``beta`` from ω_r, at χ = 0 toward the normal."""
    s, c = np.sin(theta_o), np.cos(theta_o)
    wr, wo, en = np.array([s, 0, c]), np.array([-s, 0, c]), np.array([-c, 0, s])
    b = np.cos(beta) * wr + np.sin(beta) * (np.cos(chi) * en + np.sin(chi) * np.array([0, 1, 0]))
    return wo, wr, b


def cone_brdf(alpha_v, beta, chi, alpha, theta_o):
    """(A_V, B_V): rings about the normal, finer and finer toward the reflected direction and the horizon."""
    wo, _, b = geometry(beta, chi, theta_o)
    tilt, azimuth = np.arctan2(np.hypot(b[0], b[1]), b[2]), np.arctan2(b[1], b[0])
    near = [alpha * 2.0**k for k in range(-1, 12)]
    half = np.pi / 2
    wanted = kinks(alpha_v, tilt) | {theta_o} | {theta_o + s * d for d in near for s in (-1, 1)}
    # What grazes is shadowed within an angle from the horizon like the view vector's.
    wanted |= {half - (half - theta_o) * 2.0**k for k in range(-4, 6)}
    edges = _edges(0.0, half, wanted)
    theta, weight = panels(edges, *np.polynomial.legendre.leggauss(24))
    Phi = half_azimuth(theta, alpha_v, tilt)
    across = [d / max(np.sin(theta_o), 1e-3) for d in near]
    turns = (0.0, 2 * np.pi, -2 * np.pi)
    wanted = set(turns) | {m + s * d for m in turns for d in across for s in (-1, 1)}
    total, (x, wx) = np.zeros(2), np.polynomial.legendre.leggauss(16)
    for t, w, p in zip(theta, weight, Phi, strict=True):
        if p <= 0:
            continue
        e = np.array(_edges(azimuth - p, azimuth + p, wanted))
        mid, half_width = (e[1:] + e[:-1]) / 2, (e[1:] - e[:-1]) / 2
        phi = (mid[:, None] + half_width[:, None] * x).ravel()
        d = np.stack([np.sin(t) * np.cos(phi), np.sin(t) * np.sin(phi), np.full_like(phi, np.cos(t))], axis=-1)
        total += w * np.sin(t) * (np.stack(brdf(d, wo, alpha)) @ (half_width[:, None] * wx).ravel())
    return total


def environment_brdf(alpha, theta_o):
    """(A, B) over the hemisphere: a cone of 90° about the normal."""
    return cone_brdf(np.pi / 2, theta_o, 0.0, alpha, theta_o)
