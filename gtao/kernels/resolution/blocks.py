"""A block of pixels that one pixel of a smaller frame stands for."""

from dataclasses import dataclass
from typing import Any

import drjit as dr

__all__ = ["Blocks", "at_centre"]

# Seen edge-on a tangent plane says nothing of a block's centre: it may double or halve the depth there, or in parallel
# projection rise this many times as far as it is away.
RATIO, SLOPE = 2.0, 1e3


@dataclass(frozen=True)
class Blocks:
    """Blocks of ``factor`` × ``factor`` pixels of a frame, one lane each, row by row; those at the end are smaller."""

    width: int
    height: int
    factor: int
    x: Any
    y: Any
    types: Any

    @classmethod
    def of(cls, width, height, factor, types):
        columns, rows = -(-width // factor), -(-height // factor)
        index = dr.arange(types.UInt, columns * rows)
        y = index // columns
        return cls(width, height, factor, index - y * columns, y, types)

    def pixel(self, i, j):
        """Flat index of the pixel (i, j) of every block, or of the nearest one in the frame."""
        x, y = self.x * self.factor + i, self.y * self.factor + j
        x, y = dr.select(x < self.width, x, self.width - 1), dr.select(y < self.height, y, self.height - 1)
        return y * self.width + x

    def centre(self):
        """Coordinates of the blocks' centres; whole numbers are centres of pixels."""
        half = 0.5 * (self.factor - 1)
        Float = self.types.Float
        return dr.fma(Float(self.x), self.factor, half), dr.fma(Float(self.y), self.factor, half)

    def whole(self):
        """Whether a block has all of its pixels."""
        right, low = (self.x + 1) * self.factor, (self.y + 1) * self.factor
        return (right <= self.width) & (low <= self.height)

    def chosen(self, view_z, choice):
        """Flat indices of the pixel that stands for every block, of its nearest and of its farthest surface.

        Theory, smaller frames. Where a block holds nothing but background they are background.

        Args:
            view_z: flat depth, inf on the background.
            choice: "nearest", "farthest", "checkerboard" or "first".
        """
        Float, view_z = self.types.Float, dr.detach(view_z)
        first = near = far = self.pixel(0, 0)
        least, most, found = Float(dr.inf), Float(0), self.types.Bool(False)
        for j in range(self.factor):
            for i in range(self.factor):
                index = self.pixel(i, j)
                z = dr.gather(Float, view_z, index)
                there = dr.isfinite(z)
                first, found = dr.select(there & ~found, index, first), found | there
                nearer, farther = z < least, there & (z > most)
                near, least = dr.select(nearer, index, near), dr.select(nearer, z, least)
                far, most = dr.select(farther, index, far), dr.select(farther, z, most)
        even = ((self.x + self.y) & 1) == 0
        choices = {"nearest": near, "farthest": far, "checkerboard": dr.select(even, near, far), "first": first}
        return choices[choice], near, far


def at_centre(z, normal, index, blocks, bounds, view):
    """Depth of the tangent plane of the pixels ``index`` at the blocks' centres; theory, eq. (183).

    Args:
        z: depth of the pixel, inf on the background, which stays.
        normal: three flat arrays, of any length. Where one faces away, or its plane is seen edge-on, the depth stays.
        blocks: :class:`Blocks`.
        bounds: least and largest depth of the blocks' surfaces, which those of whole ones do not leave.
        view: :class:`gtao.kernels.filters.View` of the frame.
    """
    Float, row = blocks.types.Float, index // blocks.width
    x, y = Float(index - row * blocks.width), Float(row)
    centre = blocks.centre()
    dX, dY = (centre[0] - x) * view.ax, (centre[1] - y) * view.ay
    nx, ny, nz = normal
    surface = dr.isfinite(z)
    here = dr.select(surface, z, 1)
    across = dr.fma(nx, dX, ny * dY)
    if view.orthographic:
        facing = -nz
        there = here - across / dr.select(facing < 0, facing, -1)
        sound = (facing < 0) & (dr.square(SLOPE * nz) > dr.fma(nx, nx, ny * ny)) & (there > 0)
    else:
        facing = dr.fma(nx, dr.fma(x, view.ax, view.bx), dr.fma(ny, dr.fma(y, view.ay, view.by), -nz))
        share = 1 + across / dr.select(facing < 0, facing, -1)
        sound = (facing < 0) & (share < RATIO) & (RATIO * share > 1)
        there = here / dr.select(sound, share, 1)
    (least, most), whole = bounds, blocks.whole()
    # The centre of a whole block lies between its pixels, and so does its depth.
    there = dr.select(whole & (there < least), least, dr.select(whole & (there > most), most, there))
    return dr.select(surface & sound, there, z)
