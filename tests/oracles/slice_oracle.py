"""Slice and hemisphere integrals by quadrature, from their definitions, in float64.

Notation: V view vector, T unit tangent of the slice, direction ω(θ) = cos θ V + sin θ T, normal component in the slice
plane (nV, nT) = |np| (cos γ, sin γ), measure |sin θ| dθ dφ.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.integrate import quad

_QUAD = {"epsabs": 1e-13, "epsrel": 1e-13, "limit": 200}


@dataclass(frozen=True)
class SliceIntegrals:
    """Integrals of one slice over a visible arc; every one but ``uniform`` carries the factor (nV cos θ + nT sin θ)."""

    cosine: float
    uniform: float
    t0: float
    t1: float
    ss: float
    sc: float
    cc: float


def integrate(f, a: float, b: float) -> float:
    """Quadrature of ``f`` over [a, b], split at 0 where |sin θ| has its kink."""
    if b <= a:
        return 0.0
    edges = [a, 0.0, b] if a < 0.0 < b else [a, b]
    return sum(quad(f, lo, hi, **_QUAD)[0] for lo, hi in pairwise(edges))


def arc(nV: float, nT: float, a: float, b: float) -> SliceIntegrals:
    """All slice integrals over the arc [a, b] ⊂ [-π, π] as given, without any clamp to the normal hemisphere."""
    sin, cos, abs_ = np.sin, np.cos, np.abs

    def weighted(g):
        return integrate(lambda t: (nV * cos(t) + nT * sin(t)) * abs_(sin(t)) * g(t), a, b)

    return SliceIntegrals(
        cosine=weighted(lambda t: 1.0),
        uniform=integrate(lambda t: abs_(sin(t)), a, b),
        t0=weighted(sin),
        t1=weighted(cos),
        ss=weighted(lambda t: sin(t) ** 2),
        sc=weighted(lambda t: sin(t) * cos(t)),
        cc=weighted(lambda t: cos(t) ** 2),
    )


def clamped_arc(nV: float, nT: float, h0: float, h1: float) -> SliceIntegrals:
    """Slice integrals over the part of [h0, h1] that lies in the hemisphere of the normal (|θ - γ| ≤ π/2)."""
    gamma = np.arctan2(nT, nV)
    return arc(nV, nT, max(h0, gamma - np.pi / 2), min(h1, gamma + np.pi / 2))


def clamped_cosine(nV: float, nT: float, h0: float, h1: float) -> float:
    """:func:`clamped_arc` for the cosine-weighted integral alone."""
    gamma = np.arctan2(nT, nV)
    a, b = max(h0, gamma - np.pi / 2), min(h1, gamma + np.pi / 2)
    return integrate(lambda t: (nV * np.cos(t) + nT * np.sin(t)) * np.abs(np.sin(t)), a, b)


def unit(v) -> np.ndarray:
    """Vector(s) divided by their length."""
    v = np.asarray(v, dtype=np.float64)
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def tangent(V, phi) -> np.ndarray:
    """Unit tangent T(φ): (cos φ, sin φ, 0) carried from +z to ``V`` by the minimal rotation (Rodrigues)."""
    V = unit(V)
    phi = np.asarray(phi, dtype=np.float64)
    flat = np.stack([np.cos(phi), np.sin(phi), np.zeros_like(phi)], axis=-1)
    axis = np.cross([0.0, 0.0, 1.0], V)
    sine, cosine = np.linalg.norm(axis), V[2]
    if sine < 1e-15:
        return flat if cosine > 0 else flat * np.array([1.0, -1.0, 0.0])
    k = axis / sine
    return flat * cosine + np.cross(k, flat) * sine + k * (flat @ k)[..., None] * (1.0 - cosine)


def azimuth_frame(V) -> tuple[np.ndarray, np.ndarray]:
    """Axes (e1, e2) of the azimuth about ``V`` in which horizon functions are given: e1 is +x made orthogonal to V."""
    V = unit(V)
    e1 = unit(np.array([1.0, 0.0, 0.0]) - V[0] * V)
    return e1, np.cross(V, e1)


def harmonic_horizon(c: float, harmonics):
    """Horizon polar angle about V as a function of azimuth: h(φ) = c + Σ a cos(k φ + p) for (a, k, p) in harmonics."""

    def horizon(phi):
        return c + sum(a * np.cos(k * phi + p) for a, k, p in harmonics)

    return horizon


def horizon_slices(inputs, n: int, offset: float):
    """n slices at azimuths π(i + offset)/n of a point with a harmonic horizon.

    Args:
        inputs: mapping with "N", "V" and the "c" and "harmonics" of :func:`harmonic_horizon`.

    Returns:
        Per slice: n_V, n_T, horizons h0 and h1 (not clamped), tangent.
    """
    N, V = unit(inputs["N"]), unit(inputs["V"])
    e1, e2 = azimuth_frame(V)
    phi = np.pi * (np.arange(n) + offset) / n
    T = np.cos(phi)[:, None] * e1 + np.sin(phi)[:, None] * e2
    horizon = harmonic_horizon(inputs["c"], inputs["harmonics"])
    h0, h1 = -np.clip(horizon(phi + np.pi), 0, np.pi), np.clip(horizon(phi), 0, np.pi)
    return np.full(n, N @ V), T @ N, h0, h1, T


@dataclass(frozen=True)
class HemisphereIntegrals:
    """Two-dimensional integrals over the visible part of the hemisphere."""

    cosine: float
    uniform: float
    bent: np.ndarray
    uniform_bent: np.ndarray
    second: np.ndarray


def hemisphere(N, V, horizon, n_azimuth: int = 4096, n_polar: int = 64) -> HemisphereIntegrals:
    """Visibility of a point whose visible set is {polar angle about V ≤ horizon(azimuth)} ∩ {⟨N, ω⟩ ≥ 0}.

    Direct quadrature over solid angle in polar coordinates about V, azimuth over the full circle: no slices are
    paired, no closed form is used. Along each azimuth the set is an interval of polar angle, whose ends come from the
    two constraints; Gauss-Legendre nodes lie inside it. The azimuth rule is the trapezium (spectral where the ends are
    smooth, error O(n_azimuth^-2) where they have kinks).

    Returns:
        cosine and uniform visibility, ∫V⟨N,ω⟩ω/π, ∫Vω/(2π) and ∫V⟨N,ω⟩ωωᵀ/π.
    """
    N, V = unit(N), unit(V)
    phi = (np.arange(n_azimuth) + 0.5) * (2.0 * np.pi / n_azimuth)
    e1, e2 = azimuth_frame(V)
    T = np.cos(phi)[:, None] * e1 + np.sin(phi)[:, None] * e2
    nV, nT = float(N @ V), T @ N
    # ⟨N, ω⟩ = R cos(θ - g) is non-negative on [g - π/2, g + π/2]; intersect with [0, horizon].
    g = np.arctan2(nT, nV)
    lo = np.maximum(0.0, g - np.pi / 2)
    hi = np.maximum(lo, np.minimum(np.clip(horizon(phi), 0.0, np.pi), g + np.pi / 2))
    x, w = np.polynomial.legendre.leggauss(n_polar)
    theta = 0.5 * (lo + hi)[:, None] + 0.5 * (hi - lo)[:, None] * x
    weight = 0.5 * (hi - lo)[:, None] * w * np.sin(theta) * (2.0 * np.pi / n_azimuth)
    omega = np.cos(theta)[..., None] * V + np.sin(theta)[..., None] * T[:, None, :]
    cosine = omega @ N
    m1 = np.einsum("ij,ijk->k", weight * cosine, omega)
    m2 = np.einsum("ij,ijk,ijl->kl", weight * cosine, omega, omega)
    return HemisphereIntegrals(
        cosine=float((weight * cosine).sum() / np.pi),
        uniform=float(weight.sum() / (2 * np.pi)),
        bent=m1 / np.pi,
        uniform_bent=np.einsum("ij,ijk->k", weight, omega) / (2 * np.pi),
        second=m2 / np.pi,
    )


def hemisphere_qmc(N, V, horizon, n: int = 1 << 16) -> float:
    """Cosine-weighted visibility by sampling: cosine-distributed directions about N, tested against the horizon.

    Independent of :func:`hemisphere` (no quadrature in polar angle about V). Error about n^-3/4 (an indicator
    function under a two-dimensional lattice).
    """
    N, V = unit(N), unit(V)
    i = np.arange(n)
    u, v = (i + 0.5) / n, (i * 0.6180339887498949) % 1.0
    local = np.stack([np.sqrt(u) * np.cos(2 * np.pi * v), np.sqrt(u) * np.sin(2 * np.pi * v), np.sqrt(1 - u)], axis=-1)
    helper = np.eye(3)[np.argmin(np.abs(N))]
    b1 = unit(np.cross(N, helper))
    omega = local[:, :1] * b1 + local[:, 1:2] * np.cross(N, b1) + local[:, 2:] * N
    e1, e2 = azimuth_frame(V)
    phi = np.arctan2(omega @ e2, omega @ e1) % (2 * np.pi)
    polar = np.arccos(np.clip(omega @ V, -1.0, 1.0))
    return float(np.mean(polar <= np.clip(horizon(phi), 0.0, np.pi)))


def unoccluded_mean(Gamma: float, n: int, offset: float) -> float:
    """Mean of n open slices at azimuths π(i + offset)/n for a normal tilted by ``Gamma`` toward azimuth 0."""
    total = 0.0
    for i in range(n):
        phi = np.pi * (i + offset) / n
        total += clamped_cosine(np.cos(Gamma), np.sin(Gamma) * np.cos(phi), -np.pi, np.pi)
    return total / n


def published_open_mean(N, V, n_azimuth: int = 64, n_polar: int = 32) -> np.ndarray:
    """Unoccluded visibility that image-uniform slices return for normals N and view directions V, both (..., 3).

    Slice i has the tangent of image azimuth π(i + ½)/n, that is (cos, sin, 0) made orthogonal to V, and the inner
    integral runs over its whole arc in the hemisphere of N, by Gauss-Legendre quadrature split at θ = 0.
    """
    N, V = unit(N)[..., None, :], unit(V)[..., None, :]
    phi = np.pi * (np.arange(n_azimuth) + 0.5) / n_azimuth
    D = np.stack([np.cos(phi), np.sin(phi), np.zeros_like(phi)], axis=-1)
    T = unit(D - np.sum(D * V, axis=-1, keepdims=True) * V)
    nV, nT = np.sum(N * V, axis=-1), np.sum(N * T, axis=-1)
    gamma = np.arctan2(nT, nV)
    x, w = np.polynomial.legendre.leggauss(n_polar)
    total = 0.0
    for end in (gamma - np.pi / 2, gamma + np.pi / 2):
        theta = 0.5 * end[..., None] * (1 + x)
        weight = 0.5 * np.abs(end)[..., None] * w * np.abs(np.sin(theta))
        total = total + np.sum(weight * (nV[..., None] * np.cos(theta) + nT[..., None] * np.sin(theta)), axis=-1)
    return total.mean(axis=-1)


def slice_density_cdf(Gamma: float, phi: float) -> float:
    """∫_0^φ of the slice density: the unoccluded cosine-weighted slice integral divided by π."""

    def density(p):
        nV, nT = np.cos(Gamma), np.sin(Gamma) * np.cos(p)
        gamma = np.arctan2(nT, nV)
        return arc(nV, nT, gamma - np.pi / 2, gamma + np.pi / 2).cosine / np.pi

    nodes, weights = np.polynomial.legendre.leggauss(48)
    return float(sum(w * density(0.5 * phi * (1 + x)) for x, w in zip(nodes, weights, strict=True)) * 0.5 * phi)


def project(P, f=(1.0, 1.0)) -> np.ndarray:
    """Pinhole image of view-space points (camera along -z), y up, in units of the focal length(s)."""
    P = np.asarray(P, dtype=np.float64)
    return np.stack([f[0] * P[..., 0] / -P[..., 2], f[1] * P[..., 1] / -P[..., 2]], axis=-1)


def screen_direction(P, T, f=(1.0, 1.0)) -> np.ndarray:
    """Unit image direction (y up) in which P + ε T moves: central difference of the projection."""
    P, T = np.asarray(P, dtype=np.float64), np.asarray(T, dtype=np.float64)
    eps = 1e-5 * np.linalg.norm(P)
    return unit(project(P + eps * T, f) - project(P - eps * T, f))
