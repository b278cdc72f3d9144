"""Tables of specular occlusion: made by quadrature, with their errors."""

from .bake import bake, environment_brdf
from .brdf import Quadrature, cone_shares, cone_terms, hemisphere_terms
from .errors import ChannelErrors, TableErrors, errors
from .quantised import quantised

__all__ = [
    "ChannelErrors",
    "Quadrature",
    "TableErrors",
    "bake",
    "cone_shares",
    "cone_terms",
    "environment_brdf",
    "errors",
    "hemisphere_terms",
    "quantised",
]
