"""Cones that stand for lobes of reflection: powers, widths of microfacets and half angles.

α is the width of the microfacets' slopes, perceptual roughness squared; p the exponent of the power lobe of half
vectors with the same spread, theory, eq. (134).
"""

import math

import drjit as dr

__all__ = ["alpha_of_power", "drobot_aperture", "power_aperture", "power_of_alpha", "uludag_aperture"]

#: Least α that a power is given for: p = 2e6.
LEAST_ALPHA = 1e-3
#: What a power lobe of reflected directions is cut at, Uludag 2014.
ULUDAG2014 = 0.244


def power_of_alpha(alpha):
    """p = 2 / α² - 2 of a width α in (0, 1]; for widths below 0.001 that of 0.001."""
    alpha = dr.select(alpha > LEAST_ALPHA, alpha, LEAST_ALPHA)
    return 2 / (alpha * alpha) - 2


def alpha_of_power(p):
    """α = √(2 / (p + 2)) of an exponent p >= 0."""
    return dr.sqrt(2 / (p + 2))


def power_aperture(alpha, u=0.01):
    """α_s of cos α_s = u^(1 / (p + 2)) = u^(α² / 2), the half vectors that all but the share u of the lobe are within.

    With full digits for narrow lobes too, and differentiable down to α = 0.

    Args:
        alpha: width in [0, 1].
        u: share in (0, 1).

    Returns:
        Radians in [0, arccos √u].
    """
    return _arc_cosine(alpha, 0.5, -dr.log(u))


def drobot_aperture(alpha):
    """α_s = 2 √(2 / (p + 2)) = 2α of Drobot 2014; radians in [0, 2]."""
    return 2 * alpha


def uludag_aperture(alpha):
    """α_s of cos α_s = 0.244^(1 / (p + 1)) of Uludag 2014; radians in [0, arccos 0.244]."""
    return _arc_cosine(alpha, 1 / dr.fma(-alpha, alpha, 2), -math.log(ULUDAG2014))


def _arc_cosine(alpha, slope, log):
    """arccos(e^-x) of x = α² ``slope`` ``log``, where tan² = e^2x - 1 = 2 e^x sinh x: α comes out of the root."""
    x = alpha * alpha * slope * log
    tiny = x < 1e-3
    y = dr.select(tiny, 1e-3, x)
    quotient = dr.select(tiny, dr.fma(x * x, 1 / 6, 1), dr.sinh(y) / y)
    return dr.atan(alpha * dr.sqrt(2 * slope * log * dr.exp(x) * quotient))
