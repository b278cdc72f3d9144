"""How far a slice is marched on either side of its pixel, in pixels."""

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr

from .slices import BOUNDLESS

__all__ = ["Side", "reaches", "sphere_extent"]


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
        # A side whose nearest sample is off the frame has none: its steps stay on the pixel and are discarded.
        inside = reach >= min_step_px
        return cls(dr.select(inside, min_step_px, 0), dr.select(inside, reach, 0), inside)


def sphere_extent(k, radius, z, p):
    """Tangent of the angle under which the sphere of the search radius is seen, or its published stand-in.

    Args:
        k: :class:`gtao.kernels.march.Switches`.
        radius: search radius in scene units.
        z, p: view depth of the shaded point, its distance from the eye (perspective only).
    """
    if k.orthographic:
        return radius
    if k.slice_measure != "view":
        return radius / z
    outside = dr.fma(p, p, -radius * radius)
    # From inside of the sphere it is all around; the frame's border limits the search then.
    return dr.select(outside > 0, radius * dr.rsqrt(dr.select(outside > 0, outside, 1)), BOUNDLESS)


def reaches(k, s, slice_frame, m, azimuth, length, direction, x, y):
    """Lengths of the search to -T and +T in pixels (ℓ of theory, eq. (24)): the sphere's extent, within the frame.

    Args:
        k, s: :class:`gtao.kernels.march.Switches` and :class:`gtao.kernels.march.Scalars`.
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
    rcp_x, rcp_y = 1 / dr.select(abs(dx) > 1e-9, abs(dx), 1e-9), 1 / dr.select(abs(dy) > 1e-9, abs(dy), 1e-9)
    far_x, far_y = (k.width - 1 + margin) - x, (k.height - 1 + margin) - y
    near_x, near_y = x + margin, y + margin
    right, down = dx > 0, dy > 0
    bx, by = dr.select(right, far_x, near_x) * rcp_x, dr.select(down, far_y, near_y) * rcp_y
    reach1 = dr.select(bx < by, bx, by)
    bx, by = dr.select(right, near_x, far_x) * rcp_x, dr.select(down, near_y, far_y) * rcp_y
    reach0 = dr.select(bx < by, bx, by)
    return reach0, reach1
