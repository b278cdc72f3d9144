"""How far a slice is marched on either side of its pixel, in pixels."""

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr

from .roots import rsqrt
from .slices import BOUNDLESS

__all__ = ["Side", "direction", "reaches", "sphere_extent"]


@dataclass(frozen=True)
class Side:
    """One side of a slice: least distance and length of its search; ``inside`` where there is any sample at all."""

    least: Any
    reach: Any
    inside: Any

    @classmethod
    def of(cls, reach, min_step_px, step_law):
        if step_law != "strata":
            return cls(min_step_px, reach, True)
        # A side whose nearest sample is off the frame has none: what its steps find is discarded.
        return cls(min_step_px, reach, reach >= min_step_px)


def direction(k, s, ux, uy):
    """Unit vector in pixels, y down, of the direction (ux, uy) in the image plane, and pixels per unit of it.

    Args:
        k, s: :class:`gtao.kernels.march_types.Switches` and :class:`gtao.kernels.march_types.Scalars`.
    """
    if k.unit_directions:
        return (ux, -uy), s.fx
    ux, uy = ux * s.fx, -uy * s.fy
    length2 = dr.fma(ux, ux, uy * uy)
    rcp = rsqrt(length2)
    return (ux * rcp, uy * rcp), length2 * rcp


def sphere_extent(k, radius, z, p):
    """Tangent of the angle under which the sphere of the search radius is seen, or its published stand-in.

    Args:
        k: :class:`gtao.kernels.march_types.Switches`.
        radius: search radius in scene units.
        z, p: view depth of the shaded point, its distance from the eye (perspective only).
    """
    if k.orthographic:
        return radius
    if k.slice_measure != "view":
        return radius / z
    outside = dr.fma(p, p, -radius * radius)
    # From inside of the sphere it is all around; the frame's border limits the search then.
    return dr.select(outside > 0, radius * rsqrt(dr.select(outside > 0, outside, 1)), BOUNDLESS)


def reaches(k, s, slice_frame, m, azimuth, length, direction, x, y):
    """Lengths of the search to -T and +T in pixels (ℓ of theory, eq. (24)): the sphere's extent, within the frame.

    Args:
        k, s: :class:`gtao.kernels.march_types.Switches` and :class:`gtao.kernels.march_types.Scalars`.
        m: what :func:`sphere_extent` returned.
        azimuth: cosine and sine of the slice's azimuth.
        length: pixels per unit of the marching direction.
        direction: the unit marching direction in pixels, y down.
        x, y: texel coordinates of the pixel.
    """
    if k.border == "shorten":
        reach0, reach1 = _to_border(k, direction, x, y)
    else:
        reach0 = reach1 = type(x)(math.inf)
    if not k.unlimited:
        e0, e1 = slice_frame.extents(m, *azimuth)
        e0, e1 = e0 * length, e1 * length
        if k.step_law == "strata":
            # A radius below one pixel still looks at the next texel: the distance cut or the falloff decides.
            least = s.min_step_px
            e0, e1 = dr.select(e0 > least, e0, least), dr.select(e1 > least, e1, least)
        reach0, reach1 = dr.select(e0 < reach0, e0, reach0), dr.select(e1 < reach1, e1, reach1)
    if k.clamp_px:
        limit = s.max_radius_px
        reach0, reach1 = dr.select(reach0 < limit, reach0, limit), dr.select(reach1 < limit, reach1, limit)
    return reach0, reach1


def _to_border(k, direction, x, y):
    """Lengths to the frame's border on both sides, in pixels."""
    dx, dy = direction
    # Texel centres lie at integers, and a sample is the texel it rounds to: stay a little inside the outermost half.
    margin = 0.499
    dx, dy = dr.select(abs(dx) > 1e-9, dx, 1e-9), dr.select(abs(dy) > 1e-9, dy, 1e-9)
    rcp = 1 / (dx * dy)
    rcp_x, rcp_y = dy * rcp, dx * rcp
    # Lengths, negative behind, to the lines that the four borders lie on.
    right, left = ((k.width - 1 + margin) - x) * rcp_x, (-margin - x) * rcp_x
    bottom, top = ((k.height - 1 + margin) - y) * rcp_y, (-margin - y) * rcp_y
    ahead_x, ahead_y = dr.select(right > left, right, left), dr.select(bottom > top, bottom, top)
    behind_x, behind_y = dr.select(right < left, right, left), dr.select(bottom < top, bottom, top)
    ahead = dr.select(ahead_x < ahead_y, ahead_x, ahead_y)
    behind = dr.select(behind_x > behind_y, behind_x, behind_y)
    return -behind, ahead
