"""Inner integrals over the visible arc of one slice.

A slice is the half-plane pair through the view vector V with unit tangent T; a direction in it is
ω(θ) = cos θ V + sin θ T with dω = |sin θ| dθ dφ. The normal enters through n_V = ⟨N, V⟩ and n_T = ⟨N, T⟩ and the
horizons through the cosines c0 (side -T) and c1 (side +T), both already clamped to the normal's hemisphere.
"""

import math

import drjit as dr

from .chebyshev import evaluate, interpolated
from .roots import rsqrt

__all__ = [
    "acos",
    "cosine_arc_from_angles",
    "cosine_arc_signed",
    "fast_acos",
    "full_slice",
    "normal_angle",
    "segment",
    "uniform_arc_signed",
]

# Minimax polynomial of arccos(x)/sqrt(1-x) on [0, 1], Abramowitz & Stegun 4.4.46: |error| <= 2e-8, below float32's
# own rounding, and half the instructions of the exact function.
_ACOS = (
    -0.0012624911,
    0.0066700901,
    -0.0170881256,
    0.0308918810,
    -0.0501743046,
    0.0889789874,
    -0.2145988016,
    1.5707963050,
)


# (arccos a - a √(1 - a²)) / (1 - a)^1.5 on [0, 1] with an error of 4e-8.
_SEGMENT = interpolated(lambda a: (math.acos(a) - a * math.sqrt(1 - a * a)) / (1 - a) ** 1.5, 0.0, 1.0, 7)


def acos(x):
    """arccos for x in [-1, 1]; polynomial in single precision, Dr.Jit's own in double."""
    if dr.type_v(x) is not dr.VarType.Float32:
        return dr.acos(x)
    a = abs(x)
    p = dr.fma(a, _ACOS[0], _ACOS[1])
    for coefficient in _ACOS[2:]:
        p = dr.fma(p, a, coefficient)
    below = 1 - a
    p = p * dr.sqrt(dr.select(below > 0, below, 0))
    return dr.select(x < 0, math.pi - p, p)


def _sqrt_of_bits(x):
    """√x for x >= 0 with an error of -2.2 % to 4.5 %: half the exponent, by a shift of the number's bits."""
    Float32 = dr.float32_array_t(type(x))
    UInt = dr.uint32_array_t(Float32)
    bits = (dr.reinterpret_array(UInt, dr.detach(Float32(x))) >> 1) + 0x1FBD1DF5
    return dr.replace_grad(type(x)(dr.reinterpret_array(Float32, bits)), dr.sqrt(x))


def fast_acos(x, kind):
    """What shaders compute for arccos (theory, eq. (66)).

    Args:
        x: in [-1, 1].
        kind: "exact"; "two_term", (π/2 - 0.156583 |x|) √(1 - |x|), error up to 0.009; or "bit_trick", the same with
            the square root taken from the bits of a float32, error up to 0.055. Its derivative is that of "two_term".
    """
    if kind == "exact":
        return acos(x)
    a = abs(x)
    below = dr.select(a < 1, 1 - a, 0)
    root = _sqrt_of_bits(below) if kind == "bit_trick" else dr.sqrt(below)
    p = dr.fma(-0.156583, a, math.pi / 2) * root
    return dr.select(x < 0, math.pi - p, p)


def normal_angle(nV, nT, arccosine):
    """Signed angle γ of the projected normal, from an arc cosine of :func:`fast_acos`."""
    return dr.copysign(fast_acos(nV * rsqrt(dr.fma(nV, nV, nT * nT)), arccosine), nT)


def cosine_arc_from_angles(nV, nT, gamma, h0, h1):
    """|n_p| â as engines write it, from angles that may be approximate: theory, eq. (67).

    ¼ |n_p| Σ (cos γ + 2 h sin γ - cos(2h - γ)) over the signed horizons, with the exact cosine n_V / |n_p| in the
    first term. With exact angles it is :func:`gtao.kernels.visible_arc.visible_arc`.
    """
    length = dr.sqrt(dr.fma(nV, nV, nT * nT))
    sine = dr.sin(gamma)
    each = [dr.fma(2 * h, sine, -dr.cos(2 * h - gamma)) for h in (h0, h1)]
    return 0.25 * dr.fma(length, each[0] + each[1], 2 * nV)


def segment(c):
    """h - s c and s² of c = cos h, s = sin h, with c limited to [-1, 1].

    Twice the area of the circle's segment over an angle of 2 h. High horizons make the two terms cancel but for h³,
    so that their difference is approximated, which loses no digits.
    """
    a = abs(c)
    a = dr.select(a < 1, a, 1)
    s2 = dr.fma(-a, a, 1)
    if dr.type_v(c) is not dr.VarType.Float32:
        area = dr.fma(-a, dr.sqrt(s2), dr.acos(a))
    else:
        below = 1 - a
        area = below * dr.sqrt(below) * evaluate(_SEGMENT, a)
    return dr.select(c < 0, math.pi - area, area), s2


def cosine_arc_signed(gamma, a, b):
    """∫_a^b cos(θ - γ) |sin θ| dθ for any arc inside [-π, π] (theory, eq. (13)); eq. (11) needs a <= 0 <= b."""

    def G(t):
        g = dr.cos(gamma) - dr.cos(2 * t - gamma) + 2 * t * dr.sin(gamma)
        return dr.select(t < 0, -0.25, 0.25) * g

    return G(b) - G(a)


def uniform_arc_signed(a, b):
    """∫_a^b |sin θ| dθ for any arc inside [-π, π] (below theory, eq. (14))."""

    def U(t):
        return dr.select(t < 0, -1, 1) * (1 - dr.cos(t))

    return U(b) - U(a)


def full_slice(nV, nT):
    """|n_p| â of an unoccluded slice, n_V + γ n_T (theory, eq. (15)); its mean over slices is exactly 1 by eq. (16)."""
    return dr.fma(dr.atan2(nT, nV), nT, nV)
