"""The neighbourhood clamp: history may not leave the range of the frame around a pixel."""

import drjit as dr

from .ramps import saturate

__all__ = ["clamped", "low_passed_bounds", "moved_share"]


def low_passed_bounds(values, view_z, grid):
    """Least and largest of the means of the four 2×2 blocks that a pixel is part of.

    These are what bilinear fetches at its corners give. The background, what lies outside the frame and values that
    are not finite are left out.

    Args:
        values: :class:`Image` of the channel.
        view_z: :class:`Image` of depth, inf on the background.
    """

    def neighbour(dx, dy):
        index, there = grid.inside(dx, dy)
        value = grid.gather(values, index)
        there &= dr.isfinite(grid.gather(view_z, index)) & dr.isfinite(value)
        return dr.select(there, value, 0), dr.select(there, 1, 0)

    around = {(dx, dy): neighbour(dx, dy) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if dx or dy}
    low = high = None
    for sy in (-1, 1):
        for sx in (-1, 1):
            block = [around[sx, 0], around[0, sy], around[sx, sy]]
            mean = (values.own + sum(v for v, _ in block)) / (1 + sum(w for _, w in block))
            low = mean if low is None else dr.select(mean < low, mean, low)
            high = mean if high is None else dr.select(mean > high, mean, high)
    return low, high


def clamped(history, low, high, widening, margin=0):
    """History within [low - c w - d, high + c w + d], w = high - low; theory, eq. (179).

    Args:
        widening: c.
        margin: d.
    """
    window = dr.fma(widening, high - low, margin)
    low, high = low - window, high + window
    return dr.select(history < low, low, dr.select(history > high, high, history))


def moved_share(history, clamped, current):
    """Share of the way from the history to the current value that the clamp has moved it, in [0, 1]."""
    way = current - history
    some = way != 0
    return saturate(dr.select(some, (clamped - history) / dr.select(some, way, 1), 0))
