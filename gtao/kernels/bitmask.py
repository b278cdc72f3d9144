"""Visibility of one slice as a bitmask: several blocked arcs instead of one horizon per side.

Therrien et al. 2023. The slice's hemisphere [γ - π/2, γ + π/2] is mapped to [0, 1] and cut into sectors of equal
length; each sample sets the bits of the sectors that it covers. The map decides what the open share measures
(theory, eq. (58)):

======== ============================================= ==============================================================
mapping  equal sectors hold equal                      a slice contributes the open share times
======== ============================================= ==============================================================
angle    angle (the original)                          1
uniform  solid angle                                   1, as :func:`gtao.kernels.visible_arc.visible_arc`
cosine   solid angle times the cosine to the normal    :func:`gtao.kernels.arcs.full_slice`, n_V + γ n_T
======== ============================================= ==============================================================

Directions enter as cosines to V with the side of the slice that they lie on: 0 toward -T, 1 toward +T. Masks count and
have no derivative.
"""

import math

import drjit as dr

from . import arcs, noise

__all__ = [
    "MAPPINGS",
    "approximate_map",
    "approximate_position",
    "jitter",
    "position",
    "sectors",
    "slice_map",
    "visible_share",
]

MAPPINGS = ("angle", "cosine", "uniform")

# Minimax polynomial of (h - sin h cos h) / (1 - c)^(3/2), c = cos h, on [0, 1], fitted for the absolute error of
# h - sin h cos h: below 6e-7.
_SEGMENT = (-0.0039863636, 0.0167604486, -0.0541658152, 0.3561493470, 1.5707968515)

# The jitter has 2⁸ levels. Their middles keep half a level away from 0 and 1, so that rounding at the ends of the
# hemisphere closes no sector; the mean over them misplaces the end of an arc by 1/512 of a sector at most.
_LEVELS = 8


def _segment(c):
    """∫ 2 sin² over [0, h] = h - sin h cos h from c = cos h (a circular segment); polynomial in single precision."""
    a = abs(c)
    u = 1 - a
    u = dr.select(u > 0, u, 0)
    if dr.type_v(c) is not dr.VarType.Float32:
        q = dr.acos(dr.select(a < 1, a, 1)) - a * dr.sqrt(u * (1 + a))
    else:
        q = dr.fma(a, _SEGMENT[0], _SEGMENT[1])
        for coefficient in _SEGMENT[2:]:
            q = dr.fma(q, a, coefficient)
        q = q * u * dr.sqrt(u)
    return dr.select(c < 0, math.pi - q, q)


def slice_map(mapping, nV, nT, start):
    """What :func:`position` needs to know of a slice, and what the slice counts when it is open.

    Args:
        mapping: one of ``MAPPINGS``.
        nV, nT: components of the normal in the slice, n_V >= 0.
        start: cosines of the tangent plane on the two sides, :func:`gtao.kernels.slices.clamped_start`.

    Returns:
        A tuple of arrays and the weight of the open share.
    """
    one = type(nT)(1)
    if mapping == "uniform":
        return (-0.5 * start[0],), one
    if mapping == "angle":
        return (dr.fma(arcs.acos(start[1]), -1 / math.pi, 1),), one
    low, high = (0.5 * dr.fma(s * nT, _segment(c), nV * dr.fma(-c, c, 1)) for s, c in zip((-1, 1), start, strict=True))
    full = low + high
    rcp = 1 / full
    return (low * rcp, 0.5 * nV * rcp, 0.5 * nT * rcp), full


def position(mapping, constants, start, side, c):
    """Where a direction lies in the slice's hemisphere, in [0, 1]; one below the tangent plane maps to its end.

    With θ = ∓arccos c: "angle" is x = (θ - γ)/π + ½ (Therrien et al. 2023); "uniform" x = ½ (U(θ) + 1 - sin γ),
    U(t) = sgn(t) (1 - cos t); "cosine" x = (G(θ) - G(γ - π/2)) / (cos γ + γ sin γ), G the antiderivative of
    cos(θ - γ) |sin θ|, here in the cosines of theory, eq. (83). The last two are the cumulative distributions of the
    arcs of Jimenez et al. 2016.

    Args:
        mapping: one of ``MAPPINGS``.
        constants: first result of :func:`slice_map`.
        start: the tangent plane's cosine on this side.
        side: 0 toward -T, 1 toward +T.
        c: cosine to V; NaN, as the background has, maps to the end of the side.
    """
    c = dr.select(c > start, c, start)
    sign = 1 if side else -1
    if mapping == "uniform":
        return dr.fma(c, -0.5 * sign, constants[0] + side)
    if mapping == "angle":
        return dr.fma(arcs.acos(dr.select(c < 1, c, 1)), sign / math.pi, constants[0])
    origin, along_V, along_T = constants
    return dr.fma(sign * along_V, dr.fma(-c, c, 1), dr.fma(along_T, _segment(c), origin))


def approximate_map(nV, nT, arccosine):
    """:func:`slice_map` of the mapping "angle" with a shader's arc cosine, :func:`gtao.kernels.arcs.fast_acos`."""
    return (dr.fma(arcs.normal_angle(nV, nT, arccosine), -1 / math.pi, 0.5),), type(nT)(1)


def approximate_position(constants, side, c, arccosine):
    """:func:`position` of the mapping "angle" with a shader's arc cosine, clamped where it is an angle."""
    c = dr.select(c > -1, dr.select(c < 1, c, 1), -1)
    x = dr.fma(arcs.fast_acos(c, arccosine), (1 if side else -1) / math.pi, constants[0])
    return dr.select(x > 0, dr.select(x < 1, x, 1), 0)


def jitter(x, y, index, key):
    """One number per pixel and slice, even over (0, 1) and independent of what rotates and offsets the slices.

    Args:
        x, y: texel coordinates, as floats.
        index: number of the slice.
        key: 32-bit integer that selects the sequence.
    """
    UInt = dr.uint32_array_t(type(x))
    h = noise.pcg(noise.pcg(noise.pcg(UInt(x)) + UInt(y)) + (key ^ 0x5851F42D))
    return dr.fma(type(x)(noise.pcg(h + index) >> (32 - _LEVELS)), 2.0**-_LEVELS, 2.0 ** (-_LEVELS - 1))


def sectors(front, back, side, xi, n, rounding="jittered"):
    """Sectors that the arc between two positions covers, as ⌈n/32⌉ masks of up to 32 bits.

    "jittered": bits k0 <= k < k1 with k_i = ⌊n x_i + ξ⌋ (theory, eq. (59)). Bit k stands for the point (k + 1 - ξ)/n.
    With one uniform ξ for all arcs of a slice the points are a stratified sample, and the share of bits in the union
    of masks is unbiased for the length of the union of arcs, with the variance of eq. (84). "nearest" has ξ = ½.
    "outward" is the original, ⌈n w⌉ sectors from ⌊n x⌋ on for an arc of width w that begins at x, and over-occludes by
    up to a sector per sample.

    Args:
        front, back: positions of the arc's ends in [0, 1]; the back lies deeper, so farther from θ = 0 on its side.
        side: 0 toward -T, 1 toward +T.
        xi: jitter in [0, 1), read by "jittered" alone.
        n: number of sectors: 1 to 32, or a multiple of 32.
        rounding: see above.
    """
    Int = dr.int32_array_t(type(front))

    def sector(x, shift):
        # In single precision n + ξ can round up to n + 1.
        k = Int(dr.fma(x, n, shift))
        return dr.select(k < n, k, n)

    if rounding == "outward":
        low, width = (front, back - front) if side else (back, front - back)
        first = sector(low, 0)
        last = first + Int(dr.ceil(width * n))
        ends = first, dr.select(last < n, last, n)
    else:
        shift = xi if rounding == "jittered" else 0.5
        ends = sector(front, shift), sector(back, shift)
    return tuple(_below(ends[0] - word, n) ^ _below(ends[1] - word, n) for word in range(0, n, 32))


def _below(k, n):
    """Bits 0 … k - 1 of one mask."""
    UInt = dr.uint32_array_t(type(k))
    if n < 32:
        return (UInt(1) << UInt(k)) - 1
    # A shift by 32 is undefined, and masks beyond the first see negative ends.
    if n > 32:
        k = dr.select(k > 0, k, 0)
    return dr.select(k < 32, (UInt(1) << (UInt(k) & 31)) - 1, UInt(0xFFFFFFFF))


def visible_share(masks, n, Float):
    """1 - popcount/n, the share of open sectors (Therrien et al. 2023), as ``Float``."""
    closed = sum(dr.popcnt(mask) for mask in masks)
    return dr.fma(Float(closed), -1 / n, 1)
