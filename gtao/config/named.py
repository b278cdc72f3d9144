"""Methods by name, each with one radius to set: what command lines and comparisons offer."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from gtao.errors import ConfigError

from . import engines
from .bitmask import VisibilityBitmask
from .gtao import GTAO
from .hbao import HBAO
from .pipeline import Pipeline
from .recommended import recommended

__all__ = ["NAMED", "NamedMethod", "named", "with_budget"]


@dataclass(frozen=True, kw_only=True)
class NamedMethod:
    """A pipeline that only needs a radius.

    Attributes:
        name: as written on a command line.
        summary: one line for lists.
        make: pipeline for a radius in scene units.
        default_radius: in scene units, where none is given.
    """

    name: str
    summary: str
    make: Callable[[float], Pipeline]
    default_radius: float = 1.0


NAMED: dict[str, NamedMethod] = {}


def _add(name: str, summary: str, make: Callable[[float], Any], default_radius: float = 1.0) -> None:
    NAMED[name] = NamedMethod(name=name, summary=summary, make=make, default_radius=default_radius)


_add(
    "gtao",
    "the integral as defined: exact slice measure, sharp cut at the radius",
    lambda radius: Pipeline(occlusion=GTAO(radius=radius), clamp=False),
    math.inf,
)
_add(
    "published",
    "GTAO as the 2016 slides print it: one slice, image measure, linear steps, falloff",
    lambda radius: Pipeline(occlusion=GTAO.as_published(radius), clamp=False),
    200.0,
)
_add(
    "hbao",
    "HBAO (2008): uniform weighting, linear attenuation, 8 directions of 8 equal steps",
    lambda radius: Pipeline(occlusion=HBAO(radius=radius)),
)
_add(
    "bitmask",
    "visibility bitmask without thickness: GTAO's integral with several blocked arcs per slice",
    lambda radius: Pipeline(occlusion=VisibilityBitmask(radius=radius), clamp=False),
    math.inf,
)
_add(
    "recommended",
    "bitmask with thickness by continuity, 3×8, filtered: the lowest error where thin and thick things mix",
    recommended,
)
for _level, (_slices, _steps) in engines.LEVELS.items():
    _add(
        f"xegtao-{_level}",
        f"XeGTAO (2021), {_slices}×{_steps} slices and steps per side",
        partial(engines.xegtao, _level),
        0.5,
    )
_add("hdrp", "Unity HDRP at full resolution, two directions of six steps per side", engines.hdrp, 2.0)
_add("filament", "Filament's GTAO, 4×3 slices and steps per side", engines.filament, 0.3)
_add("filament-bitmask", "Filament's visibility bitmask, as thick as 5/3 of the radius", engines.filament_bitmask, 0.3)
_add("bevy", "Bevy's visibility bitmask at its level high, 3×3 and six sectors", partial(engines.bevy, "high"), 0.7285)
_add("threejs", "three.js' GTAONode for WebGPU, 3×6", partial(engines.threejs, "node"), 0.25)
_add("threejs-webgl", "three.js' GTAOPass for WebGL, 3×6", partial(engines.threejs, "webgl"), 0.25)


def named(name: str, radius: float | None = None) -> Pipeline:
    """The pipeline called ``name``.

    Args:
        name: a key of ``NAMED``.
        radius: in scene units; the method's own default if left out.

    Raises:
        ConfigError: there is no such method, or it does not accept the radius.
    """
    if name not in NAMED:
        raise ConfigError(f"method must be one of {', '.join(NAMED)}, got {name!r}")
    method = NAMED[name]
    return method.make(method.default_radius if radius is None else radius)


def with_budget(pipeline: Pipeline, n_slices: int, n_steps: int) -> Pipeline:
    """The same pipeline with other counts: 2 n_slices n_steps depth samples per pixel.

    Azimuths that are listed one by one become even ones, unless their number stays.
    """
    method = pipeline.occlusion
    slices: dict[str, Any] = {"n_slices": n_slices}
    if isinstance(method, HBAO):
        slices = {"n_directions": 2 * n_slices}
    angles = getattr(method, "slice_angles", None)
    if angles is not None and len(angles) != n_slices:
        slices["slice_angles"] = None
    return replace(pipeline, occlusion=replace(method, n_steps=n_steps, **slices))
