"""The texels that one thread of a launch holds: one of a coarse level, and those of finer levels below it."""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from .layout import Table

__all__ = ["Tile"]


@dataclass(frozen=True)
class Tile:
    """A thread for each texel of level ``last``, at (x, y), which has 2 x 2 texels of the level before below it, and
    so on down to level ``first``.

    Texels of a level are lists of rows. Where a level ends in the middle of a thread's texels, those beyond are 0 and
    do not count.
    """

    table: Table
    first: int
    last: int
    types: Any
    x: Any
    y: Any

    @classmethod
    def of(cls, table: Table, first, last, types):
        columns = table.stride >> last
        thread = dr.arange(types.UInt, columns * table.heights[last])
        y = thread // columns
        return cls(table, first, last, types, thread - y * columns, y)

    def side(self, level):
        """A thread holds this many rows of this many texels of a level."""
        return 1 << (self.last - level)

    def read(self, source, level, stride, offset=0):
        """The texels of a level from rows of ``stride`` that begin at number ``offset`` of ``source``."""
        Piece, places = self._places(level, stride, offset)
        rows = [[dr.gather(Piece, source, place, active) for place, active in row] for row in places]
        return [row if Piece is self.types.Float else list(row[0]) for row in rows]

    def write(self, target, texels, level, stride, offset=0):
        """Put texels where :meth:`read` finds them."""
        Piece, places = self._places(level, stride, offset)
        for row, values in zip(places, texels, strict=True):
            pieces = values if Piece is self.types.Float else [Piece(*values)]
            for (place, active), piece in zip(row, pieces, strict=True):
                # Threads write to places of their own: with that known, all goes into one launch.
                dr.scatter(target, piece, place, active, mode=dr.ReduceMode.NoConflicts)

    def closed(self, texels, level):
        """Where the last column or row of a level has no neighbour to be filtered with, it is its own."""
        side, table = self.side(level), self.table
        texels = [list(row) for row in texels]
        for i in range(1, side, 2):
            if table.widths[level] & 1:
                there = self.x * side + i < table.widths[level]
                for row in texels:
                    row[i] = dr.select(there, row[i], row[i - 1])
            if table.heights[level] & 1:
                there = self.y * side + i < table.heights[level]
                texels[i] = [dr.select(there, z, above) for z, above in zip(texels[i], texels[i - 1], strict=True)]
        return texels

    def _places(self, level, stride, offset):
        """Type of the pieces that a row of texels comes in, and for each row their numbers and masks.

        Where rows are aligned to it, a row is one piece: its texels are then loaded and stored together, which takes a
        quarter of the time that as many gathers and scatters do.
        """
        side, table = self.side(level), self.table
        n = side if stride % side == 0 and offset % side == 0 else 1
        Piece = self.types.Float if n == 1 else dr.replace_shape_t(self.types.Float, (n, -1))
        cut = stride != table.stride >> level, table.heights[self.last] * side != table.heights[level]
        rows = []
        for j in range(side):
            y = self.y * side + j
            below = y < table.heights[level] if cut[1] else True
            columns = (self.x * (side // n) + i for i in range(side // n))
            row = y * (stride // n) + offset // n
            rows.append([(row + x, below & (x < stride // n) if cut[0] else below) for x in columns])
        return Piece, rows
