"""Tables of specular occlusion: made by quadrature, with their errors."""

from .bake import bake

__all__ = ["bake"]
