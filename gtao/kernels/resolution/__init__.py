"""From a frame to a smaller one of the same view, and from images of that one back to the size of the first."""

from .blocks import Blocks, at_centre
from .cells import Cells, Texel, mean
from .planes import Surface, plane_aware
from .weights import bilateral, bilinear, nearest_depth

__all__ = [
    "Blocks",
    "Cells",
    "Surface",
    "Texel",
    "at_centre",
    "bilateral",
    "bilinear",
    "mean",
    "nearest_depth",
    "plane_aware",
]
