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
        """Coordinates of the pixel (i, j) of every block, or of the nearest one in the frame."""
        x, y = self.x * self.factor + i, self.y * self.factor + j
        return dr.select(x < self.width, x, self.width - 1), dr.select(y < self.height, y, self.height - 1)

    def centre(self):
        """Coordinates of the blocks' centres; whole numbers are centres of pixels."""
        half = 0.5 * (self.factor - 1)
        Float = self.types.Float
        return dr.fma(Float(self.x), self.factor, half), dr.fma(Float(self.y), self.factor, half)

    def chosen(self, view_z, choice):
        """Coordinates of the pixel that stands for every block; theory, smaller frames.

        Args:
            view_z: flat depth, inf on the background, which is chosen where a block holds nothing else.
            choice: "nearest", "farthest", "checkerboard" or "first".
        """
        Float, UInt = self.types.Float, self.types.UInt
        view_z = dr.detach(view_z)
        # What is least of all decides.
        sign = {"nearest": 1.0, "farthest": -1.0, "first": 0.0}.get(choice)
        if sign is None:
            sign = dr.select(((self.x + self.y) & 1) == 0, Float(1), -1)
        x, y = self.pixel(0, 0)
        least = Float(dr.inf)
        for j in range(self.factor):
            for i in range(self.factor):
                u, v = self.pixel(i, j)
                z = dr.gather(Float, view_z, self.index(u, v))
                key = dr.select(dr.isfinite(z), sign * dr.select(dr.isfinite(z), z, 0), dr.inf)
                better = key < least
                least = dr.select(better, key, least)
                x, y = dr.select(better, u, x), dr.select(better, v, y)
        return UInt(x), UInt(y)

    def index(self, x, y):
        """Flat index of a pixel."""
        return y * self.width + x


def at_centre(z, normal, x, y, centre, view):
    """Depth of the tangent plane of the pixels (x, y) at the blocks' ``centre``; theory, eq. (183).

    Args:
        z: depth of the pixel, inf on the background, which stays.
        normal: three flat arrays, of any length. Where one faces away, or its plane is seen edge-on, the depth stays.
        x, y: floats.
        view: :class:`gtao.kernels.filters.View` of the frame.
    """
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
    return dr.select(surface & sound, there, z)
