"""Real spherical harmonics without the Condon-Shortley phase, to any order, by recurrence in Cartesian coordinates.

Coefficients are ordered (0, 0), (1, -1), (1, 0), (1, 1), (2, -2), …: index l² + l + m.

References:
    P.-P. Sloan, "Efficient Spherical Harmonic Evaluation", Journal of Computer Graphics Techniques 2013.
    R. Ramamoorthi, P. Hanrahan, "An Efficient Representation for Irradiance Environment Maps", SIGGRAPH 2001.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gtao.errors import ShapeError

from ._checks import as_coefficients, as_directions, as_order
from .quadrature import sphere_nodes

__all__ = ["basis", "cosine_kernel", "evaluate", "polar_factors", "project_function"]


def polar_factors(z: np.ndarray, order: int) -> dict[tuple[int, int], np.ndarray]:
    """Normalised associated Legendre functions without their factor (1 - z²)^(m/2), for 0 <= m <= l <= order.

    Args:
        z: cosines of the polar angle, any shape, in [-1, 1].
        order: highest band.

    Returns:
        {(l, m): array shaped like z}; times √(1 - z²)ᵐ {1, √2 cos mφ, √2 sin mφ} these are the harmonics.
    """
    q: dict[tuple[int, int], np.ndarray] = {}
    diagonal = math.sqrt(1 / (4 * math.pi))
    for m in range(order + 1):
        if m > 0:
            diagonal *= math.sqrt((2 * m + 1) / (2 * m))
        q[m, m] = np.full_like(z, diagonal)
        if m < order:
            q[m + 1, m] = math.sqrt(2 * m + 3) * z * q[m, m]
        for band in range(m + 2, order + 1):
            a = math.sqrt((4 * band**2 - 1) / (band**2 - m * m))
            b = math.sqrt(((band - 1) ** 2 - m * m) / (4 * (band - 1) ** 2 - 1))
            q[band, m] = a * (z * q[band - 1, m] - b * q[band - 2, m])
    return q


def basis(directions: ArrayLike, order: int) -> np.ndarray:
    """The real spherical harmonics of all bands up to ``order``; theory, eq. (98).

    Args:
        directions: (…, 3), of any length but 0.
        order: highest band, at least 0.

    Returns:
        (…, (order + 1)²) float64 values of Y₀₀, Y₁₋₁, Y₁₀, Y₁₁, …; Y₁ is √(3/4π) (y, z, x).

    Raises:
        ShapeError: the directions are not (…, 3), not finite, or zero.
        ConfigError: the order is not an integer of at least 0.
    """
    order = as_order(order)
    d = as_directions("directions", directions)
    q = polar_factors(d[..., 2], order)
    plane = d[..., 0] + 1j * d[..., 1]
    out = np.empty((*d.shape[:-1], (order + 1) ** 2))
    power = np.ones_like(plane)
    for m in range(order + 1):
        if m > 0:
            power = power * plane
        for band in range(m, order + 1):
            middle = band * band + band
            if m == 0:
                out[..., middle] = q[band, 0]
            else:
                out[..., middle + m] = math.sqrt(2) * q[band, m] * power.real
                out[..., middle - m] = math.sqrt(2) * q[band, m] * power.imag
    return out


def evaluate(sh: ArrayLike, directions: ArrayLike) -> np.ndarray:
    """The function that coefficients describe, Σ f_lm Y_lm(ω).

    Args:
        sh: (n,) or (n, C) coefficients.
        directions: (…, 3), of any length but 0, in the frame of the coefficients.

    Returns:
        (…) or (…, C) values.

    Raises:
        ShapeError: either has a wrong shape or values that are not finite.
    """
    c, order = as_coefficients(sh)
    return basis(directions, order) @ c


def project_function(function: Callable[[np.ndarray], Any], order: int, degree: int = 128) -> np.ndarray:
    """Coefficients of a function of direction, ∫ f Y_lm dω, by quadrature over the sphere.

    Args:
        function: takes (K, 3) unit vectors, returns (K,) or (K, C) values.
        order: highest band.
        degree: the quadrature is exact where f times the harmonics is a polynomial of at most this degree; smooth
            functions converge exponentially in it, functions with jumps do not.

    Returns:
        (n,) or (n, C) coefficients.

    Raises:
        ConfigError: the order or degree is not an integer of at least 0.
        ShapeError: the function returns something else, or values that are not finite.
    """
    order = as_order(order)
    directions, weights = sphere_nodes(as_order(degree))
    values = np.asarray(function(directions), dtype=np.float64)
    if values.ndim not in (1, 2) or len(values) != len(directions):
        raise ShapeError(f"the function must return ({len(directions)},) or ({len(directions)}, C), got {values.shape}")
    if not np.isfinite(values).all():
        raise ShapeError(f"the function is not finite in {int((~np.isfinite(values)).sum())} of {values.size} values")
    return (basis(directions, order) * weights[:, None]).T @ values


def cosine_kernel(order: int) -> np.ndarray:
    """Kernel of the clamped cosine, A_l = 2π∫₀¹ x P_l(x) dx = π, 2π/3, π/4, 0, -π/24, …: (order + 1,).

    Radiance times it is irradiance: E_lm = A_l L_lm.

    Raises:
        ConfigError: the order is not an integer of at least 0.
    """
    order = as_order(order)
    x, w = np.polynomial.legendre.leggauss(order // 2 + 1)
    x, w = (x + 1) / 2, w / 2  # exact on [0, 1] to degree order + 1, that of the integrand
    kernel = 2 * math.pi * (w * x) @ np.polynomial.legendre.legvander(x, order)
    kernel[3::2] = 0
    return kernel
