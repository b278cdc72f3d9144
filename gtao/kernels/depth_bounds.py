"""A pyramid of bounds on a depth buffer: where a ray passes in front of a whole block of texels, it skips the block.

Level 0 holds the largest w (see :mod:`gtao.kernels.depth_cells`) of every cell, each further level the largest of two
by two. The pyramid is one flat buffer, the single node of the coarsest level first; below it the level of 2ʲ x 2ʲ nodes
begins at (4ʲ - 1)/3.
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr

__all__ = ["Bounds", "pyramid"]


@dataclass(frozen=True)
class Bounds:
    """The buffer; ``depth`` levels lie above level 0."""

    buffer: Any
    depth: int
    types: Any

    def at(self, x, y, level):
        """Largest w in the node of ``level`` that holds the cell (x, y), or the nearest cell where that is outside."""
        T = self.types
        last = (1 << self.depth) - 1
        x, y = (T.UInt(dr.select(c < 0, 0, dr.select(c > last, last, c))) >> level for c in (x, y))
        power = self.depth - level
        offset = ((T.UInt(1) << (2 * power)) - 1) & 0x55555555
        return dr.gather(T.Float, self.buffer, offset + (y << power) + x)


def pyramid(cells) -> Bounds:
    """Bounds of :class:`gtao.kernels.depth_cells.DepthCells`, evaluated."""
    T = cells.types
    depth = (max(cells.width, cells.height, 2) - 2).bit_length()
    bounds = cells.bounds()
    dr.eval(bounds)
    # Cells beyond the frame repeat the last of their row or column: they are never higher than what is there.
    index = dr.arange(T.UInt, 1 << (2 * depth))
    y = index >> depth
    x = index - (y << depth)
    last_x, last_y = cells.width - 1, cells.height - 1
    x, y = dr.select(x < last_x, x, last_x), dr.select(y < last_y, y, last_y)
    levels = [dr.gather(T.Float, bounds, y * cells.width + x)]
    dr.eval(levels)
    for power in reversed(range(depth)):
        # An opaque shift lets all levels share one kernel.
        shift = dr.opaque(T.UInt, power)
        index = dr.arange(T.UInt, 1 << (2 * power))
        y = index >> shift
        x = index - (y << shift)
        corner = (y << (shift + 2)) + (x << 1)
        top = dr.gather(T.Float, levels[0], corner)
        row = T.UInt(2) << shift
        for step in (1, row, row + 1):
            other = dr.gather(T.Float, levels[0], corner + step)
            top = dr.select(other > top, other, top)
        dr.eval(top)
        levels.insert(0, top)
    buffer = levels[0] if depth == 0 else dr.concat(levels)
    dr.eval(buffer)
    return Bounds(buffer, depth, T)
