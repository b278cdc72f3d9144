"""What one depth sample says about the horizon: a cosine ⟨ω_s, V⟩, possibly attenuated or cut at a radius."""

import drjit as dr

__all__ = ["attenuate", "cosine", "cut_at_sphere"]


def cosine(D, V):
    """⟨D, V⟩/|D| of the offset D from the shaded point to the sample, with |D|² and ⟨D, V⟩ (theory, eq. (7))."""
    d2 = dr.fma(D[0], D[0], dr.fma(D[1], D[1], D[2] * D[2]))
    dV = dr.fma(D[0], V[0], dr.fma(D[1], V[1], D[2] * V[2]))
    return dV * dr.rsqrt(d2), d2, dV


def attenuate(c, low, distance2, scale, offset):
    """Move c toward ``low`` (the tangent plane of its side) by a weight linear in distance.

    The weight is clamp(scale · |D| + offset, 0, 1), that is 1 up to the start of the falloff and 0 from its end
    (theory, eq. (29)).
    """
    w = dr.fma(dr.sqrt(distance2), scale, offset)
    w = dr.select(w > 0, dr.select(w < 1, w, 1), 0)
    return dr.fma(w, c - low, low)


def cut_at_sphere(c, d2, dV, p, radius, orthographic):
    """The arc that the solid behind a sample blocks, as far as it lies within ``radius`` of the shaded point.

    A depth buffer is solid behind its samples: the matter on the eye ray through sample S starts at S. The part of
    it inside the sphere starts at S itself when S is inside, else where the ray enters the sphere, and ends where
    the ray leaves it; a ray that misses the sphere, or whose sample lies behind it, blocks nothing (theory,
    eqs. (25)-(27)).

    Args:
        c, d2, dV: what :func:`cosine` returned.
        p: distance from the eye to the shaded point (perspective only).

    Returns:
        Cosines of the upper and of the lower end of the blocked arc; -1 and 1 where nothing is blocked.
    """
    r2 = radius * radius
    if orthographic:
        b, eV = -dV, -1
    else:
        # The unit eye ray e through S = P + D, using P = -p V throughout.
        rcp_s = dr.rsqrt(dr.fma(p, dr.fma(-2, dV, p), d2))
        b = dr.fma(-p, dV, d2) * rcp_s
        eV = (dV - p) * rcp_s
    discriminant = dr.fma(b, b, r2 - d2)
    half = dr.sqrt(dr.select(discriminant > 0, discriminant, 0))
    rcp_r = 1 / radius
    upper = dr.fma(-b - half, eV, dV) * rcp_r
    lower = dr.fma(half - b, eV, dV) * rcp_r
    inside = d2 <= r2
    hit = inside | ((discriminant > 0) & (b + half < 0))
    return dr.select(inside, c, dr.select(hit, upper, -1)), dr.select(hit, lower, 1)
