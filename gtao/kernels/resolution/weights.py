"""How much each texel of a small frame counts for a pixel of the larger one: by place, and by depth."""

import drjit as dr

__all__ = ["bilateral", "bilinear", "fourth_power", "nearest_depth"]

# Multiples of a threshold beyond which all is equally far: fourth powers stay within single precision.
FARTHEST = 1e6


def fourth_power(d):
    """d⁴ of a distance in thresholds: 1 / (1 + d⁴) is near 1 up to a half, 1/2 at one, small but never zero beyond."""
    return dr.square(dr.square(dr.select(d < FARTHEST, d, FARTHEST)))


def _depths(view_z, small_z, texels, types):
    """Depth of the pixel and the texels', and which of these are surfaces; any finite number where they are not."""
    z = dr.select(dr.isfinite(view_z), view_z, 1)
    depths = [dr.gather(types.Float, small_z, t.index) for t in texels]
    there = [dr.isfinite(d) for d in depths]
    return z, [dr.select(ok, d, z) for d, ok in zip(depths, there, strict=True)], there


def bilinear(small_z, texels, types):
    """Bilinear weights, 0 for the background.

    Args:
        small_z: flat depth of the small frame, inf on the background.
        texels: of :class:`Cells`.
    """
    return [dr.select(dr.isfinite(dr.gather(types.Float, small_z, t.index)), t.share, 0) for t in texels]


def nearest_depth(view_z, small_z, texels, threshold, types):
    """Bilinear weights where all depths agree, else 1 for the nearest in depth alone.

    Args:
        view_z, small_z: flat depths of the two frames, inf on the background.
        threshold: share of the depth.
    """
    z, depths, there = _depths(view_z, small_z, texels, types)
    agree, least = there[0], types.Float(dr.inf)
    steps = []
    for d, ok in zip(depths, there, strict=True):
        steps.append(dr.select(ok, abs(d - z), dr.inf))
        agree = agree & (steps[-1] < threshold * z)
        least = dr.select(steps[-1] < least, steps[-1], least)
    weights, free = [], types.Bool(True)
    for step, ok, t in zip(steps, there, texels, strict=True):
        nearest = free & ok & (step <= least)
        free = free & ~nearest
        weights.append(dr.select(agree, t.share, dr.select(nearest, 1, 0)))
    return weights


def bilateral(view_z, small_z, texels, threshold, types):
    """Bilinear weights times a falloff by depth; theory, eq. (184).

    Args:
        view_z, small_z: flat depths of the two frames, inf on the background.
        threshold: share of the depth.
    """
    z, depths, there = _depths(view_z, small_z, texels, types)
    scale, weights = 1 / (threshold * z), []
    for t, d, ok in zip(texels, depths, there, strict=True):
        weights.append(dr.select(ok, t.share / (1 + fourth_power(abs(d - z) * scale)), 0))
    return weights
