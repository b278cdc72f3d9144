"""Visibility of one slice as a bitmask: several occluded intervals instead of one horizon per side.

Therrien et al. 2023. The slice's hemisphere [γ - π/2, γ + π/2] is mapped to [0, 1] and cut into sectors of equal
length; each sample sets the bits of the sectors that it covers. The map decides what the open share measures:

======== ============================================= ==============================================================
mapping  equal sectors hold equal                      a slice contributes the open share times
======== ============================================= ==============================================================
angle    angle (the original)                          1
uniform  solid angle                                   1, as :func:`gtao.kernels.arcs.uniform_arc` / 2
cosine   solid angle times the cosine to the normal    :func:`gtao.kernels.arcs.full_slice`, n_V + γ n_T
======== ============================================= ==============================================================

Masks count and have no derivative.
"""

import math

import drjit as dr

from . import arcs

__all__ = ["MAPPINGS", "position", "sectors", "visible_share"]


def _angle(theta, gamma):
    return dr.fma(theta - gamma, 1 / math.pi, 0.5)


def _uniform(theta, gamma):
    return 0.5 * arcs.uniform_arc_signed(gamma - math.pi / 2, theta)


def _cosine(theta, gamma):
    s, c = dr.sincos(gamma)
    return arcs.cosine_arc_signed(gamma, gamma - math.pi / 2, theta) / dr.fma(gamma, s, c)


MAPPINGS = {"angle": _angle, "uniform": _uniform, "cosine": _cosine}


def position(mapping, theta, gamma):
    """Where direction θ lies in the slice's hemisphere, in [0, 1]; directions outside it map to its ends.

    "angle": x = (θ - γ)/π + ½ (Therrien et al. 2023). "uniform": x = ½ (U(θ) + 1 - sin γ), U(t) = sgn(t) (1 - cos t).
    "cosine": x = (G(θ) - G(γ - π/2)) / (cos γ + γ sin γ), G the antiderivative of cos(θ - γ) |sin θ|. The last two are
    the cumulative distributions of the arcs of Jimenez et al. 2016.

    Args:
        mapping: a key of ``MAPPINGS``.
        theta: angle from V toward T, in [-π, π].
        gamma: signed angle of the projected normal, in [-π/2, π/2].
    """
    low, high = gamma - math.pi / 2, gamma + math.pi / 2
    x = MAPPINGS[mapping](theta, gamma)
    x = dr.select(x > 0, dr.select(x < 1, x, 1), 0)
    return dr.select(theta > low, dr.select(theta < high, x, 1), 0)


def sectors(x0, x1, xi, n):
    """Bits k0 <= k < k1 with k_i = ⌊n x_i + ξ⌋: the sectors that the interval between x0 and x1 covers.

    Bit k stands for the point (k + 1 - ξ)/n. With one uniform ξ for all intervals of a slice the points are a
    stratified sample, and the share of bits in the union of masks is unbiased for the length of the union of
    intervals. Rounding outwards instead, as Therrien et al. 2023 do, over-occludes by up to a sector per sample.

    Args:
        x0, x1: ends of the interval in [0, 1], in any order (front and back of a sample).
        xi: jitter in [0, 1).
        n: number of sectors, 1 to 32.

    Returns:
        Unsigned 32-bit mask; of a union of intervals it is the bitwise or.
    """
    UInt = dr.uint32_array_t(type(x0))

    def below(x):
        """Bits 0 … k - 1."""
        k = UInt(dr.fma(x, n, xi))
        # In single precision 32 + ξ can round up to 33. A shift by 32 is undefined, hence the case for all 32 bits.
        k = dr.select(k < n, k, n)
        return dr.select(k < 32, (UInt(1) << (k & 31)) - 1, UInt(0xFFFFFFFF))

    low, high = dr.select(x0 < x1, x0, x1), dr.select(x0 < x1, x1, x0)
    return below(high) & ~below(low)


def visible_share(mask, n, Float):
    """1 - popcount(mask)/n, the share of open sectors (Therrien et al. 2023), as ``Float``."""
    return 1 - Float(dr.popcnt(mask)) * (1 / n)
