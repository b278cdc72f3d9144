"""What a cone leaves of an isotropic lobe of reflection, without a table.

With F(q) what of the lobe lies within the angle t of its axis, q = sin² t/2, the lobe in a cone is an integral of F
along the cone's rim: one dimension, no cases, and no integrand that starts like a root (theory, eq. (163)).
"""

import math
from typing import Any

import drjit as dr

from .gauss import legendre
from .microfacet import LEAST_ALPHA

__all__ = ["cone_lobe"]

#: Coefficients of (-z - log(1 - z)) / z² and of (1 - e^-y) / y, for where their terms cancel.
LOGARITHM = tuple(1 / (k + 2) for k in range(12))
DECAY = tuple((-1) ** k / math.factorial(k + 1) for k in range(9))
#: Of artanh z / z in z².
ARTANH = tuple(1 / (2 * k + 1) for k in range(14))
#: Where the first two take over.
SMALL = 0.1


def cone_lobe(alpha_v, beta, alpha, distribution="ggx", n_nodes=16) -> Any:
    """V_s, the share of the lobe about the reflected direction that a cone of visibility leaves, theory, eq. (162).

    The lobe of n = v = ω_r, with half vectors at half of its angles, D(cos t/2) cos t up to 90°. Differentiable in the
    three numbers.

    Args:
        alpha_v: half angle of the cone, in [0, π].
        beta: angle between its axis and the reflected direction, in [0, π].
        alpha: width of the slopes of microfacets, in [0, 1]; from 0.0001 down that of 0.0001.
        distribution: "ggx", or "phong" for the power lobe of half vectors.
        n_nodes: nodes of the quadrature along half of the rim. The error of 16 is 2e-5 for all widths from 0.001 on.
    """
    width = dr.select(alpha > LEAST_ALPHA, alpha, LEAST_ALPHA)
    a2 = width * width
    within = {"ggx": _ggx, "phong": _phong}[distribution]
    whole = 0.5 * within(0.5, a2)
    sin_v, cos_v = dr.sincos(alpha_v)
    less, more = 0.5 * (alpha_v - beta), 0.5 * (alpha_v + beta)
    (sin_less, cos_less), (sin_more, _) = dr.sincos(less), dr.sincos(more)
    q0, span = sin_less * sin_less, sin_v * dr.sin(beta)
    n0, n1 = 2 * sin_v * sin_less * cos_less, 2 * cos_v * span
    with dr.suspend_grad():
        # Up to the azimuth τ the rim is within 90°. The integrand is continuous there, and nodes may lie anywhere.
        ahead, behind = dr.cos(2 * less), -dr.cos(2 * more)
        beyond = behind > 0
        half = dr.select(beyond, dr.atan2(dr.sqrt(dr.select(ahead > 0, ahead, 0)), dr.sqrt(behind)), 0.5 * math.pi)
        sin_half, cos_half = dr.sincos(half)
        # As fine as the lobe is where the rim is nearest to its axis.
        fine = a2 + q0
        scale = 2 * dr.sqrt(fine / dr.select(span > 0.04 * fine, span, 0.04 * fine))
        last = 2 * half / scale
        stretch = dr.log(last + dr.sqrt(dr.fma(last, last, 1)))
    total: Any = 0
    for x, w in legendre(n_nodes):
        with dr.suspend_grad():
            e = dr.exp(stretch * x)
            s = dr.sin(0.25 * scale * (e - 1 / e))
            s2, step = s * s, w * (e + 1 / e)
        q = dr.fma(span, s2, q0)
        q = dr.select(q < 0.5, q, 0.5)
        share = (within(q, a2) - whole) / (1 - q)
        total = dr.fma(share * dr.fma(n1, s2, n0), step, total)
    total = total * (0.5 * scale * stretch) / whole
    rest = dr.atan2(sin_less * cos_half, sin_more * sin_half)
    total = total + dr.select(beyond, dr.fma(2 * cos_v, math.pi - 2 * half, 4 * rest), 0)
    v = dr.sin(0.5 * alpha_v)
    return dr.fma(v, v, total * (0.25 / math.pi))


def _series(coefficients, x) -> Any:
    total: Any = 0
    for c in reversed(coefficients):
        total = dr.fma(total, x, c)
    return total


def _ggx(q, a2):
    """F(q) / q for q <= ½, F the integral of (1 - 2q) / (α² + (1 - α²) q)² times α²."""
    c = 1 - a2
    by_q = 1 / dr.fma(c, q, a2)
    u = q * by_q
    z = c * u
    little = z < SMALL
    y = dr.select(little, 1, z)
    # 1 - z = α² u / q.
    mean = dr.select(little, _series(LOGARITHM, z), (-y - dr.log(dr.select(little, 1, a2 * by_q))) / (y * y))
    return by_q * dr.fma(-2 * a2 * u, mean, 1)


def _phong(q, a2):
    """F(q) / q for q <= ½, F the integral of (1 - 2q) (1 - q)^(1/α² - 1) / α²."""
    # -log(1 - q) = 2 artanh z with all digits, also of its derivative; z <= ⅓.
    slope = 1 / (2 - q)
    z = q * slope
    by_q = 2 * slope * _series(ARTANH, z * z) / a2
    y, k = q * by_q, 1 + a2
    return by_q * (2 * _decay(k * y) - _decay(y))


def _decay(y):
    """(1 - e^-y) / y."""
    little = y < SMALL
    large = dr.select(little, 1, y)
    return dr.select(little, _series(DECAY, y), (1 - dr.exp(-large)) / large)
