"""Moments of the visible directions of one slice: what bent normals and directional occlusion are summed from.

Notation of :mod:`gtao.kernels.arcs`: a direction of the slice is ω(θ) = cos θ V + sin θ T with dω = |sin θ| dθ dφ, and
⟨N, ω⟩ = n_V cos θ + n_T sin θ = |n_p| cos(θ - γ). An arc is named in one of two ways: by the cosines c0 (side -T) and
c1 (side +T) of horizons h0 <= 0 <= h1 that are clamped to the normal's hemisphere; or ("signed") by any two angles
a <= b inside [-π, π], which also holds where the arc leaves out θ = 0.

The mean over slices of t0 T + t1 V is the mean unoccluded direction, whose unit vector is the bent normal; that of
ss TTᵀ + sc (TVᵀ + VTᵀ) + cc VVᵀ is the matrix of second moments. Both are integrals over the hemisphere divided by π.
"""

import drjit as dr

from .arcs import acos

__all__ = [
    "first",
    "first_signed",
    "first_uniform",
    "first_uniform_signed",
    "mean_horizon",
    "second",
    "second_signed",
]


def first(nV, nT, c0, c1):
    """Cosine-weighted first moments |n_p| (t0, t1) along T and V, for h0 <= 0 <= h1.

    |n_p| t0 = ⅓ [n_V (s0³ + s1³) + n_T ((1 - c0)² (2 + c0) + (1 - c1)² (2 + c1))],
    |n_p| t1 = ⅓ [n_V (2 - c0³ - c1³) + n_T (s0³ + s1³)], with s_i = sin h_i (s0 <= 0): the integrals t0 and t1 of the
    bent normal in ATVI-TR-19-01, without the angle γ and without dividing by |n_p|.
    """
    return _between(lambda _, s, c: _first(nV, nT, s, c), c0, c1)


def second(nV, nT, c0, c1):
    """Cosine-weighted second moments (ss, sc, cc) of sin² θ, sin θ cos θ and cos² θ, for h0 <= 0 <= h1.

    ss = n_V (s0⁴ + s1⁴)/4 + n_T (i40(h0) + i40(h1)), sc = n_V (i22(h0) + i22(h1)) + n_T (s0⁴ + s1⁴)/4,
    cc = n_V (2 - c0⁴ - c1⁴)/4 + n_T (i22(h0) + i22(h1)), with the integrals of sin⁴ and sin² cos² from 0 to h,
    i40 = (3h - 3sc - 2s³c)/8 and i22 = (h - sc (1 - 2s²))/8. ss + cc is the visible share. The next
    order after the bent normal of ATVI-TR-19-01.
    """
    return _between(lambda *end: _second(nV, nT, *end), c0, c1)


def first_uniform(c0, c1):
    """First moments along T and V without the cosine, for h0 <= 0 <= h1.

    (½ [(h0 - s0 c0) + (h1 - s1 c1)], ½ (s0² + s1²)): the solid-angle weighting of Jimenez et al. 2016, appendix A.
    """
    return _between(_first_uniform, c0, c1)


def first_signed(nV, nT, a, b):
    """:func:`first` for any arc inside [-π, π]: Q(b) - Q(a), where Q(t) = sgn(t) times the formula of one side."""
    return _from_to(lambda _, s, c: _first(nV, nT, s, c), a, b)


def second_signed(nV, nT, a, b):
    """:func:`second` for any arc inside [-π, π]: Q(b) - Q(a), where Q(t) = sgn(t) times the formula of one side."""
    return _from_to(lambda *end: _second(nV, nT, *end), a, b)


def first_uniform_signed(a, b):
    """:func:`first_uniform` for any arc inside [-π, π]: Q(b) - Q(a), Q(t) = sgn(t) (½ (t - sin t cos t), ½ sin² t)."""
    return _from_to(_first_uniform, a, b)


def mean_horizon(c0, c1):
    """(sin m, cos m) of the angle m = (h0 + h1)/2 halfway between the horizons, for h0 <= 0 <= h1.

    The sum over slices of sin m T + cos m V is the bent normal of the slides of Jimenez et al. 2016 ("average both
    horizon angles"): a baseline, biased toward the viewer (an open surface tilted by 45° gives 24.6°). Half-angle
    formulas, sin(h/2) = √((1 - c)/2) and cos(h/2) = √((1 + c)/2), take the place of the angles.
    """
    (s0, k0), (s1, k1) = _half_angle(c0), _half_angle(c1)
    return dr.fma(s1, k0, -k1 * s0), dr.fma(k1, k0, s1 * s0)


def _first(nV, nT, s, c):
    s3, q = s * s * s, 1 - c
    return (
        dr.fma(nV, s3, nT * q * q * (2 + c)) * (1 / 3),
        dr.fma(nV * q, dr.fma(c, 1 + c, 1), nT * s3) * (1 / 3),
    )


def _second(nV, nT, h, s, c):
    s2, sc = s * s, s * c
    quarter, q2 = 0.25 * s2 * s2, 1 - c * c
    i40 = dr.fma(-sc, dr.fma(2, s2, 3), 3 * h) * (1 / 8)
    i22 = dr.fma(-sc, dr.fma(-2, s2, 1), h) * (1 / 8)
    return dr.fma(nV, quarter, nT * i40), dr.fma(nV, i22, nT * quarter), dr.fma(nV, 0.25 * q2 * (1 + c * c), nT * i22)


def _first_uniform(h, s, c):
    return 0.5 * dr.fma(-s, c, h), 0.5 * s * s


def _between(side, c0, c1):
    """The integrals ``side`` from 0 outward, summed over the two sides; on -T the angle and its sine are negative."""
    (h0, s0, c0), (h1, s1, c1) = _horizon(c0), _horizon(c1)
    return tuple(x + y for x, y in zip(side(-h0, -s0, c0), side(h1, s1, c1), strict=True))


def _from_to(side, a, b):
    def Q(t):
        sign = dr.select(t < 0, -1, 1)
        return (sign * x for x in side(t, *dr.sincos(t)))

    return tuple(y - x for x, y in zip(Q(a), Q(b), strict=True))


def _horizon(c):
    """(h, sin h, cos h) for h = arccos c in [0, π]."""
    c = dr.select(c < 1, dr.select(c > -1, c, -1), 1)
    return acos(c), dr.sqrt(dr.fma(-c, c, 1)), c


def _half_angle(c):
    s, k = 0.5 - 0.5 * c, 0.5 + 0.5 * c
    return dr.sqrt(dr.select(s > 0, s, 0)), dr.sqrt(dr.select(k > 0, k, 0))
