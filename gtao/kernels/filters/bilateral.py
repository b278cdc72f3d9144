"""The 4×4 bilateral filter of the slides of Jimenez et al. (2016), with their gradient thresholds."""

import drjit as dr

from .footprint import footprint
from .grid import Tap

__all__ = ["bilateral_taps", "ramp"]

# Texels along each axis, one period of the slides' noise pattern.
SIZE = 4


def ramp(z, predicted, scale):
    """1 where a depth is as predicted, falling linearly to 0 at a difference of 1 / ``scale``."""
    weight = 1 - abs(z - predicted) * scale
    return dr.select(weight > 0, weight, 0)


def bilateral_taps(view_z, threshold, derivatives, grid, odd_frame=False, inverse=False):
    """Taps of the 4×4 filter; theory, the bilateral filter.

    Args:
        view_z: :class:`Image` of flat depth, inf on the background.
        threshold: difference to the predicted depth, as a share of the pixel's depth, from which a tap counts nothing.
        derivatives: how many derivatives of depth the prediction uses, 0 to 2.
        odd_frame: which of the two footprints; see :func:`footprint`.
        inverse: predict the reciprocal of depth, which is linear on planes in perspective.
    """
    centre = dr.select(dr.isfinite(view_z.own), view_z.own, 1)
    scale = 1 / (threshold * centre)
    even = _reciprocal if inverse else _itself
    along_x, along_y = (_derivatives(view_z, centre, axis, derivatives, even, grid) for axis in ((1, 0), (0, 1)))
    taps = []
    offsets = [d for d, _ in footprint(SIZE, odd_frame)]
    for dy in offsets:
        for dx in offsets:
            if dx == 0 and dy == 0:
                continue
            index, there = grid.inside(dx, dy)
            z = grid.gather(view_z, index)
            there &= dr.isfinite(z)
            # Either is its own inverse. Beyond the horizon of a plane the result is negative, which no depth is near.
            predicted = even(even(centre) + _taylor(along_x, dx) + _taylor(along_y, dy))
            weight = ramp(dr.select(there, z, centre), predicted, scale)
            taps.append(Tap(index, dx, dy, dr.select(there, weight, 0)))
    return taps


def _itself(z):
    return z


def _reciprocal(z):
    return 1 / z


def _taylor(derivatives, d):
    first, second = derivatives
    return dr.fma(second, 0.5 * d * d, first * d)


def _derivatives(view_z, centre, axis, order, even, grid):
    """First and second derivative of a function of depth along an axis, per texel, from the side where it changes less.

    The second difference is the smaller of the two that contain the step to that side: neither reaches across a depth
    edge that the other avoids.
    """
    zero = centre * 0
    if order == 0:
        return zero, zero

    def step(k):
        """The value at k texels along the axis less the centre's, and whether there is a surface."""
        index, there = grid.inside(k * axis[0], k * axis[1])
        z = grid.gather(view_z, index)
        there &= dr.isfinite(z)
        return even(dr.select(there, z, centre)) - even(centre), there

    (ahead, has_ahead), (behind, has_behind) = step(1), step(-1)
    forward = has_ahead & (~has_behind | (abs(ahead) <= abs(behind)))
    first = dr.select(forward, ahead, -behind)
    if order == 1:
        return first, zero
    (ahead2, has_ahead2), (behind2, has_behind2) = step(2), step(-2)
    middle = dr.select(has_ahead & has_behind, ahead + behind, dr.inf)
    outer = dr.select(forward, ahead2 - 2 * ahead, behind2 - 2 * behind)
    outer = dr.select(dr.select(forward, has_ahead & has_ahead2, has_behind & has_behind2), outer, dr.inf)
    second = dr.select(abs(middle) <= abs(outer), middle, outer)
    second = dr.select(dr.isfinite(second), second, 0)
    # Through the two points a parabola of this curvature passes: one-sided differences hold half of it.
    return first - dr.select(forward, 0.5, -0.5) * second, second
