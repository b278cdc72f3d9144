"""A filter that stays on the surface: weights by the distance of neighbours from each other's tangent planes."""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from .footprint import footprint
from .grid import Tap

__all__ = ["View", "plane_taps"]


@dataclass(frozen=True)
class View:
    """From texel coordinates and depth to positions; kernel inputs of width one."""

    ax: Any  # image-plane coordinate of texel column i: ax i + bx
    bx: Any
    ay: Any
    by: Any
    pixel: Any  # width of a pixel on the image plane
    orthographic: bool

    def position(self, x, y, z):
        """Point in the view frame behind texel (x, y), floats, at depth z."""
        X, Y = dr.fma(x, self.ax, self.bx), dr.fma(y, self.ay, self.by)
        return (X, Y, -z) if self.orthographic else (X * z, Y * z, -z)


def plane_taps(view_z, normal, size, tolerance, view: View, grid, odd_frame=False):
    """Taps by distance from the tangent planes; theory, the plane-aware filter.

    Args:
        view_z: :class:`Image` of flat depth, inf on the background.
        normal: three of them, the components of unit normals in the view frame.
        size: of the footprint, in texels.
        tolerance: distance from a plane, in pixel widths at that depth, from which a tap counts nothing.
        odd_frame: which of the two footprints of an even size; see :func:`footprint`.

    Returns:
        The taps, the pixel itself not among them (its weight is 1).
    """
    Float = grid.types.Float
    x, y = Float(grid.x), Float(grid.y)
    centre = dr.select(dr.isfinite(view_z.own), view_z.own, 1)
    P = view.position(x, y, centre)
    scale = 1 / (tolerance * view.pixel)
    taps = []
    along = footprint(size, odd_frame)
    for dy, wy in along:
        for dx, wx in along:
            if dx == 0 and dy == 0:
                continue
            index, there = grid.inside(dx, dy)
            z = grid.gather(view_z, index)
            there &= dr.isfinite(z)
            z = dr.select(there, z, centre)
            D = tuple(a - b for a, b in zip(view.position(x + dx, y + dy, z), P, strict=True))
            N = tuple(grid.gather(n, index) for n in normal)
            off, back = abs(_dot(tuple(n.own for n in normal), D)), abs(_dot(N, D))
            far = dr.select(off > back, off, back)
            # The mean depth of the two, so that both give each other the same weight.
            width = scale if view.orthographic else scale / (0.5 * (z + centre))
            weight = dr.fma(-far, width, 1)
            weight = dr.select(there & (weight > 0), wx * wy * weight, 0)
            taps.append(Tap(index, dx, dy, weight))
    return taps


def _dot(a, b):
    return dr.fma(a[0], b[0], dr.fma(a[1], b[1], a[2] * b[2]))
