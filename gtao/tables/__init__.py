"""Tables of specular occlusion: made by quadrature, with their errors."""

from .bake import bake
from .brdf import Quadrature, cone_shares, cone_terms, hemisphere_terms

__all__ = ["Quadrature", "bake", "cone_shares", "cone_terms", "hemisphere_terms"]
