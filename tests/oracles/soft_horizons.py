"""Soft horizons of single pixels, float64 NumPy: Boltzmann's mean written out, arcs by quadrature."""

import numpy as np
from scipy import special

from . import slice_march, slice_oracle
from .fields import Field

#: Arcs whose upper end rises less above the tangent plane, in radians, do not close a gap below them.
RELIEF = 0.05


def boltzmann_mean(values, temperature: float) -> float:
    """Σ c exp(c/τ) / Σ exp(c/τ)."""
    c = np.asarray(values, dtype=np.float64)
    return float(special.softmax(c / temperature) @ c)


def greatest_bias(temperature: float, n: int) -> float:
    """How far the mean of n + 1 values may lie below the greatest of them."""
    return temperature * special.lambertw(n / np.e).real


def visibility(
    field: Field,
    row: int,
    column: int,
    *,
    temperature,
    n_slices,
    n_steps,
    radius=np.inf,
    falloff=None,
    weighting="cosine",
) -> float:
    """Mean over slices at azimuths π(i + ½)/n, uniform steps.

    Args:
        falloff: (start, end) of a linear attenuation toward the tangent plane instead of the exact cut at ``radius``.
    """
    P, N = slice_march.point(field, row, column), field.normal_v[row, column]
    V = slice_march.view_dir(field, row, column)
    total = 0.0
    for i in range(n_slices):
        phi = np.pi * (i + 0.5) / n_slices
        nV, nT = N @ V, N @ slice_oracle.tangent(V, phi)
        gamma = np.arctan2(nT, nV)
        ends = []
        for side in (-1, 1):
            angle = phi if side > 0 else phi + np.pi
            texels, _ = slice_march.texels(field, row, column, angle, radius=radius, n_steps=n_steps)
            low = np.cos(gamma + side * np.pi / 2)
            arcs = [blocked_arc(field, texel, P, V, radius, falloff, low) for texel in texels]
            upper = boltzmann_mean([low, *(max(c, low) for c, _ in arcs)], temperature)
            counts = np.cos(abs(gamma + side * np.pi / 2) - RELIEF)
            lower = min((end for c, end in arcs if c > counts), default=low)
            ends.append((upper, min(max(lower, low), upper)))
        (u0, l0), (u1, l1) = ends
        total += _open(weighting, nV, nT, -np.arccos(u0), np.arccos(u1))
        total += _open(weighting, nV, nT, -np.pi, -np.arccos(l0)) + _open(weighting, nV, nT, np.arccos(l1), np.pi)
    return total / n_slices


def blocked_arc(field, texel, P, V, radius, falloff, low):
    """Cosines of the ends of the arc that the solid behind a sample blocks; 1 and -1 for none."""
    origin, ray = slice_march.eye_ray(field, *texel)
    z = field.view_z[texel]
    D = origin + z * ray - P
    distance = np.linalg.norm(D)
    c = D @ V / distance
    if falloff is not None:
        start, end = falloff
        return low + np.clip((end - distance) / (end - start), 0, 1) * (c - low), -1.0
    if np.isinf(radius):
        return c, -1.0
    # |origin + s ray - P|² = r²
    o = origin - P
    a, b, k = ray @ ray, o @ ray, o @ o - radius**2
    if b * b <= a * k:
        return -1.0, 1.0
    near, far = (-b - np.sqrt(b * b - a * k)) / a, (-b + np.sqrt(b * b - a * k)) / a
    if far < z:
        return -1.0, 1.0
    first, last = (origin + s * ray - P for s in (max(near, z), far))
    return first @ V / np.linalg.norm(first), last @ V / np.linalg.norm(last)


def _open(weighting, nV, nT, a, b):
    gamma = np.arctan2(nT, nV)
    a, b = max(a, gamma - np.pi / 2), min(b, gamma + np.pi / 2)
    if weighting == "uniform":
        return 0.5 * slice_oracle.integrate(lambda t: np.abs(np.sin(t)), a, b)
    return slice_oracle.integrate(lambda t: (nV * np.cos(t) + nT * np.sin(t)) * np.abs(np.sin(t)), a, b)
