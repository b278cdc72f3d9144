"""The texels of a small frame around every pixel of a larger one of the same view."""

from dataclasses import dataclass
from typing import Any

import drjit as dr

__all__ = ["Cells", "Texel", "mean"]


@dataclass(frozen=True)
class Texel:
    """A texel near every pixel: flat index, coordinates as floats, and its bilinear weight where it has one."""

    index: Any
    x: Any
    y: Any
    share: Any


@dataclass(frozen=True)
class Cells:
    """Pixels of the larger frame, one lane each, and where they lie between the centres of four texels.

    ``x`` and ``y`` are a pixel's coordinates as floats, ``x0`` and ``y0`` those of the texel before it, whole and maybe
    -1; ``u`` and ``v`` in [0, 1) say how far it lies on toward the next one.
    """

    width: int
    height: int
    x: Any
    y: Any
    x0: Any
    y0: Any
    u: Any
    v: Any
    types: Any

    @classmethod
    def of(cls, shape, small, scale, offset, types):
        """
        Args:
            shape: (height, width) of the larger frame.
            small: that of the smaller one.
            scale, offset: pairs, from continuous coordinates of the larger frame to those of the smaller one; kernel
                inputs of width one.
        """
        height, width = shape
        index = dr.arange(types.UInt, width * height)
        row = index // width
        x, y = types.Float(index - row * width), types.Float(row)
        s, t = (dr.fma(p + 0.5, k, o) - 0.5 for p, k, o in zip((x, y), scale, offset, strict=True))
        x0, y0 = dr.floor(s), dr.floor(t)
        return cls(small[1], small[0], x, y, x0, y0, s - x0, t - y0, types)

    def texel(self, i, j, share=None):
        """The texel i columns and j rows from the one before the pixel, or the nearest one in the small frame."""
        UInt = self.types.UInt
        x, y = _within(self.x0 + i, self.width), _within(self.y0 + j, self.height)
        return Texel(UInt(y) * self.width + UInt(x), x, y, share)

    def nearest(self):
        """The four texels around the pixel; their bilinear weights sum to 1."""
        along_x, along_y = (1 - self.u, self.u), (1 - self.v, self.v)
        return [self.texel(i, j, along_x[i] * along_y[j]) for j in (0, 1) for i in (0, 1)]


def _within(x, n):
    return dr.select(x > 0, dr.select(x < n - 1, x, n - 1), 0)


def mean(weights, texels, channels, otherwise, types):
    """Σ w v / Σ w for each channel; ``otherwise`` where there is no weight.

    Args:
        channels: flat arrays of the small frame.
        otherwise: one number per channel.
    """
    total, sums = types.Float(0), [types.Float(0)] * len(channels)
    for weight, texel in zip(weights, texels, strict=True):
        # Whatever stands where there is no surface is not read, be it NaN.
        values = [dr.gather(types.Float, c, texel.index, weight > 0) for c in channels]
        total, sums = total + weight, [dr.fma(weight, v, s) for v, s in zip(values, sums, strict=True)]
    there = total > 0
    rcp = 1 / dr.select(there, total, 1)
    return tuple(dr.select(there, s * rcp, o) for s, o in zip(sums, otherwise, strict=True))
