"""Depth at lower resolutions: a chain of levels in one flat buffer, each half as wide and high as the one before.

Level 0 is the depth buffer itself; a texel of level k stands for 2ᵏ × 2ᵏ pixels, also where the sides are odd: the last
texel of a row then stands for fewer.
"""

from dataclasses import dataclass

import drjit as dr

__all__ = ["FILTERS", "RANGE_FACTOR", "Table", "bilinear_level", "build", "fetch_level", "level"]

# The weighted filter tells near from far at this share of the radii of the falloff (XeGTAO).
RANGE_FACTOR = 0.75


@dataclass(frozen=True)
class Table:
    """Where the levels lie in the buffer; a static part of kernels."""

    offsets: tuple[int, ...]
    widths: tuple[int, ...]
    heights: tuple[int, ...]

    @classmethod
    def of(cls, width, height, n_levels):
        widths = tuple(((width - 1) >> k) + 1 for k in range(n_levels))
        heights = tuple((height - 1 >> k) + 1 for k in range(n_levels))
        sizes = [w * h for w, h in zip(widths, heights, strict=True)]
        return cls(tuple(sum(sizes[:k]) for k in range(n_levels)), widths, heights)

    @property
    def n_levels(self):
        return len(self.offsets)

    @property
    def size(self):
        return self.offsets[-1] + self.widths[-1] * self.heights[-1]


def _least(depths, start, end, x, y):
    a, b, c, d = depths
    a, b = dr.select(a < b, a, b), dr.select(c < d, c, d)
    return dr.select(a < b, a, b)


def _greatest(depths, start, end, x, y):
    a, b, c, d = depths
    a, b = dr.select(a > b, a, b), dr.select(c > d, c, d)
    return dr.select(a > b, a, b)


def _mean(depths, start, end, x, y):
    """Of the surfaces; background only where all four are."""
    total, count = 0, 0
    for z in depths:
        surface = dr.isfinite(z)
        total = total + dr.select(surface, z, 0)
        count = count + dr.select(surface, type(z)(1), 0)
    return dr.select(count > 0, total / dr.select(count > 0, count, 1), dr.inf)


def _weighted(depths, start, end, x, y):
    """About the farthest: a depth counts in full up to ``start`` in front of it, and nothing from ``end`` on."""
    far = _greatest(depths, start, end, x, y)
    surface = dr.isfinite(far)
    reference = dr.select(surface, far, 0)
    scale = 1 / (end - start)
    total, weights = 0, 0
    for z in depths:
        z = dr.select(dr.isfinite(z), z, 0)
        weight = (end - (reference - z)) * scale
        weight = dr.select(weight > 0, dr.select(weight < 1, weight, 1), 0)
        total, weights = dr.fma(weight, z, total), weights + weight
    # The farthest itself counts in full, so that the sum is at least 1 where there is a surface.
    return dr.select(surface, total / dr.select(surface, weights, 1), dr.inf)


def _harmonic(depths, start, end, x, y):
    """Of all four, through the mean of 1/z, which is 0 on the background: what averaging reversed depth makes."""
    total = sum(1 / z for z in depths)
    return dr.select(total > 0, 4 / dr.select(total > 0, total, 1), dr.inf)


def _rotated_grid(depths, start, end, x, y):
    """One of the four, another one for odd rows and columns (McGuire et al. 2012)."""
    a, b, c, d = depths
    right, low = (y & 1) > 0, (x & 1) > 0
    return dr.select(low, dr.select(right, d, c), dr.select(right, b, a))


FILTERS = {
    "weighted": _weighted,
    "min": _least,
    "max": _greatest,
    "average": _mean,
    "harmonic": _harmonic,
    "rotated_grid": _rotated_grid,
}


def build(view_z, table: Table, name, start, end, types):
    """All levels, flat, one after the other.

    Args:
        view_z: flat depth of ``table.widths[0]`` x ``table.heights[0]`` pixels, inf on the background.
        name: what a texel makes of its four of the level before, a key of ``FILTERS``: the "weighted" mean about the
            farthest of them, "min", "max", "average", "harmonic" (of 1/z) or "rotated_grid" (one of them).
        start, end: differences of depth for the weighted filter, 0 <= start < end; theory, the depth pyramid.
    """
    levels = [view_z]
    for k in range(1, table.n_levels):
        index = dr.arange(types.UInt, table.widths[k] * table.heights[k])
        y = index // table.widths[k]
        x = index - y * table.widths[k]
        width, height = table.widths[k - 1], table.heights[k - 1]
        depths = []
        for dy in (0, 1):
            for dx in (0, 1):
                i, j = 2 * x + dx, 2 * y + dy
                i = dr.select(i < width, i, width - 1)
                j = dr.select(j < height, j, height - 1)
                depths.append(dr.gather(types.Float, levels[-1], j * width + i))
        levels.append(FILTERS[name](depths, start, end, x, y))
    return dr.concat(levels)


def level(distance_px, scale, table: Table, types):
    """Level for a sample ``distance_px`` away: log2(distance) - offset, to the nearest one there is.

    Args:
        scale: 2^(1/2 - offset).
    """
    # The position of the highest bit is the logarithm rounded down, of which the half makes the nearest.
    scaled = types.UInt(distance_px * scale)
    k = 31 - dr.lzcnt(dr.select(scaled > 0, scaled, 1))
    return dr.select(k < table.n_levels, k, table.n_levels - 1)


def fetch_level(buffer, table: Table, px, py, k, types):
    """Depth of the texel of level ``k`` that contains pixel (px, py), whole numbers as floats inside the frame."""
    UInt, Int = types.UInt, types.Int
    return _texel(buffer, table, UInt(Int(px)) >> k, UInt(Int(py)) >> k, k, types)


def bilinear_level(buffer, table: Table, px, py, k, orthographic, types):
    """Depth at pixel (px, py) between the four texels of level ``k`` around it, interpolated in 1/z.

    In parallel projection it is z that is interpolated. No edge stops it; beyond the outermost centres the level goes
    on as it ends. The point lies inside the frame.
    """
    UInt, Int, Float = types.UInt, types.Int, types.Float
    scale = 1 / Float(UInt(1) << k)

    def between(p, size):
        """The two texels about p along one axis, and how far it is from the first to the second."""
        last = UInt(size - 1) >> k
        t = dr.fma(p + 0.5, scale, -0.5)
        t = dr.select(t > 0, t, 0)
        first = UInt(Int(t))
        first = dr.select(first < last, first, last)
        return first, dr.select(first < last, first + 1, last), t - Float(first)

    (x0, x1, u), (y0, y1, v) = between(px, table.widths[0]), between(py, table.heights[0])
    rows = []
    for y in (y0, y1):
        left, right = (_texel(buffer, table, x, y, k, types) for x in (x0, x1))
        if not orthographic:
            left, right = 1 / left, 1 / right
        rows.append(dr.lerp(left, right, u))
    value = dr.lerp(rows[0], rows[1], v)
    return value if orthographic else 1 / value


def _texel(buffer, table: Table, x, y, k, types):
    """Texel (x, y) of level ``k``."""
    UInt = types.UInt
    offset = UInt(0)
    for i in range(1, table.n_levels):
        offset = dr.select(k == i, table.offsets[i], offset)
    width = (UInt(table.widths[0] - 1) >> k) + 1
    index = offset + y * width + x
    return dr.gather(types.Float, buffer, dr.select(index < table.size, index, 0))
