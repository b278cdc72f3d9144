"""Per-pixel rotation and step offset, both in [0, 1), from pixel coordinates and a frame.

The rotation is a fraction of the angle between two slices, the offset a fraction of one step. ``frame_rotation``,
``frame_offset`` and ``key`` are computed on the host by :func:`frame_terms`, so that the kernel is the same in every
frame.
"""

import drjit as dr

__all__ = ["GOLDEN", "PATTERNS", "frame_terms", "hilbert_index", "pattern", "pcg"]

GOLDEN = 0.6180339887498949

# Rotations in degrees and offsets per frame (Jimenez et al. 2016 slides); the cycle has 24 frames.
_ROTATIONS = (60, 300, 180, 240, 120, 0)
_OFFSETS = (0.0, 0.5, 0.25, 0.75)

# The curve covers 2^6 x 2^6 pixels and starts this much farther along it from frame to frame (XeGTAO).
_HILBERT_LEVELS = 6
_HILBERT_FRAME = 288
# Powers of the inverse plastic number, 0.7548776662466927 and its square, in units of 2^-32: the R2 sequence.
_R2 = (3242174889, 2447445414)


def frac(x):
    """x - floor(x)."""
    return x - dr.floor(x)


def pcg(v):
    """Hash of 32-bit integers: one step of a congruential generator and the output permutation of PCG."""
    v = v * 747796405 + 2891336453
    v = ((v >> ((v >> 28) + 4)) ^ v) * 277803737
    return (v >> 22) ^ v


def _none(x, y, frame_rotation, frame_offset, key, Float):
    half = dr.full(Float, 0.5, dr.width(x))
    return half, half


def _spatial_4x4(x, y, frame_rotation, frame_offset, key, Float):
    """16 directions in 4×4 pixels and 4 offsets; the slides' formula with its brackets put right (theory, eq. (33))."""
    k = (((x + y) & 3) << 2) + (x & 3)
    j = (y - x) & 3
    return frac(dr.fma(Float(k), 1 / 16, frame_rotation)), frac(dr.fma(Float(j), 0.25, frame_offset))


def _interleaved_gradient(x, y, frame_rotation, frame_offset, key, Float):
    """Interleaved gradient noise (Jimenez 2014) for the rotation, the 4-valued offsets beside it."""
    u, v = Float(x) + frame_rotation, Float(y) + frame_rotation
    j = (y - x) & 3
    return frac(52.9829189 * frac(dr.fma(u, 0.06711056, 0.00583715 * v))), frac(dr.fma(Float(j), 0.25, frame_offset))


def _interleaved_gradient_cycled(x, y, frame_rotation, frame_offset, key, Float):
    """The same in space; over time the slides' rotations and offsets (Unity HDRP)."""
    rotation, offset = _interleaved_gradient(x, y, Float(0), frame_offset, key, Float)
    return frac(rotation + frame_rotation), offset


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


def _hilbert_r2(x, y, frame_rotation, frame_offset, key, Float):
    """The R2 sequence along a Hilbert curve (theory, noise along a curve), in integers: no digits go to the index."""
    n = hilbert_index(x, y) + key
    first, second = ((n * a + 0x80000000) >> 8 for a in _R2)
    return Float(first) * 2**-24, Float(second) * 2**-24


def _white(x, y, frame_rotation, frame_offset, key, Float):
    """Two independent uniform numbers from a keyed integer hash, twice."""
    h = pcg(pcg(pcg(x) + y) + key)
    g = pcg(h)
    return Float(h >> 8) * 2**-24, Float(g >> 8) * 2**-24


PATTERNS = {
    "none": _none,
    "spatial_4x4": _spatial_4x4,
    "interleaved_gradient": _interleaved_gradient,
    "interleaved_gradient_cycled": _interleaved_gradient_cycled,
    "hilbert_r2": _hilbert_r2,
    "white": _white,
}


def frame_terms(name, frame_index, seed):
    """``(frame_rotation, frame_offset, key)`` of a frame: two floats and a 32-bit integer."""
    key = (seed * 0x9E3779B1 + frame_index * 0x85EBCA6B) & 0xFFFFFFFF
    if name == "hilbert_r2":
        return 0.0, 0.0, _HILBERT_FRAME * (frame_index % 64)
    if name in ("spatial_4x4", "interleaved_gradient_cycled"):
        return _ROTATIONS[frame_index % 6] / 360, _OFFSETS[(frame_index // 6) % 4], key
    if name == "interleaved_gradient":
        return 5.588238 * (frame_index % 64), _OFFSETS[frame_index % 4], key
    return 0.0, 0.0, key


def pattern(name, x, y, frame_rotation, frame_offset, key, Float):
    """Rotation and offset of pattern ``name`` at integer pixel coordinates ``x, y`` (unsigned)."""
    return PATTERNS[name](x, y, frame_rotation, frame_offset, key, Float)
