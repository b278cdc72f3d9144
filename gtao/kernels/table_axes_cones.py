"""Coordinates of cone/cone tables, whose arguments are (alpha_v, beta, alpha); the cone of reflection is u = 0.01's.

What tables on the first three hold is the share S of the reflection cone that is visible. The other two hold the
intersection's share of the smaller cone, which is between 0 and 1 where the rims cross and known elsewhere, over how
far across each other the rims are; ``scale`` makes S of it.
"""

import math
from typing import Any

import drjit as dr

from .lobes import power_aperture

__all__ = [
    "from_cosine",
    "from_linear",
    "from_nested",
    "from_overlap",
    "from_published",
    "limited_acos",
    "scale",
    "to_cosine",
    "to_linear",
    "to_nested",
    "to_overlap",
    "to_published",
]

_HALF_PI = math.pi / 2
#: Share of the lobe's half vectors that the cone of reflection leaves out.
U = 0.01
#: Narrower cones of reflection, radians, are as good as a mirror.
LEAST = 1e-4


def _at_least(x, low) -> Any:
    return dr.select(x > low, x, low)


def limited_acos(x) -> Any:
    """Arc cosine of x limited to [-1, 1]."""
    x = _at_least(x, -1)
    return dr.acos(dr.select(x < 1, x, 1))


def aperture(alpha) -> Any:
    """Half angle of the cone of reflection, theory, eq. (134) with u = 0.01; narrower ones than LEAST are widened."""
    return _at_least(power_aperture(alpha, U), LEAST)


def alpha_of(alpha_s) -> Any:
    """The microfacet width of a cone of reflection, the inverse of :func:`aperture`."""
    s = dr.sin(0.5 * alpha_s)
    # No width has a hemisphere for its cone. log(1 - x) through atanh keeps its digits for small x.
    x = 2 * s * s
    x = dr.select(x < 1 - 1e-6, x, 1 - 1e-6)
    return dr.sqrt(2 * dr.atanh(x / (2 - x)) * (-2 / math.log(U)))


def to_published(alpha_v, beta, alpha):
    return dr.cos(alpha_v), dr.cos(aperture(alpha)), dr.fma(0.5, dr.cos(beta), 0.5)


def from_published(x, y, z):
    return _at_least(limited_acos(x), LEAST), limited_acos(2 * z - 1), alpha_of(limited_acos(y))


def to_cosine(alpha_v, beta, alpha):
    """The published axes, over what roughness up to 1 and angles up to π/2 make of them only."""
    return dr.cos(alpha_v), (dr.cos(aperture(alpha)) - 0.1) / 0.9, dr.cos(beta)


def from_cosine(x, y, z):
    return _at_least(limited_acos(x), LEAST), limited_acos(z), alpha_of(limited_acos(dr.fma(0.9, y, 0.1)))


def to_linear(alpha_v, beta, alpha):
    """Angles up to π/2 and the microfacet width themselves."""
    return alpha_v / _HALF_PI, alpha * 1, beta / _HALF_PI


def from_linear(x, y, z):
    return _at_least(x * _HALF_PI, LEAST), z * _HALF_PI, y * 1


def _cross(narrow, wide, beta):
    """How far the rims are across each other: 0 where the wider cone holds the narrower one, 1 where they part.

    Or, where the two are wider than a half circle together, where they leave nothing between them.
    """
    return 0.5 * (beta - (wide - narrow)) / _at_least(_lesser(narrow, math.pi - wide), 1e-6)


def _apart(narrow, wide, u):
    """The inverse of :func:`_cross`."""
    return dr.fma(2 * u, _lesser(narrow, math.pi - wide), wide - narrow)


def _lesser(a, b):
    return dr.select(a < b, a, b)


def _sorted(a, b):
    return _lesser(a, b), dr.select(a < b, b, a)


def to_overlap(alpha_v, beta, alpha):
    return alpha_v / _HALF_PI, alpha * 1, _cross(*_sorted(alpha_v, aperture(alpha)), beta)


def from_overlap(x, y, z):
    alpha_v, alpha = _at_least(x * _HALF_PI, LEAST), y * 1
    return alpha_v, _apart(*_sorted(alpha_v, aperture(alpha)), z), alpha


def to_nested(alpha_v, beta, alpha):
    """The intersection does not tell its two cones apart: x is the narrower over the wider; theory, eq. (170)."""
    narrow, wide = _sorted(_lesser(alpha_v, math.pi), aperture(alpha))
    return narrow / wide, wide / math.pi, _cross(narrow, wide, beta)


def from_nested(x, y, z):
    """One of the two pairs of arguments: a narrow cone of visibility, or a wide one, which reflections never have."""
    # Where nothing is left of a cone the limit is meant.
    wide = _at_least(y * math.pi, 1e-3)
    narrow = _at_least(x, 1e-4) * wide
    swapped = wide < 1
    alpha_v, alpha_s = dr.select(swapped, narrow, wide), dr.select(swapped, wide, narrow)
    return alpha_v, _apart(narrow, wide, z), alpha_of(alpha_s)


def scale(alpha_v, beta, alpha):
    """Solid angle of the narrower cone over that of the cone of reflection."""
    reflection = aperture(alpha)
    ratio = dr.sin(0.5 * _lesser(alpha_v, reflection)) / dr.sin(0.5 * reflection)
    return ratio * ratio
