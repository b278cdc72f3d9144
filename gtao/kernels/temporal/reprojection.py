"""Where a pixel was in the previous frame, and which of the four texels around that place show its surface."""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from .ramps import saturate
from .turning import turned_vector

__all__ = ["Crease", "HistoryTap", "Prediction", "depth_weight", "history_taps", "predicted"]


@dataclass(frozen=True)
class HistoryTap:
    """One texel of the previous frame: its flat index, its share β of the interpolation and how far it is trusted."""

    index: Any  # valid even where the tap counts nothing
    bilinear: Any
    weight: Any  # in [0, 1]; 0 outside the frame, on the background and where nothing was kept


@dataclass(frozen=True)
class Prediction:
    """Surfaces in the previous frame: depth where pixels were, and the slopes of what is affine in the image."""

    view_z: Any
    along_x: Any  # per texel, of 1/z or, in parallel projection, of z
    along_y: Any
    orthographic: bool

    def excess(self, dx, dy, z):
        """How much farther than z the surface lies at an offset in texels, as a share of its depth.

        Exactly 0 where it lies at z and there is no offset.
        """
        step, rest = dr.fma(dx, self.along_x, dy * self.along_y), (self.view_z - z) / self.view_z
        return rest + step / self.view_z if self.orthographic else dr.fma(-z, step, rest)


def predicted(view_z, change, slopes, orthographic, grid):
    """The surface of every pixel in the previous frame.

    Args:
        view_z: :class:`Image` of flat depth, inf on the background.
        change: of depth from the previous frame to this one.
        slopes: whether depth changes around the pixel as it does in this frame, on the side where it changes less.
    """
    centre = dr.select(dr.isfinite(view_z.own), view_z.own, 1)

    def affine(z):
        return z if orthographic else 1 / z

    def slope(dx, dy):
        def step(sign):
            index, there = grid.inside(sign * dx, sign * dy)
            z = grid.gather(view_z, index)
            there &= dr.isfinite(z)
            return affine(dr.select(there, z, centre)) - affine(centre), there

        (ahead, has_ahead), (behind, has_behind) = step(1), step(-1)
        forward = has_ahead & (~has_behind | (abs(ahead) <= abs(behind)))
        return dr.select(forward, ahead, -behind)

    along = (slope(1, 0), slope(0, 1)) if slopes else (centre * 0,) * 2
    return Prediction(centre - change, *along, orthographic)


def depth_weight(excess, nearer, farther):
    """1 where history lies at the depth of the surface, falling linearly; theory, eq. (177).

    Args:
        excess: how much farther than the history the surface lies, as a share of its depth.
        nearer: slope of the weight where history is nearer: the surface was hidden.
        farther: where history is farther: the surface has come.
    """
    weight = 1 - dr.select(excess > 0, excess * nearer, excess * -farther)
    return dr.select(weight > 0, weight, 0)


@dataclass(frozen=True)
class Crease:
    """Normals of both frames in one view frame, and the weight's slope by the cosine of the angle between them."""

    normal: Any  # x, y and z, flat
    previous: Any  # three Image
    rows: Any  # of the rotation from the previous view frame to this one, or None
    slope: Any

    def weight(self, index, grid):
        """1 where normals agree, falling linearly with the cosine; theory, eq. (192)."""
        found = tuple(grid.gather(n, index) for n in self.previous)
        if self.rows is not None:
            found = turned_vector(found, self.rows)
        n = self.normal
        cosine = dr.fma(n[0], found[0], dr.fma(n[1], found[1], n[2] * found[2]))
        return saturate(1 - (1 - cosine) * self.slope)


def history_taps(motion, surface, previous_z, count, nearer, farther, grid, crease=None):
    """Taps of the interpolation where the pixel was; one of them where nothing moves.

    Args:
        motion: (x, y) in texels from the previous frame, or None where nothing moves.
        surface: :class:`Prediction`.
        previous_z: :class:`Image` of the previous frame's depth, inf on the background.
        count: :class:`Image` of how many frames texels hold, 0 where none.
        nearer, farther: of :func:`depth_weight`.
        crease: :class:`Crease`, or None to look at no normals.
    """
    Float, Int, UInt = grid.types.Float, grid.types.Int, grid.types.UInt
    width, height = grid.width, grid.height

    def tap(x, y, bilinear, dx, dy, inside):
        index = UInt(dr.select(inside, y * width + x, 0))
        z = grid.gather(previous_z, index)
        inside = inside & dr.isfinite(z) & (grid.gather(count, index) > 0)
        weight = depth_weight(surface.excess(dx, dy, dr.select(inside, z, 1)), nearer, farther)
        if crease is not None:
            weight = weight * crease.weight(index, grid)
        return HistoryTap(index, bilinear, dr.select(inside, weight, 0))

    if motion is None:
        return [tap(grid.x, grid.y, Float(1), Float(0), Float(0), grid.types.Bool(True))]
    x, y = Float(grid.x) - motion[0], Float(grid.y) - motion[1]
    x0, y0 = dr.floor(x), dr.floor(y)
    # False for NaN too. Only what is inside may become an integer.
    near = (x0 >= -1) & (x0 < width) & (y0 >= -1) & (y0 < height)
    u, v = dr.select(near, x - x0, 0), dr.select(near, y - y0, 0)
    x0, y0 = Int(dr.select(near, x0, -2)), Int(dr.select(near, y0, -2))
    taps = []
    for j in (0, 1):
        for i in (0, 1):
            bilinear = (u if i else 1 - u) * (v if j else 1 - v)
            inside = near & (x0 + i >= 0) & (x0 + i < width) & (y0 + j >= 0) & (y0 + j < height)
            taps.append(tap(x0 + i, y0 + j, bilinear, i - u, j - v, inside))
    return taps
