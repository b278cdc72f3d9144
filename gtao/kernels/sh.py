"""Real spherical harmonics, zonal functions and moments of functions of direction.

Harmonics carry no Condon-Shortley phase and are listed as (0, 0), (1, -1), (1, 0), (1, 1), (2, -2), …: Y_lm is number
l² + l + m, and Y_1 is √(3/4π) (y, z, x). A zonal function f(⟨a, ω⟩) has one kernel number per band,
K_l = 2π ∫ f P_l, and the coefficients K_l Y_lm(a) (theory, eq. (100)).
"""

import math
from fractions import Fraction
from functools import cache
from typing import Any

import drjit as dr

__all__ = [
    "CLAMPED_COSINE",
    "basis",
    "cone",
    "cone_cosine",
    "from_moments",
    "legendre",
    "norm2",
    "polar",
    "polynomial",
    "to_moments",
    "zonal",
]

#: Kernel of max(⟨n, ω⟩, 0), bands 0 to 4 (Ramamoorthi and Hanrahan 2001).
CLAMPED_COSINE = (math.pi, 2 * math.pi / 3, math.pi / 4, 0.0, -math.pi / 24)


@cache
def legendre(band):
    """Coefficients of the Legendre polynomial P_l by ascending power, exact."""
    if band < 2:
        return (Fraction(0),) * band + (Fraction(1),)
    one, two = legendre(band - 1), (*legendre(band - 2), 0, 0)
    return tuple(
        (Fraction(2 * band - 1, band) * (one[k - 1] if k else 0) - Fraction(band - 1, band) * two[k])
        for k in range(band + 1)
    )


@cache
def polar(band, m):
    """Coefficients of d^m P_l/dz^m by ascending power, exact.

    Times Re (x + iy)^m or Im (x + iy)^m and √(:func:`norm2` / π) these are the harmonics of degree ± m.
    """
    coefficients = legendre(band)
    for _ in range(m):
        coefficients = tuple(k * c for k, c in enumerate(coefficients))[1:]
    return coefficients


@cache
def norm2(band, m):
    """π times the square of the factor that gives the harmonics (l, ± m) unit norm, exact."""
    share = Fraction(math.factorial(band - m), math.factorial(band + m))
    return Fraction(2 * band + 1, 4) * share * (2 if m else 1)


def basis(x, y, z, order):
    """The (order + 1)² harmonics in the unit direction (x, y, z); theory, eq. (98)."""
    result: list[Any] = [0] * (order + 1) ** 2
    zz = z * z
    real, imaginary = 1, 0
    for m in range(order + 1):
        for band in range(m, order + 1):
            factor = math.sqrt(norm2(band, m) / math.pi)
            p = polynomial([factor * float(c) for c in polar(band, m)], z, zz)
            middle = band * band + band
            result[middle + m] = p * real
            if m:
                result[middle - m] = p * imaginary
        real, imaginary = (x, y) if m == 0 else (dr.fma(x, real, -y * imaginary), dr.fma(x, imaginary, y * real))
    # Band 0 is a number, whatever the lanes.
    result[0] = result[0] + dr.zeros(type(z), dr.width(z))
    return result


def polynomial(coefficients, z, zz):
    """Σ c_k z^k of a polynomial whose powers are all even or all odd."""
    odd = 1 - len(coefficients) % 2
    value = coefficients[-1]
    for c in coefficients[-3::-2]:
        value = dr.fma(zz, value, c)
    return z * value if odd else value


def zonal(kernel, harmonics):
    """Coefficients K_l Y_lm(a) of a zonal function about the axis a.

    Args:
        kernel: K_0, K_1, …
        harmonics: :func:`basis` at the axis, of at least as many bands.
    """
    return [K * harmonics[band * band + i] for band, K in enumerate(kernel) for i in range(2 * band + 1)]


def cone(x, order):
    """Kernel of the cone ⟨a, ω⟩ > x: 2π (1 - x), and 2π (1 - x²) P_l'(x) / (l (l + 1)) (theory, eq. (113)).

    The same as 2π (P_{l-1} - P_{l+1}) / (2l + 1), whose terms cancel in narrow cones.
    """
    rest, xx = 2 * math.pi * (1 - x), x * x
    around = rest * (1 + x)
    kernel = [rest]
    for band in range(1, order + 1):
        share = 1 / (band * (band + 1))
        kernel.append(around * polynomial([share * float(c) for c in polar(band, 1)], x, xx))
    return kernel


def cone_cosine(energy, x, order):
    """Kernel of a cone times the cosine to its own axis, x = cos α >= 0, scaled to K_0 = ``energy``.

    The ratios K_l / K_0 of theory, eq. (114). With an energy of π (1 - x²) it is the cone itself.
    """
    xx = x * x
    ratios = [
        1,
        (2 / 3) * (1 + xx / (1 + x)),
        dr.fma(xx, 0.75, 0.25),
        x * xx,
        dr.fma(xx, dr.fma(xx, 35 / 24, -10 / 24), -1 / 24),
    ]
    return [energy * ratio for ratio in ratios[: order + 1]]


_Y0 = math.sqrt(1 / math.pi) / 2
_Y1 = math.sqrt(3 / math.pi) / 2
_Y2 = math.sqrt(15 / math.pi) / 2
_Y20 = math.sqrt(5 / math.pi) / 4


def from_moments(m0, m1, m2):
    """The nine coefficients of a function f from its moments (theory, eq. (112)).

    Args:
        m0: ∫ f dω.
        m1: (x, y, z) of ∫ f ω dω.
        m2: (xx, xy, xz, yy, yz, zz) of ∫ f ω ωᵀ dω, whose trace is m0.
    """
    xx, xy, xz, yy, yz, zz = m2
    return [
        _Y0 * m0,
        *(_Y1 * m1[axis] for axis in (1, 2, 0)),
        *(_Y2 * xy, _Y2 * yz, _Y20 * dr.fma(zz, 3, -m0), _Y2 * xz, (0.5 * _Y2) * (xx - yy)),
    ]


def to_moments(coefficients):
    """(m0, m1, m2) of :func:`from_moments` from the nine coefficients."""
    f = coefficients
    m0 = f[0] * (1 / _Y0)
    zz = dr.fma(f[6], 1 / _Y20, m0) * (1 / 3)
    rest, difference = m0 - zz, f[8] * (2 / _Y2)
    xx, yy = 0.5 * (rest + difference), 0.5 * (rest - difference)
    m1 = tuple(f[k] * (1 / _Y1) for k in (3, 1, 2))
    return m0, m1, (xx, f[4] * (1 / _Y2), f[7] * (1 / _Y2), yy, f[5] * (1 / _Y2), zz)
