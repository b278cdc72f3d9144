"""The weights with which a spatial filter averages the neighbours of one pixel."""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from gtao.config import EdgeAwareFilter, SpatialFilter
from gtao.gbuffer import GBuffer

from .denoise import filtered
from .estimate import check_frame, check_frame_index
from .inspect_slices import check_pixel

__all__ = ["FilterWeights", "filter_weights"]

# Neighbours whose weights are found in one go: each is an image of the frame's size.
TOGETHER = 8


@dataclass(frozen=True, kw_only=True)
class FilterWeights:
    """Weights of one pixel.

    Attributes:
        x, y: column and row of the pixel.
        weights: (k, k) nested tuples, rows from top to bottom, k odd, the pixel itself in the middle: the filtered
            value is the sum of these times the neighbours' values. They sum to 1; a linear fit has negative ones too.
            0 off the frame and beyond the footprint: of an even one a row and a column are 0.
        spatial: the filter.
        frame_index: number of the frame.
    """

    x: int
    y: int
    weights: tuple[tuple[float, ...], ...]
    spatial: Any
    frame_index: int


def filter_weights(g: GBuffer, spatial: Any, x: int, y: int, *, frame_index: int = 0) -> FilterWeights:
    """What :func:`gtao.denoise` multiplies the neighbours of column ``x`` and row ``y`` by.

    Filters are linear in the image, so a weight is what the filter makes at the pixel of an image that is 1 at the
    neighbour and 0 elsewhere; that is how they are found, several passes included.

    Args:
        g: the frame.
        spatial: a :class:`gtao.EdgeAwareFilter`, :class:`gtao.SpatialFilter` or :class:`gtao.PlaneAwareFilter`.
        x, y: column and row, from 0; the pixel must show a surface.
        frame_index: number of the frame; see :func:`gtao.denoise`.

    Raises:
        ConfigError: ``spatial`` is no filter, ``g`` no frame, the pixel lies off the frame or shows the background, or
            ``frame_index`` is negative.
    """
    check_frame(g)
    check_frame_index(frame_index)
    check_pixel(g, x, y)
    (height, width), T = g.shape, g.types
    offsets = range(-_reach(spatial), _reach(spatial) + 1)
    around = [(x + dx, y + dy) for dy in offsets for dx in offsets]
    inside = [(u, v) for u, v in around if 0 <= u < width and 0 <= v < height]
    index, found = dr.arange(T.UInt, width * height), {}
    with dr.suspend_grad():
        for first in range(0, len(inside), TOGETHER):
            some = inside[first : first + TOGETHER]
            # The last ones come in company too, so that one kernel serves all.
            places = [dr.opaque(T.UInt, v * width + u) for u, v in (some * TOGETHER)[:TOGETHER]]
            impulses = tuple(dr.select(index == place, T.Float(1), 0) for place in places)
            images = filtered(impulses, g, spatial, frame_index)
            found |= {place: float(image[y * width + x]) for place, image in zip(some, images, strict=False)}
    rows = [tuple(found.get((x + dx, y + dy), 0.0) for dx in offsets) for dy in offsets]
    return FilterWeights(x=int(x), y=int(y), weights=tuple(rows), spatial=spatial, frame_index=int(frame_index))


def _reach(spatial: Any) -> int:
    """Texels from a pixel to the farthest that it is averaged with."""
    if isinstance(spatial, EdgeAwareFilter):
        return spatial.passes
    return 2 if isinstance(spatial, SpatialFilter) else getattr(spatial, "size", 0) // 2
