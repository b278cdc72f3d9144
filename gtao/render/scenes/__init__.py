"""Embedded scenes: surfaces made by functions, no files needed.

Every scene is a function ``name(width=128, height=128, *, reflectance=0.5, …) -> dict`` whose result goes to
``mitsuba.load_dict``: triangles with a two-sided diffuse BSDF of the given ``reflectance`` (grey or RGB, in [0, 1]),
a constant sky of radiance 1, a path integrator and at least two sensors, in the order of :attr:`SceneInfo.views`.
Images are ``width`` x ``height`` pixels. The world's z axis is up. The same call makes the same triangles.

A parameter out of range raises ``ConfigError``; without a usable backend they raise ``BackendError``.
"""

from .analytic import bowl, closed_box, corner, open_plane, pit, trench, v_groove, wall
from .buildings import arcade, city, cornell, corner_boxes, stairs, trenches
from .closed_forms import uniform_transport
from .machinery import machinery
from .organic import cloth, foliage, head, pile, terrain
from .registry import SceneInfo, build, get, names

__all__ = [
    "SceneInfo",
    "arcade",
    "bowl",
    "build",
    "city",
    "closed_box",
    "cloth",
    "cornell",
    "corner",
    "corner_boxes",
    "foliage",
    "get",
    "head",
    "machinery",
    "names",
    "open_plane",
    "pile",
    "pit",
    "stairs",
    "terrain",
    "trench",
    "trenches",
    "uniform_transport",
    "v_groove",
    "wall",
]
