"""What one depth sample says about the horizon: a cosine ⟨ω_s, V⟩, possibly attenuated or cut at a radius."""

import drjit as dr

__all__ = ["apart_squared", "attenuate", "background_cosine", "cosine", "cut_at_sphere", "index_weight", "weight"]


def cosine(D, V):
    """⟨D, V⟩/|D| of the offset D from the shaded point to the sample, with |D|² and ⟨D, V⟩ (theory, eq. (7))."""
    d2 = dr.fma(D[0], D[0], dr.fma(D[1], D[1], D[2] * D[2]))
    dV = dr.fma(D[0], V[0], dr.fma(D[1], V[1], D[2] * V[2]))
    return dV * dr.rsqrt(d2), d2, dV


def weight(distance2, scale, offset, *, squared=False):
    """How much an occluder at a squared distance counts: clamp(scale · |D| + offset, 0, 1), or with |D|².

    With scale = -1/(end - start) and offset = end/(end - start) it is 1 up to the start of the falloff and 0 from its
    end (theory, eq. (29)).
    """
    w = dr.fma(distance2 if squared else dr.sqrt(distance2), scale, offset)
    return dr.select(w > 0, dr.select(w < 1, w, 1), 0)


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
    return (dr.fma(X, V[0], Y * V[1]) - V[2]) * dr.rsqrt(dr.fma(X, X, dr.fma(Y, Y, 1)))


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
        apart2: squared distance of P from the eye ray (orthographic), or squared sine of the angle between the eye
            rays through P and through S (perspective).
        p: distance from the eye to the shaded point (perspective only).

    Returns:
        Cosines of the upper and of the lower end of the blocked arc; -1 and 1 where nothing is blocked.
    """
    r2 = radius * radius
    if orthographic:
        beyond, h2, foot, slope = -dV, apart2, 0, 1
    else:
        beyond, h2, foot, slope = dr.fma(-p, dV, d2), p * p * apart2, p * apart2, dr.sqrt(1 - apart2)
    chord2 = r2 - h2
    chord = dr.sqrt(dr.select(chord2 > 0, chord2, 0)) * slope
    rcp_r = 1 / radius
    inside = d2 <= r2
    hit = inside | ((chord2 > 0) & (beyond < 0))
    upper = dr.select(inside, c, dr.select(hit, (foot + chord) * rcp_r, -1))
    return upper, dr.select(hit, (foot - chord) * rcp_r, 1)


def apart_squared(dX, dY, X0, Y0, rcp_a2, X, Y, orthographic):
    """How far the eye rays through two image points are apart, squared; see :func:`cut_at_sphere`.

    Args:
        dX, dY: difference of the image-plane coordinates; the differences keep the digits that the points lose.
        X0, Y0, rcp_a2: the shaded point's coordinates and 1 / (X0² + Y0² + 1).
        X, Y: the sample's coordinates.
    """
    d2 = dr.fma(dX, dX, dY * dY)
    if orthographic:
        return d2
    t = dr.fma(dX, Y0, -dY * X0)
    sine2 = dr.fma(t, t, d2) * rcp_a2 / dr.fma(X, X, dr.fma(Y, Y, 1))
    return dr.select(sine2 < 1, sine2, 1)
