"""Depth at lower resolutions: a chain of levels in one flat buffer, each half as wide and high as the one before.

Level 0 is the depth buffer itself; a texel of level k stands for 2ᵏ × 2ᵏ pixels, also where the sides are odd: the last
texel of a row then stands for fewer.
"""

from .build import build
from .filters import FILTERS, RANGE_FACTOR
from .layout import Table
from .read import bilinear_level, fetch_level, index, level

__all__ = ["FILTERS", "RANGE_FACTOR", "Table", "bilinear_level", "build", "fetch_level", "index", "level"]
