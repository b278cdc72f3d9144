"""What one depth sample says about the horizon: a cosine ⟨ω_s, V⟩, possibly attenuated or cut at a radius."""

import drjit as dr

from .roots import rsqrt

__all__ = [
    "apart_form",
    "apart_squared",
    "attenuate",
    "background_cosine",
    "cosine",
    "cut_at_sphere",
    "index_weight",
    "weight",
]


def cosine(D, V):
    """⟨D, V⟩/|D| of the offset D from the shaded point to the sample, with |D|² and ⟨D, V⟩ (theory, eq. (7))."""
    d2 = dr.fma(D[0], D[0], dr.fma(D[1], D[1], D[2] * D[2]))
    dV = dr.fma(D[0], V[0], dr.fma(D[1], V[1], D[2] * V[2]))
    return dV * rsqrt(d2), d2, dV


def weight(distance2, scale, offset, *, squared=False):
    """How much an occluder at a squared distance counts: clamp(scale · |D| + offset, 0, 1), or with |D|².

    With scale = -1/(end - start) and offset = end/(end - start) it is 1 up to the start of the falloff and 0 from its
    end (theory, eq. (29)).
    """
    w = dr.fma(distance2 if squared else dr.sqrt(distance2), scale, offset)
    w = dr.select(w > 0, w, 0)
    return dr.select(w < 1, w, 1)


def index_weight(j, strength):
    """How much the sample of step ``j`` counts where steps, not distances, are attenuated: 1, 2/3, 1/2, 2/5, …

    Args:
        strength: share by which 1 is moved to 2/(j + 2).
    """
    return dr.fma(strength, 2 / (j + 2) - 1, 1)


def background_cosine(X, Y, V, orthographic):
    """⟨ω, V⟩ of the background at the image point (X, Y): the direction of its eye ray, where samples tend to."""
    if orthographic:
        return -V[2]
    return (dr.fma(X, V[0], Y * V[1]) - V[2]) * rsqrt(dr.fma(X, X, dr.fma(Y, Y, 1)))


def attenuate(c, low, w):
    """Move the horizon cosine c toward ``low`` (the tangent plane of its side, or -1) as its weight w falls to 0."""
    return dr.fma(w, c - low, low)


def cut_at_sphere(c, d2, dV, apart2, p, radius, orthographic):
    """The arc that the solid behind a sample blocks, as far as it lies within ``radius`` of the shaded point.

    A depth buffer is solid behind its samples: the matter on the eye ray through sample S starts at S. The part of
    it inside the sphere starts at S itself when S is inside, else where the ray enters the sphere, and ends where
    the ray leaves it; a ray that misses the sphere, or whose sample lies behind it, blocks nothing (theory,
    eq. (25), (26), (27)). Where the ray meets the sphere follows from how far it passes from P, not from S: samples
    far in front of a small sphere would cancel all digits.

    Args:
        c, d2, dV: what :func:`cosine` returned.
        apart2: what :func:`apart_squared` returned.
        p: distance from the eye to the shaded point (perspective only).

    Returns:
        Cosines of the upper and of the lower end of the blocked arc, and whether there is one. Without one the upper
        end is -1 (or NaN, as ``c`` is) and the lower says nothing.
    """
    rcp_r = 1 / radius
    if orthographic:
        in_front, foot, chord2 = dV > 0, 0, dr.fma(-rcp_r * rcp_r, apart2, 1)
    else:
        p_r = p * rcp_r
        in_front, foot = p * dV > d2, p_r * apart2
        chord2 = dr.fma(-p_r, foot, 1) * (1 - apart2)
    inside, meets = d2 <= radius * radius, chord2 > 0
    chord = dr.sqrt(dr.select(meets, chord2, 0))
    enters = meets & in_front
    upper = dr.select(inside, c, dr.select(enters, foot + chord, -1))
    return upper, foot - chord, inside | enters


def apart_squared(i, j, form, X, Y, orthographic):
    """How far the eye rays through two pixels are apart: squared distance, or squared sine of the angle between them.

    Args:
        i, j: the sample's texel coordinates less the shaded point's: differences keep the digits that points lose.
        form: what :func:`apart_form` returned.
        X, Y: the sample's image-plane coordinates.
    """
    ii, ij, jj = form
    if orthographic:
        return dr.fma(ii * i, i, jj * j * j)
    return dr.fma(dr.fma(ii, i, ij * j), i, jj * j * j) / dr.fma(X, X, dr.fma(Y, Y, 1))


def apart_form(ax, ay, X, Y, rcp_a2, orthographic):
    """Coefficients of i², i j and j² of :func:`apart_squared`, from the shaded point's image-plane coordinates.

    The sine of the angle between two eye rays is |δ × (X, Y, -1)| / (a |(X', Y', -1)|), δ the difference of their
    image-plane coordinates.

    Args:
        ax, ay: width and height of a texel in the image plane.
        rcp_a2: 1/a² = 1 / (X² + Y² + 1).
    """
    if orthographic:
        return ax * ax, None, ay * ay
    u, v = ax * Y, ay * X
    return dr.fma(u, u, ax * ax) * rcp_a2, -2 * u * v * rcp_a2, dr.fma(v, v, ay * ay) * rcp_a2
