"""Spatial filters: weighted averages of an image over a small neighbourhood, with weights from depth and normals.

A filter gives the taps of every pixel (:class:`Tap`); :func:`weighted_mean` or :func:`local_plane` makes values of
them. Background pixels are never read: their taps have weight 0.
"""

from .bilateral import bilateral_taps
from .edges import depth_edges, edge_taps
from .grid import Grid, Image, Tap
from .planes import View, plane_taps
from .smoothing import local_plane, weighted_mean

__all__ = [
    "Grid",
    "Image",
    "Tap",
    "View",
    "bilateral_taps",
    "depth_edges",
    "edge_taps",
    "local_plane",
    "plane_taps",
    "weighted_mean",
]
