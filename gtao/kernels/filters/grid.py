"""Neighbours of every pixel of an image."""

from dataclasses import dataclass
from typing import Any

import drjit as dr

__all__ = ["Grid", "Image", "Tap"]


@dataclass(frozen=True)
class Image:
    """Values of every pixel: as its own, and as its neighbours read them.

    The two hold the same values. Where gradients flow they are two variables: reverse mode adds to the gradient of the
    one and scatters into that of the other, and every change between the two would launch a kernel.
    """

    own: Any
    around: Any


@dataclass(frozen=True)
class Tap:
    """One neighbour of every pixel: its flat index, its offset in texels, and the weight that it gets."""

    index: Any
    dx: int
    dy: int
    weight: Any


@dataclass(frozen=True)
class Grid:
    """Texel coordinates of an image of ``width`` x ``height``, one lane per pixel, row by row."""

    width: int
    height: int
    x: Any
    y: Any
    types: Any

    @classmethod
    def of(cls, width, height, types):
        index = dr.arange(types.UInt, width * height)
        y = index // width
        return cls(width, height, types.Int(index - y * width), types.Int(y), types)

    def clamped(self, dx, dy):
        """Index of the neighbour at (dx, dy), or of the nearest pixel to it inside the image."""
        i, j = self.x + dx, self.y + dy
        i = dr.select(i < 0, 0, dr.select(i > self.width - 1, self.width - 1, i))
        j = dr.select(j < 0, 0, dr.select(j > self.height - 1, self.height - 1, j))
        return self.types.UInt(j * self.width + i)

    def inside(self, dx, dy):
        """Index of the neighbour at (dx, dy) and whether there is one; the index is valid either way."""
        i, j = self.x + dx, self.y + dy
        there = (i >= 0) & (i < self.width) & (j >= 0) & (j < self.height)
        return self.types.UInt(dr.select(there, j * self.width + i, 0)), there

    def gather(self, image: Image, index):
        """Values of the neighbours ``index``."""
        return dr.gather(self.types.Float, image.around, index)
