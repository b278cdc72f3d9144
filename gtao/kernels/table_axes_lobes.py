"""Coordinates of tables of lobes in cones, and of what a surface reflects.

Seen from its axis a lobe of reflection leaves a cone of visibility over a few of its own widths, about 2α wide, around
β = α_v: a step for smooth surfaces. Axes named "lobe" measure angles in widths of the lobe, and texels lie densely
where something happens: near a cone that is closed, around the rim of the cone, near the horizon (theory, eqs. (171)
and (172)). They are ratios and roots, and cost next to nothing.
"""

import math
from typing import Any

import drjit as dr

from .table_axes_cones import limited_acos

__all__ = [
    "from_cosine_4d",
    "from_environment",
    "from_environment_root",
    "from_linear_3d",
    "from_linear_4d",
    "from_linear_5d",
    "from_linear_lobe",
    "from_lobe",
    "from_lobe_3d",
    "from_lobe_4d",
    "from_lobe_5d",
    "to_cosine_4d",
    "to_environment",
    "to_environment_root",
    "to_linear_3d",
    "to_linear_4d",
    "to_linear_5d",
    "to_linear_lobe",
    "to_lobe",
    "to_lobe_3d",
    "to_lobe_4d",
    "to_lobe_5d",
]

_HALF_PI = math.pi / 2
#: Below it the lobe's width is that of it, and so is what tables hold: a mirror's step, one width of it wide.
LEAST_ALPHA = 1e-3


def _root(x) -> Any:
    """√x with a bounded derivative, 0 below 0."""
    x = dr.select(x > 0, x, 0)
    value = dr.sqrt(dr.detach(x))
    return dr.replace_grad(value, x * (0.5 / dr.select(value > 1e-2, value, 1e-2)))


def _wide(alpha) -> Any:
    return dr.select(alpha > LEAST_ALPHA, alpha, LEAST_ALPHA)


def _limited(x, end) -> Any:
    x = dr.select(x > 0, x, 0)
    return dr.select(x < end, x, end)


def _near(x, width, end) -> Any:
    """[0, end] to [0, 1], fine near 0."""
    return x * (width + end) / (end * (x + width))


def _from_near(u, width, end) -> Any:
    return _limited(width * end * u / (width + end * (1 - u)), end)


def _two_sided(x, width, end) -> Any:
    """[0, end] to [0, 1], fine near both ends."""
    return 0.5 + (x - 0.5 * end) * width * (width + end) / (end * (x + width) * (end - x + width))


def _from_two_sided(u, width, end) -> Any:
    t, a, b = (2 * u - 1) * end, width * (width + end), width + 0.5 * end
    return _limited(0.5 * end + t * b * b / (a + dr.sqrt(dr.fma(a, a, t * t * b * b))), end)


def _squash(x, width) -> Any:
    return x / (width + abs(x))


def _around(x, center, width, end) -> Any:
    """[0, end] to [0, 1], fine near the center."""
    low, high = _squash(-center, width), _squash(end - center, width)
    return (_squash(x - center, width) - low) / (high - low)


def _from_around(u, center, width, end) -> Any:
    low, high = _squash(-center, width), _squash(end - center, width)
    s = dr.fma(u, high - low, low)
    return _limited(center + width * s / (1 - abs(s)), end)


def _cone(alpha_v, alpha) -> Any:
    return _near(_limited(alpha_v, math.pi), dr.fma(4, alpha, 1), math.pi)


def _from_cone(x, alpha) -> Any:
    return _from_near(x, dr.fma(4, alpha, 1), math.pi)


def _width(alpha, theta_o, cos_chi, sin2_chi) -> Any:
    """Of the lobe along an azimuth, three times α in the incidence plane; across it narrower, to grazing angles."""
    c = dr.cos(theta_o)
    across = dr.fma(alpha, alpha, c * c)
    across = dr.select(across < 1, across, 1)
    return 3 * alpha * dr.sqrt(dr.fma(sin2_chi, across, cos_chi * cos_chi))


def to_linear_lobe(alpha_v, beta, alpha):
    return alpha_v / _HALF_PI, beta / math.pi, alpha * 1


def from_linear_lobe(x, y, z):
    return x * _HALF_PI, y * math.pi, z * 1


def to_lobe(alpha_v, beta, alpha):
    """Of an isotropic lobe."""
    wide = _wide(alpha)
    beta = _limited(beta, math.pi)
    return _cone(alpha_v, wide), _around(beta, _limited(alpha_v, math.pi), 3 * wide, math.pi), _root(alpha)


def from_lobe(x, y, z):
    alpha = _wide(z * z)
    alpha_v = _from_cone(x, alpha)
    return alpha_v, _from_around(y, alpha_v, 3 * alpha, math.pi), alpha


def to_linear_3d(alpha_v, beta, alpha):
    return alpha_v / _HALF_PI, beta / _HALF_PI, _root(alpha)


def from_linear_3d(x, y, z):
    return x * _HALF_PI, y * _HALF_PI, z * z


def to_lobe_3d(alpha_v, beta, alpha):
    """Of a cone about the normal: fine near closed and near open cones; theory, eq. (173)."""
    wide = _wide(alpha)
    alpha_v, beta = (_limited(x, _HALF_PI) for x in (alpha_v, beta))
    x = _two_sided(alpha_v, 0.5 + wide, _HALF_PI)
    return x, _around(beta, alpha_v, dr.fma(3, wide, 1), _HALF_PI), _root(alpha)


def from_lobe_3d(x, y, z):
    alpha = _wide(z * z)
    alpha_v = _from_two_sided(x, 0.5 + alpha, _HALF_PI)
    return alpha_v, _from_around(y, alpha_v, dr.fma(3, alpha, 1), _HALF_PI), alpha


def to_linear_4d(alpha_v, beta, alpha, theta_o):
    return alpha_v / _HALF_PI, beta / math.pi, _root(alpha), theta_o / _HALF_PI


def from_linear_4d(x, y, z, w):
    return x * _HALF_PI, y * math.pi, z * z, w * _HALF_PI


def to_cosine_4d(alpha_v, beta, alpha, theta_o):
    return dr.cos(alpha_v), dr.fma(0.5, dr.cos(beta), 0.5), _root(alpha), dr.cos(theta_o)


def from_cosine_4d(x, y, z, w):
    return limited_acos(x), limited_acos(2 * y - 1), z * z, limited_acos(w)


def to_lobe_4d(alpha_v, beta, alpha, theta_o):
    return to_lobe_5d(alpha_v, beta, alpha, theta_o, 0)[:4]


def from_lobe_4d(x, y, z, w):
    return from_lobe_5d(x, y, z, w, 0)[:4]


def to_linear_5d(alpha_v, beta, alpha, theta_o, chi):
    return *to_linear_4d(alpha_v, beta, alpha, theta_o), abs(chi) / math.pi


def from_linear_5d(x, y, z, w, v):
    return *from_linear_4d(x, y, z, w), v * math.pi


def to_lobe_5d(alpha_v, beta, alpha, theta_o, chi):
    wide = _wide(alpha)
    alpha_v, beta = (_limited(x, math.pi) for x in (alpha_v, beta))
    cos_chi = dr.cos(chi)
    height = _HALF_PI - _limited(theta_o, _HALF_PI)
    sin_chi = dr.sin(chi)
    y = _around(beta, alpha_v, _width(wide, theta_o, cos_chi, sin_chi * sin_chi), math.pi)
    w = _near(height, 0.5 + wide, _HALF_PI)
    return _cone(alpha_v, wide), y, _root(alpha), w, dr.fma(-0.5, cos_chi, 0.5)


def from_lobe_5d(x, y, z, w, v):
    alpha = _wide(z * z)
    alpha_v = _from_cone(x, alpha)
    theta_o = _HALF_PI - _from_near(w, 0.5 + alpha, _HALF_PI)
    cos_chi = 1 - 2 * v
    width = _width(alpha, theta_o, cos_chi, 4 * v * (1 - v))
    return alpha_v, _from_around(y, alpha_v, width, math.pi), alpha, theta_o, limited_acos(cos_chi)


def to_environment(alpha, theta_o):
    return dr.cos(theta_o), _root(alpha)


def from_environment(x, y):
    return y * y, limited_acos(x)


def to_environment_root(alpha, theta_o):
    """Fine near grazing angles, where what a smooth surface reflects changes fastest."""
    return _root(dr.cos(theta_o)), _root(alpha)


def from_environment_root(x, y):
    return y * y, limited_acos(x * x)
