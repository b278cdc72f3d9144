"""Multilinear interpolation of tables whose first and last texels stand for the coordinates 0 and 1."""

from typing import Any

import drjit as dr

__all__ = ["lookup"]


def lookup(values, size: tuple[int, ...], n_channels: int, unit: tuple[Any, ...]) -> list[Any]:
    """The channels of a table between its texels, linear in each coordinate.

    Exact for functions that are linear in every coordinate alone, and between the least and the largest of the 2^n
    texels around. Differentiable in the coordinates, where at a texel the derivative is that of the cell that begins
    there, and in the values.

    Args:
        values: the texels, flat: channels of a texel side by side, then texels along the first coordinate, x.
        size: texels along x, y, …; 2 or more each.
        n_channels: numbers per texel.
        unit: coordinates, x first; moved to [0, 1] where they are outside of it or NaN.
    """
    UInt = dr.uint32_array_t(type(values))
    first: Any = UInt(0)
    shares, strides, stride = [], [], n_channels
    for n, u in zip(size, unit, strict=True):
        u = dr.select(u > 0, u, 0)
        t = dr.select(u < 1, u, 1) * (n - 1)
        # A NaN fails every comparison: no texel is read beyond the table.
        i = UInt(dr.select(dr.detach(t) < n - 1, dr.detach(t), n - 2))
        first = first + i * stride
        shares.append(t - type(t)(i))
        strides.append(stride)
        stride *= n
    return [_between(values, first + c, shares, strides) for c in range(n_channels)]


def _between(values, index, shares, strides):
    """Interpolated along all axes, the last one outermost."""
    if not shares:
        return dr.gather(type(values), values, index)
    inner = shares[:-1], strides[:-1]
    low = _between(values, index, *inner)
    high = _between(values, index + strides[-1], *inner)
    return dr.fma(shares[-1], high - low, low)
