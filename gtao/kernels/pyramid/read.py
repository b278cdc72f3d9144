"""Which level a sample reads, and what it says there.

A level is known by its scale, the power of two that its coordinates are those of the pixels times: 2⁻ᵏ. It comes from
the exponent of a distance, and everything else from it by multiplications.
"""

import drjit as dr

from .layout import Table

__all__ = ["bilinear_level", "fetch_level", "index", "level"]

# Above this many texels a flat index no longer fits the 24 bits of a float32.
_EXACT_TEXELS = 1 << 24


def _bits(Float):
    """Unsigned type as wide as ``Float``, its exponent's mask, and the bits of 1."""
    if dr.type_v(Float) is dr.VarType.Float64:
        return dr.uint64_array_t(Float), 0x7FF << 52, 0x3FF << 52
    return dr.uint32_array_t(Float), 0xFF << 23, 0x7F << 23


def level(distance_px, scale, table: Table, types):
    """Scale 2⁻ᵏ of the level k for a sample ``distance_px`` away: log2(distance) - offset, to the nearest one there is.

    Args:
        distance_px: without gradients: levels change in jumps.
        scale: 2^(1/2 - offset).
    """
    UInt, mask, one = _bits(types.Float)
    # The exponent is the logarithm rounded down, of which the half in the scale makes the nearest.
    scaled, most = distance_px * scale, float(1 << (table.n_levels - 1))
    scaled = dr.select(scaled > 1, scaled, 1)
    scaled = dr.select(scaled < most, scaled, most)
    return dr.reinterpret_array(types.Float, UInt(2 * one) - (dr.reinterpret_array(UInt, scaled) & mask))


def index(table: Table, px, py, s, types, *, inside=False):
    """Number in the buffer of the texel of the level of scale ``s`` that contains pixel (px, py).

    Args:
        px, py: whole numbers as floats.
        inside: whether they are known to lie in the frame; if not, any texel may be read for those that do not.
    """
    UInt, Int = types.UInt, types.Int
    if _is_exact(table, types):
        row = dr.floor(py * s)
        number = UInt(Int(dr.fma(dr.fma(row, table.stride, dr.fma(s, table.base, px)), s, -table.shift)))
    else:
        k = _number(s, types)
        row = UInt(Int(py)) >> k
        number = ((row * table.stride + (UInt(table.base) >> k) + UInt(Int(px))) >> k) - table.shift
    return number if inside else _existing(number, table)


def fetch_level(buffer, table: Table, px, py, s, types, *, inside=False):
    """Depth of the texel of the level of scale ``s`` that contains pixel (px, py), see :func:`index`."""
    return dr.gather(types.Float, buffer, index(table, px, py, s, types, inside=inside))


def bilinear_level(buffer, table: Table, px, py, s, orthographic, types):
    """Depth at pixel (px, py) between the four texels of the level of scale ``s`` around it, interpolated in 1/z.

    In parallel projection it is z that is interpolated. No edge stops it; beyond the outermost centres the level goes
    on as it ends. The point lies inside the frame.
    """
    UInt, Int, Float = types.UInt, types.Int, types.Float
    k = _number(s, types)

    def between(p, size):
        """The two texels about p along one axis, and how far it is from the first to the second."""
        last = UInt(size - 1) >> k
        t = dr.fma(p + 0.5, s, -0.5)
        t = dr.select(t > 0, t, 0)
        first = UInt(Int(t))
        return first, dr.select(first < last, first + 1, last), t - Float(first)

    def texel(x, y):
        number = y * (UInt(table.stride) >> k) + x + (UInt(table.base) >> (k + k)) - table.shift
        return dr.gather(Float, buffer, _existing(number, table))

    (x0, x1, u), (y0, y1, v) = between(px, table.width), between(py, table.height)
    rows = []
    for y in (y0, y1):
        left, right = texel(x0, y), texel(x1, y)
        if not orthographic:
            left, right = 1 / left, 1 / right
        rows.append(dr.lerp(left, right, u))
    value = dr.lerp(rows[0], rows[1], v)
    return value if orthographic else 1 / value


def _is_exact(table, types):
    """Whether flat indices are exact as floats."""
    return dr.type_v(types.Float) is dr.VarType.Float64 or table.size + table.shift <= _EXACT_TEXELS


def _number(s, types):
    """k from 2⁻ᵏ."""
    UInt, mask, one = _bits(types.Float)
    exponent = (one - (dr.reinterpret_array(UInt, s) & mask)) // (one & -one)
    return types.UInt(exponent)


def _existing(number, table):
    """The number of a texel, of the last where coordinates are no numbers: never a wild address."""
    return dr.select(number < table.last, number, table.last)
