"""Per-pixel rotation and step offset, both in [0, 1), from pixel coordinates and a frame.

The rotation is a fraction of the angle between two slices, the offset a fraction of one step. What changes from frame
to frame is computed on the host by :func:`frame_terms`, so that the kernel is the same in every frame.
"""

from typing import NamedTuple

import drjit as dr

from . import noise_mask, noise_sobol

__all__ = ["GOLDEN", "MASKED", "PATTERNS", "FrameTerms", "frame_terms", "hilbert_index", "pattern", "pcg"]

GOLDEN = 0.6180339887498949

# Rotations in degrees and offsets per frame (Jimenez et al. 2016 slides); the cycle has 24 frames.
_ROTATIONS = (60, 300, 180, 240, 120, 0)
_OFFSETS = (0.0, 0.5, 0.25, 0.75)
# The same six steps on the finer grid of 96 directions: sixths of the 1/16 between two directions in space.
_FINE_ROTATIONS = (0, 3, 1, 4, 2, 5)
# Sixths of the half turn, moved so that they meet all of that grid; those of either parity are all around (theory, eq.
# (187)).
_SPREAD_ROTATIONS = (0, 49, 32, 81, 64, 17)
_SPREAD_OFFSETS = (0, 10, 5, 15)

# The curve covers 2^6 x 2^6 pixels and starts this much farther along it from frame to frame (XeGTAO).
_HILBERT_LEVELS = 6
_HILBERT_FRAME = 288
# Powers of the inverse plastic number, 0.7548776662466927 and its square, in units of 2^-32: the R2 sequence.
_R2 = (3242174889, 2447445414)

# What all values move on from frame to frame, in the same units: the inverse golden ratio, and √2 - 1 for the offset.
_GOLDEN_STEPS = (2654435769, 1779033704)

#: Patterns that read a mask.
MASKED = ("blue_noise",)


class FrameTerms(NamedTuple):
    """What the patterns know of the frame: numbers on the host, arrays of width one in the kernel.

    Attributes:
        frame_rotation, frame_offset: added to rotation and offset in most patterns.
        key: 32-bit integer that no two frames or seeds share but by chance.
        seed: 32-bit integer of the seed alone; None where the pattern has no use for it.
        frame: number of the frame as a 32-bit integer; None where the pattern has no use for it.
    """

    frame_rotation: float
    frame_offset: float
    key: int
    seed: int | None = None
    frame: int | None = None


def frac(x):
    """x - floor(x)."""
    return x - dr.floor(x)


def pcg(v):
    """Hash of 32-bit integers: one step of a congruential generator and the output permutation of PCG."""
    v = v * 747796405 + 2891336453
    v = ((v >> ((v >> 28) + 4)) ^ v) * 277803737
    return (v >> 22) ^ v


def _none(x, y, s, Float):
    half = dr.full(Float, 0.5, dr.width(x))
    return half, half


def _quarters(x, y, s, Float):
    """4 offsets, each once in every row and column of 4 pixels."""
    return frac(dr.fma(Float((y - x) & 3), 0.25, s.frame_offset))


def _spatial_4x4(x, y, s, Float):
    """16 directions in 4×4 pixels and 4 offsets; the slides' formula with its brackets put right (theory, eq. (33))."""
    k = (((x + y) & 3) << 2) + (x & 3)
    return frac(dr.fma(Float(k), 1 / 16, s.frame_rotation)), _quarters(x, y, s, Float)


def _spatial_4x4_unbracketed(x, y, s, Float):
    """The formula as printed: x mod 4 stands outside of the factor 1/16, whole turns that leave 4 directions."""
    return frac(dr.fma(Float(((x + y) & 3) << 2), 1 / 16, s.frame_rotation)), _quarters(x, y, s, Float)


def _gradient(u, v):
    return frac(52.9829189 * frac(dr.fma(u, 0.06711056, 0.00583715 * v)))


def _interleaved_gradient(x, y, s, Float):
    """Interleaved gradient noise (Jimenez 2014) for the rotation, the 4-valued offsets beside it."""
    return _gradient(Float(x) + s.frame_rotation, Float(y) + s.frame_rotation), _quarters(x, y, s, Float)


def _interleaved_gradient_cycled(x, y, s, Float):
    """The same in space; over time the slides' rotations and offsets (Unity HDRP), or steps of irrational numbers."""
    return frac(_gradient(Float(x), Float(y)) + s.frame_rotation), _quarters(x, y, s, Float)


def hilbert_index(x, y):
    """Number of pixel (x, y) on a Hilbert curve through its block of 64×64, from its corner at the top left."""
    x, y, index = x & 63, y & 63, 0
    for level in reversed(range(_HILBERT_LEVELS)):
        right, low = (x >> level) & 1, (y >> level) & 1
        index = index + (((3 * right) ^ low) << (2 * level))
        # The curve enters its first quarter transposed and its last anti-transposed.
        mirror = 63 * (right & (low ^ 1))
        x, y = x ^ mirror, y ^ mirror
        x, y = dr.select(low == 0, y, x), dr.select(low == 0, x, y)
    return index


def _unit(word, Float):
    """The upper 24 bits of an integer as a number in [0, 1)."""
    return Float(word >> 8) * 2**-24


def _hilbert_r2(x, y, s, Float):
    """The R2 sequence along a Hilbert curve (theory, noise along a curve), in integers: no digits go to the index."""
    n = hilbert_index(x, y) + s.key
    return tuple(_unit(n * a + 0x80000000, Float) for a in _R2)


def _white(x, y, s, Float):
    """Two independent uniform numbers from a keyed integer hash, twice."""
    h = pcg(pcg(pcg(x) + y) + s.key)
    return _unit(h, Float), _unit(pcg(h), Float)


def _blue_noise(x, y, s, Float):
    """Void and cluster in space; over time all values move on together (theory, eq. (188))."""
    word = noise_mask.word_at(s.mask, x, y, s.seed)
    rotation, offset = Float(word & 0xFFFF) * 2**-16, Float(word >> 16) * 2**-16
    return frac(rotation + s.frame_rotation), frac(offset + s.frame_offset)


def _sobol(x, y, s, Float):
    """Sobol's sequence over the frames, scrambled in every pixel on its own (theory, eq. (189))."""
    h = pcg(pcg(pcg(x) + y) + s.seed)
    rotation, offset = noise_sobol.owen(s.frame, h), noise_sobol.owen(noise_sobol.second_dimension(s.frame), pcg(h))
    return _unit(rotation, Float), _unit(offset, Float)


PATTERNS = {
    "none": _none,
    "spatial_4x4": _spatial_4x4,
    "spatial_4x4_unbracketed": _spatial_4x4_unbracketed,
    "spatial_4x4_fine": _spatial_4x4,
    "spatial_4x4_spread": _spatial_4x4,
    "interleaved_gradient": _interleaved_gradient,
    "interleaved_gradient_cycled": _interleaved_gradient_cycled,
    "interleaved_gradient_golden": _interleaved_gradient_cycled,
    "hilbert_r2": _hilbert_r2,
    "blue_noise": _blue_noise,
    "sobol": _sobol,
    "white": _white,
}


def frame_terms(name, frame_index, seed):
    """:class:`FrameTerms` of a frame, as numbers."""
    of_seed = (seed * 0x9E3779B1) & 0xFFFFFFFF
    key = (of_seed + frame_index * 0x85EBCA6B) & 0xFFFFFFFF
    if name == "hilbert_r2":
        return FrameTerms(0.0, 0.0, _HILBERT_FRAME * (frame_index % 64))
    if name in ("spatial_4x4", "spatial_4x4_unbracketed", "interleaved_gradient_cycled"):
        return FrameTerms(_ROTATIONS[frame_index % 6] / 360, _OFFSETS[(frame_index // 6) % 4], key)
    if name == "spatial_4x4_fine":
        return FrameTerms(_FINE_ROTATIONS[frame_index % 6] / 96, _OFFSETS[(frame_index // 6) % 4] / 4, key)
    if name == "spatial_4x4_spread":
        return FrameTerms(_SPREAD_ROTATIONS[frame_index % 6] / 96, _SPREAD_OFFSETS[(frame_index // 6) % 4] / 16, key)
    if name == "interleaved_gradient":
        return FrameTerms(5.588238 * (frame_index % 64), _OFFSETS[frame_index % 4], key)
    if name in ("blue_noise", "interleaved_gradient_golden"):
        # In integers, and rounded to 24 digits, to which the kernel's sums are exact.
        rotation, offset = ((((frame_index * a) & 0xFFFFFFFF) >> 8) * 2**-24 for a in _GOLDEN_STEPS)
        return FrameTerms(rotation, offset, key, seed=of_seed if name in MASKED else None)
    if name == "sobol":
        # In the order of Gray's code, in which frames of either parity fill both halves of every interval.
        return FrameTerms(0.0, 0.0, key, seed=of_seed, frame=(frame_index ^ (frame_index >> 1)) & 0xFFFFFFFF)
    return FrameTerms(0.0, 0.0, key)


def pattern(name, x, y, s, Float):
    """Rotation and offset of pattern ``name``.

    Args:
        name: a key of ``PATTERNS``.
        x, y: integer coordinates of the pixels (unsigned).
        s: what has the attributes of :class:`FrameTerms` that the pattern needs, as arrays of width one, and as
            ``mask`` the words that ``MASKED`` patterns read: rotation in the lower 16 bits, offset in the upper.
        Float: type of the result.
    """
    return PATTERNS[name](x, y, s, Float)
