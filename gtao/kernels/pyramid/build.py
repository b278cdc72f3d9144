"""Making the levels, two per launch."""

from typing import Any

import drjit as dr

from .filters import FILTERS
from .layout import Table
from .tile import Tile

__all__ = ["build"]

# Straight code for three levels takes longer to compile than it saves.
_PER_LAUNCH = 2


def build(view_z, table: Table, name, start, end, types):
    """All levels in one buffer with the layout of ``table``; what lies between them is undefined.

    Derivatives pass through the texels and their weights, in both modes and in as many launches.

    Args:
        view_z: flat depth of ``table.width`` x ``table.height`` pixels, inf on the background.
        name: what a texel makes of its four of the level before, a key of ``FILTERS``: the "weighted" mean about the
            farthest of them, "min", "max", "average", "harmonic" (of 1/z) or "rotated_grid" (one of them).
        start, end: differences of depth for the weighted filter, 0 <= start < end; theory, the depth pyramid.
    """
    if table.n_levels == 1:
        return view_z
    chain = _Chain(table, name, types)
    if dr.grad_enabled(view_z, start, end):
        return dr.custom(_Build, view_z, start, end, chain)
    return chain.levels(view_z, start, end)


class _Chain:
    """The launches from level to level. No data class, so that Dr.Jit looks for no gradients in it."""

    def __init__(self, table: Table, name: str, types: Any):
        self.table, self.types, self.filter = table, types, FILTERS[name]
        last = table.n_levels - 1
        self.tiles = [(first, min(first + _PER_LAUNCH, last)) for first in range(0, last, _PER_LAUNCH)]

    def levels(self, view_z, start, end):
        buffer, source = dr.empty(self.types.Float, self.table.size), view_z
        for first, last in self.tiles:
            tile = Tile.of(self.table, first, last, self.types)
            texels = tile.read(source, first, self._stride(first))
            if first == 0:
                self._write(buffer, tile, 0, texels)
            coarser = self._coarser(tile, texels, start, end)
            for level, rows in enumerate(coarser, start=first + 1):
                self._write(buffer, tile, level, rows)
            # The next launch reads these from an array of their own, because it writes to the buffer.
            source = coarser[-1][0][0]
            dr.eval(source)
        return buffer

    def gradients(self, inputs, buffer, grad):
        """Gradients of ``inputs``, which are those of :meth:`levels`, from that of the buffer.

        A texel has one texel above it, so that nothing is scattered to the same place twice.
        """
        view_z, *bounds = inputs
        of_bounds, above, target = [0, 0], None, None
        for first, last in reversed(self.tiles):
            tile = Tile.of(self.table, first, last, self.types)
            texels, lanes = self._read_level(view_z, buffer, tile, first), self._lanes(bounds, tile)
            total = 0
            with dr.resume_grad():
                dr.enable_grad(texels, lanes)
                for level, rows in enumerate(self._coarser(tile, texels, *lanes), start=first + 1):
                    weights = self._read(grad, tile, level)
                    if level == last and above is not None:
                        weights[0][0] = weights[0][0] + above
                    for row, weight in zip(rows, weights, strict=True):
                        total = sum((z * w for z, w in zip(row, weight, strict=True)), total)
                dr.backward_from(total)
            result = dr.grad(texels)
            if first == 0:
                own = self._read(grad, tile, 0)
                result = [[a + b for a, b in zip(*rows, strict=True)] for rows in zip(result, own, strict=True)]
            target = dr.empty(self.types.Float, self._stride(first) * self.table.heights[first])
            tile.write(target, result, first, self._stride(first))
            of_lanes = dr.grad(lanes)
            dr.eval(target, of_lanes)
            of_bounds = [a + dr.sum(b) for a, b in zip(of_bounds, of_lanes, strict=True)]
            above = target
        return target, *of_bounds

    def tangents(self, inputs, buffer, of_inputs):
        """Tangent of the buffer from those of ``inputs``."""
        (view_z, *bounds), (tangent, *of_bounds) = inputs, of_inputs
        result = dr.zeros(self.types.Float, self.table.size)
        for first, last in self.tiles:
            tile = Tile.of(self.table, first, last, self.types)
            texels, lanes = self._read_level(view_z, buffer, tile, first), self._lanes(bounds, tile)
            of_texels = tile.read(tangent, first, self._stride(first))
            if first == 0:
                self._write(result, tile, 0, of_texels)
            with dr.resume_grad():
                dr.enable_grad(texels, lanes)
                dr.set_grad(texels, of_texels)
                dr.set_grad(lanes, of_bounds)
                coarser = self._coarser(tile, texels, *lanes)
                dr.enqueue(dr.ADMode.Forward, texels, lanes)
                # Levels that others are made of would lose theirs.
                dr.traverse(dr.ADMode.Forward, dr.ADFlag.ClearNone)
            for level, rows in enumerate(coarser, start=first + 1):
                self._write(result, tile, level, dr.grad(rows))
            tangent = dr.grad(coarser[-1][0][0])
            dr.eval(tangent)
        return result

    def _coarser(self, tile, texels, start, end):
        """The texels of every level above the first of a tile."""
        levels = []
        for level in range(tile.first + 1, tile.last + 1):
            texels, side = tile.closed(texels, level - 1), tile.side(level)
            texels = [
                [
                    self.filter(
                        (*texels[2 * j][2 * i : 2 * i + 2], *texels[2 * j + 1][2 * i : 2 * i + 2]),
                        start,
                        end,
                        tile.x * side + i,
                        tile.y * side + j,
                    )
                    for i in range(side)
                ]
                for j in range(side)
            ]
            levels.append(texels)
        return levels

    def _stride(self, level):
        """Rows of the depth buffer are not padded."""
        return self.table.stride >> level if level else self.table.width

    def _lanes(self, bounds, tile):
        """A copy for every thread, so that gradients of threads stay apart."""
        return [dr.gather(self.types.Float, bound, dr.zeros(self.types.UInt, dr.width(tile.x))) for bound in bounds]

    def _read_level(self, view_z, buffer, tile, level):
        return self._read(buffer, tile, level) if level else tile.read(view_z, 0, self.table.width)

    def _read(self, buffer, tile, level):
        return tile.read(buffer, level, self.table.stride >> level, self.table.offsets[level])

    def _write(self, buffer, tile, level, texels):
        tile.write(buffer, texels, level, self.table.stride >> level, self.table.offsets[level])


class _Build(dr.CustomOp):
    """The chain with derivatives that do not scatter."""

    def eval(self, view_z, start, end, chain):
        self.inputs, self.chain = (view_z, start, end), chain
        levels = chain.levels(view_z, start, end)
        dr.eval(levels)
        self.buffer = type(levels)(levels)
        return levels

    def backward(self):
        grads = self.chain.gradients(self.inputs, self.buffer, self.grad_out())
        for name, grad in zip(("view_z", "start", "end"), grads, strict=True):
            self.set_grad_in(name, grad)

    def forward(self):
        of_inputs = [self.grad_in(name) for name in ("view_z", "start", "end")]
        self.set_grad_out(self.chain.tangents(self.inputs, self.buffer, of_inputs))

    def name(self):
        return "depth pyramid"
