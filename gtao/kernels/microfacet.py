"""Reflection of rough surfaces: GGX and Phong distributions, height-correlated shadowing, Schlick's Fresnel term.

The frame has the normal n = z. A direction is three numbers (x, y, z), of unit length, pointing away from the surface.
α is the width of the slopes of microfacets, perceptual roughness squared.
"""

import math

import drjit as dr

from .lobes import power_of_alpha

__all__ = ["LEAST_ALPHA", "brdf_terms", "ggx", "ggx_of_sine", "phong", "schlick", "smith_visibility"]

#: Widths below it count as it: the peak of D is 1 / (π α²), and what divides by it stays finite in single precision.
LEAST_ALPHA = 1e-4


def ggx(cos_h, alpha):
    """D of Walter et al. 2007, theory, eq. (135); its integral times the cosine is 1.

    A cosine alone does not tell directions apart that are closer to the normal than 3e-4 in single precision: use
    :func:`ggx_of_sine` for narrower lobes.

    Args:
        cos_h: cosine of the half vector to the normal; 0 where it is not positive.
        alpha: width in [0, 1].
    """
    return dr.select(cos_h > 0, _ggx((1 - cos_h) * (1 + cos_h), cos_h * cos_h, alpha), 0)


def ggx_of_sine(sin2_h, alpha):
    """D from the squared sine of the half vector to the normal, in [0, 1], without loss near the normal."""
    return _ggx(sin2_h, 1 - sin2_h, alpha)


def _ggx(sin2_h, cos2_h, alpha):
    alpha = _wide(alpha)
    spread = dr.fma(alpha * alpha, cos2_h, sin2_h) / alpha
    return 1 / (math.pi * spread * spread)


def phong(cos_h, alpha):
    """D of the power lobe of the same width, (p + 2) / 2π cos^p; its integral times the cosine is 1.

    Args:
        cos_h: cosine of the half vector to the normal; 0 where it is not positive.
        alpha: width in [0, 1], see :func:`gtao.kernels.lobes.power_of_alpha`.
    """
    p = power_of_alpha(alpha)
    above = cos_h > 0
    lobe = dr.exp(p * dr.log(dr.select(above, cos_h, 1)))
    return dr.select(above, (p + 2) * (0.5 / math.pi) * lobe, 0)


def smith_visibility(cos_i, cos_o, alpha):
    """G₂ / (4 cos_i cos_o) of GGX with correlated heights (Heitz 2014), theory, eq. (136); cosines not below 0.

    At least ¼ for grazing directions; where both graze it is limited to what it is at cosines of 1e-7.
    """
    a2 = alpha * alpha
    total = cos_o * _root(a2, cos_i) + cos_i * _root(a2, cos_o)
    return 0.5 / dr.select(total > 1e-7, total, 1e-7)


def _root(a2, c):
    """√(α² + (1 - α²) c²), in [α, 1]."""
    return dr.sqrt(dr.fma(c * c, 1 - a2, a2))


def schlick(cos_vh):
    """k = (1 - ⟨v, h⟩)⁵ of F = F₀ (1 - k) + k (Schlick 1994); cosines not below 0."""
    x = 1 - dr.select(cos_vh > 0, cos_vh, 0)
    x = dr.select(x > 0, x, 0)
    return x * x * x * x * x


def brdf_terms(wi, wo, alpha):
    """(a, b) of the BRDF times cosine f_r cos_i = F₀ a + b, theory, eq. (137); 0 where either is below the surface.

    Args:
        wi: direction to the light.
        wo: direction to the camera.
        alpha: width in [0, 1].
    """
    cos_i, cos_o = wi[2], wo[2]
    above = (cos_i > 0) & (cos_o >= 0)
    cos_i = dr.select(above, cos_i, 1)
    h = wi[0] + wo[0], wi[1] + wo[1], dr.select(above, wi[2] + wo[2], 1)
    across = dr.fma(h[0], h[0], h[1] * h[1])
    length2 = dr.fma(h[2], h[2], across)
    # |wi + wo| = 2 ⟨v, h⟩.
    k = schlick(0.5 * dr.sqrt(length2))
    lobe = ggx_of_sine(across / length2, alpha) * smith_visibility(cos_i, dr.select(above, cos_o, 1), alpha) * cos_i
    lobe = dr.select(above, lobe, 0)
    b = lobe * k
    return lobe - b, b


def _wide(alpha):
    return dr.select(alpha > LEAST_ALPHA, alpha, LEAST_ALPHA)
