"""Visibility of simple scenes in closed form. Angles in radians, visibility 1 = open."""

import numpy as np


def profile(theta_left, theta_right, gamma=0.0):
    """Cosine-weighted visibility of a point of an extruded (two-dimensional) scene.

    The visible arc in the cross-section is [theta_left, theta_right] about the vertical, the normal leans by
    ``gamma`` (positive to the right): ½ (sin(θr - γ) - sin(θl - γ)) with the arc cut at γ ± π/2 (the string rule).
    """
    right = np.minimum(theta_right, gamma + np.pi / 2)
    left = np.maximum(theta_left, gamma - np.pi / 2)
    return 0.5 * (np.sin(right - gamma) - np.sin(left - gamma))


def profile_directions(theta_left, theta_right, gamma=0.0, weighting="cosine"):
    """Mean direction and second moments of the open directions of the same point, the scene extruded along y.

    A direction is (cos β sin ψ, sin β, cos β cos ψ) with dω = cos β dβ dψ, and ψ runs over the arc: the integrals over
    β are known, those over ψ are by Gauss-Legendre.

    Returns:
        (N, 3) and (N, 3, 3): ∫ V ω and ∫ V ω ωᵀ with the factor ⟨N, ω⟩/π = cos β cos(ψ - γ)/π (cosine) or 1/(2π).
    """
    left, right, gamma = (np.asarray(angle)[..., None] for angle in (theta_left, theta_right, gamma))
    left, right = np.maximum(left, gamma - np.pi / 2), np.minimum(right, gamma + np.pi / 2)
    node, weight = np.polynomial.legendre.leggauss(48)
    psi = 0.5 * (right + left + (right - left) * node)
    weight = 0.5 * (right - left) * weight
    if weighting == "cosine":
        weight, one, along, across = weight * np.cos(psi - gamma) / np.pi, 4 / 3, np.pi / 8, 3 * np.pi / 8
    else:
        weight, one, along, across = weight / (2 * np.pi), np.pi / 2, 2 / 3, 4 / 3
    plane = np.stack([np.sin(psi), np.zeros_like(psi), np.cos(psi)], axis=-1)
    second = across * np.einsum("...i,...ij,...ik->...jk", weight, plane, plane)
    second[..., 1, 1] = along * weight.sum(axis=-1)
    return one * np.einsum("...i,...ij->...j", weight, plane), second


def walls(d_left, d_right, k_left, k_right):
    """Floor point between two vertical walls at distances d and heights k (0 = none): ½ (cos e1 + cos e2)."""
    return 0.5 * (np.cos(np.arctan2(k_left, d_left)) + np.cos(np.arctan2(k_right, d_right)))


def walls_uniform(d_left, d_right, k_left, k_right):
    """The same scene, uniform weighting: 1 - (e1 + e2)/π."""
    return 1.0 - (np.arctan2(k_left, d_left) + np.arctan2(k_right, d_right)) / np.pi


def pit(radius, depth):
    """Centre of a circular pit, cosine-weighted: R²/(R² + k²)."""
    return radius**2 / (radius**2 + depth**2)


def cone(axis, cosine, weighting="cosine"):
    """Mean direction and second moments of a cone about the normal, as :func:`profile_directions` has them."""
    axis = np.asarray(axis, dtype=np.float64)
    if weighting == "cosine":
        share, along = 1 - cosine**2, (1 - cosine**4) / 2
        mean = 2 / 3 * (1 - cosine**3)
    else:
        share, along = 1 - cosine, (1 - cosine**3) / 3
        mean = (1 - cosine**2) / 2
    outer = np.einsum("...i,...j->...ij", axis, axis)
    return mean * axis, along * outer + (share - along) / 2 * (np.eye(3) - outer)


def pit_uniform(radius, depth):
    """Centre of a circular pit, uniform weighting: 1 - k/sqrt(R² + k²)."""
    return 1.0 - depth / np.hypot(radius, depth)


def bowl(sphere_radius, depth):
    """Any point of a spherical bowl: the open part of the sphere's area, 1 - depth/(2R)."""
    return 1.0 - depth / (2.0 * sphere_radius)


def groove(x, half_width, depth):
    """Point of a V-groove at horizontal distance ``x`` from its bottom line, on either wall, cosine-weighted.

    The point's wall leans by atan(depth/half_width). Across, the visible arc ends at the far rim; on its own side at
    the wall itself. At the bottom (x = 0) of a groove of opening angle α this is (1 - cos α)/2.
    """
    x = np.abs(x)
    slope = np.arctan2(depth, half_width)
    rim = np.arctan2(half_width + x, depth * (1.0 - x / half_width))
    return profile(-rim, np.pi, gamma=-slope)


def wedge(opening):
    """Any point of two infinite half-planes that enclose the angle ``opening``: (1 - cos α)/2."""
    return (1.0 - np.cos(opening)) / 2.0


def inside_sphere(radius, centre, tan_half, n=64):
    """Any point of the inner wall of a sphere of which the square image (half-width ``tan_half``) sees a part.

    Seen from a point of the sphere, equal areas of the sphere have equal cosine-weighted form factors. What the image
    does not show is open: 1 - (area seen)/(4 π R²). Gauss-Legendre over the image plane.
    """
    from .fields import sphere_distance

    node, weight = np.polynomial.legendre.leggauss(n)
    x, y = np.meshgrid(tan_half * node, tan_half * node)
    w = tan_half**2 * weight[:, None] * weight
    ray = np.stack([x, y, -np.ones_like(x)], axis=-1)
    t = sphere_distance(ray, radius, centre)
    outward = (ray * t[..., None] - np.asarray(centre)) / radius
    # dA = t² dx dy / ⟨ray, outward⟩ for rays normalised to unit depth.
    area = np.sum(w * t**2 / np.sum(ray * outward, axis=-1))
    return 1.0 - area / (4 * np.pi * radius**2)


def inside_sphere_within(radius, reach):
    """The same point when only matter within ``reach`` <= 2 R blocks, all of it in view: 1 - (reach / 2R)².

    The chord in a direction at angle θ from the normal has length 2R cos θ, and the cosine-weighted share of
    directions with cos θ <= c is c².
    """
    return 1.0 - (reach / (2.0 * radius)) ** 2


def corner(d1, k1, d2, k2, n=200_001):
    """Floor point before two perpendicular walls; cosine and uniform visibility by the trapezium rule in azimuth.

    With N = V the horizon elevation e(φ) gives cos² e (cosine) and 1 - sin e (uniform) per azimuth.
    """
    phi = np.linspace(0.0, 2 * np.pi, n)[:-1]
    tangent = np.maximum(0.0, np.maximum(k1 / d1 * np.cos(phi), k2 / d2 * np.sin(phi)))
    e = np.arctan(tangent)
    return float(np.mean(np.cos(e) ** 2)), float(np.mean(1 - np.sin(e)))
