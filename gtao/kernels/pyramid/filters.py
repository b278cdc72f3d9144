"""What a texel of a depth pyramid makes of the four of the level below it.

Every filter is a function of the four depths (upper left, upper right, lower left, lower right), of the two bounds of
the weighted filter and of the texel's column and row. Derivatives pass through all of them, and stay finite where
texels are background.
"""

import drjit as dr

__all__ = ["FILTERS", "RANGE_FACTOR"]

# The weighted filter tells near from far at this share of the radii of the falloff (XeGTAO).
RANGE_FACTOR = 0.75


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
        surface = z < dr.inf
        total = total + dr.select(surface, z, 0)
        count = count + dr.select(surface, type(z)(1), 0)
    return dr.select(count > 0, total / dr.select(count > 0, count, 1), dr.inf)


def _weighted(depths, start, end, x, y):
    """About the farthest: a depth counts in full up to ``start`` in front of it, and nothing from ``end`` on."""
    far = _greatest(depths, start, end, x, y)
    scale = 1 / (end - start)
    offset, total, weights = end * scale, 0, 0
    for z in depths:
        weight = dr.fma(z - far, scale, offset)
        weight = dr.select(weight > 0, dr.select(weight < 1, weight, 1), 0)
        total, weights = dr.fma(weight, z, total), weights + weight
    # The farthest itself counts in full, so that the sum is at least 1 where there is a surface.
    return dr.select(far < dr.inf, total / weights, dr.inf)


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
