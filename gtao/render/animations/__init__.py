"""Embedded animations: scenes in motion made by functions, no files needed.

Every animation is a function ``name(width=128, height=128, *, reflectance=0.5) -> Animation`` whose result goes to
:func:`gtao.render.sequence`. Speeds on the image are those of 128 pixels of height; they grow with the resolution.
"""

from .cameras import cut, fast_rotation, orbit, still
from .objects import passing_object, thin_bars, waves
from .registry import AnimationInfo, build, get, names

__all__ = [
    "AnimationInfo",
    "build",
    "cut",
    "fast_rotation",
    "get",
    "names",
    "orbit",
    "passing_object",
    "still",
    "thin_bars",
    "waves",
]
