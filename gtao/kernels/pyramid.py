"""Depth at lower resolutions: a chain of levels in one flat buffer, each half as wide and high as the one before.

Level 0 is the depth buffer itself; a texel of level k stands for 2ᵏ × 2ᵏ pixels, also where the sides are odd: the last
texel of a row then stands for fewer.
"""

from dataclasses import dataclass

import drjit as dr

__all__ = ["FILTERS", "RANGE_FACTOR", "Table", "build", "fetch_level", "level"]

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


def _least(depths, start, end):
    a, b, c, d = depths
    a, b = dr.select(a < b, a, b), dr.select(c < d, c, d)
    return dr.select(a < b, a, b)


def _greatest(depths, start, end):
    a, b, c, d = depths
    a, b = dr.select(a > b, a, b), dr.select(c > d, c, d)
    return dr.select(a > b, a, b)


def _mean(depths, start, end):
    """Of the surfaces; background only where all four are."""
    total, count = 0, 0
    for z in depths:
        surface = dr.isfinite(z)
        total = total + dr.select(surface, z, 0)
        count = count + dr.select(surface, type(z)(1), 0)
    return dr.select(count > 0, total / dr.select(count > 0, count, 1), dr.inf)


def _weighted(depths, start, end):
    """About the farthest: a depth counts in full up to ``start`` in front of it, and nothing from ``end`` on."""
    far = _greatest(depths, start, end)
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


FILTERS = {"weighted": _weighted, "min": _least, "max": _greatest, "average": _mean}


def build(view_z, table: Table, name, start, end, types):
    """All levels, flat, one after the other.

    Args:
        view_z: flat depth of ``table.widths[0]`` x ``table.heights[0]`` pixels, inf on the background.
        name: what a texel makes of its four of the level before, a key of ``FILTERS``: the "weighted" mean about the
            farthest of them, "min", "max" or "average".
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
        levels.append(FILTERS[name](depths, start, end))
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
    offset = UInt(0)
    for i in range(1, table.n_levels):
        offset = dr.select(k == i, table.offsets[i], offset)
    width = (UInt(table.widths[0] - 1) >> k) + 1
    index = offset + (UInt(Int(py)) >> k) * width + (UInt(Int(px)) >> k)
    return dr.gather(types.Float, buffer, dr.select(index < table.size, index, 0))
