"""Motion of a pixel beside that of what was seen at its place before."""

import drjit as dr

from .ramps import saturate

__all__ = ["motion_difference", "speed", "velocity_weight"]


def speed(motion):
    """Length of a motion (x, y), with derivative 0 at 0."""
    x, y = motion
    squared = dr.fma(x, x, y * y)
    some = squared > 0
    return dr.select(some, dr.sqrt(dr.select(some, squared, 1)), 0)


def motion_difference(motion, previous, grid):
    """Length of the difference to the previous frame's motion in the texel where a pixel was.

    Args:
        motion: (x, y) in pixels, or None where nothing moves.
        previous: two :class:`Image`, or None where nothing moved. Outside the frame it is the nearest texel's.
    """
    Float, Int = grid.types.Float, grid.types.Int
    still = Float(0), Float(0)
    if previous is None:
        return speed(still if motion is None else motion)

    def texel(own, moved, n):
        if moved is None:
            return own
        place = dr.round(Float(own) - moved)
        # 0 for NaN too.
        return Int(dr.select(place > 0, dr.select(place < n - 1, place, n - 1), 0))

    x, y = (None, None) if motion is None else motion
    index = grid.types.UInt(texel(grid.y, y, grid.height) * grid.width + texel(grid.x, x, grid.width))
    now = still if motion is None else motion
    return speed(tuple(a - grid.gather(b, index) for a, b in zip(now, previous, strict=True)))


def velocity_weight(difference, scale):
    """1 where a pixel moves as what was seen at its place before, falling to 0 at a difference of ``scale`` pixels."""
    return saturate(1 - difference / scale)
