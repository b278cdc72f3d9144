"""The continuous options of a configuration by dotted paths, in units that carry over from scene to scene.

Lengths are in units of the radius: what is good for one radius is then a candidate for every other. Lengths that mean
nothing without another one are shares of it, so that no value of one makes those of the others invalid.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

from gtao.config import Pipeline, plain
from gtao.errors import ConfigError

__all__ = [
    "CONTINUOUS",
    "Range",
    "at_radius",
    "continuous",
    "option",
    "scene_options",
    "with_continuous",
    "with_options",
]


@dataclass(frozen=True)
class Range:
    """How an option varies.

    Attributes:
        low, high: bounds where none are given; both can be reached.
        unit: "" for plain numbers, "radius" for multiples of the radius, or the path that values are shares of, where
            "reach" is the farther of the radius and the search radius.
        relative: whether steps are relative to the value; bounds are then positive. Options that may end at 0 are not.
    """

    low: float
    high: float
    unit: str = ""
    relative: bool = True


#: Path -> range of everything that can be tuned.
CONTINUOUS: dict[str, Range] = {
    "radius": Range(0.1, 10, "radius"),
    "radius_multiplier": Range(0.2, 5),
    "step_exponent": Range(0.5, 4),
    "min_step_px": Range(0.5, 16),
    "max_radius_px": Range(16, 1e4),
    "max_radius_share": Range(1e-3, 2),
    "depth_bias": Range(0, 0.01, relative=False),
    "pyramid.level_offset": Range(0, 8, relative=False),
    "falloff.end": Range(0.05, 1, "reach"),
    "falloff.start": Range(0, 0.99, "falloff.end", relative=False),
    "falloff.strength": Range(0, 8, relative=False),
    "thickness.blend": Range(0, 1, relative=False),
    "thickness.depth": Range(0.01, 100, "radius"),
    "thickness.thickness": Range(0.01, 100, "radius"),
    "thickness.slope": Range(1e-4, 10),
    "thickness.continuing": Range(0.01, 100, "radius"),
    "thickness.isolated": Range(0.01, 1, "thickness.continuing"),
    "thickness.gap": Range(1e-3, 10, "radius"),
    "thin_occluder_compensation": Range(0, 5, relative=False),
    "length_blend": Range(0, 1, relative=False),
    "power": Range(0.2, 5),
    "floor": Range(0, 0.5, relative=False),
    "spatial.beta": Range(0.05, 20),
    "spatial.edge_threshold": Range(1e-4, 1),
    "spatial.diagonal_weight": Range(0, 2, relative=False),
    "spatial.leak_threshold": Range(0, 3.99, relative=False),
    "spatial.leak_strength": Range(0, 1, relative=False),
    "spatial.threshold": Range(1e-3, 2),
    "spatial.tolerance": Range(0.05, 10),
    "upsample.threshold": Range(1e-3, 2),
    "upsample.tolerance": Range(0.02, 10),
    "upsample.angle": Range(0.02, math.pi),
}


def option(method: Any, path: str) -> Any:
    """The option, or None where the configuration has none of that name."""
    for name in path.split("."):
        method = getattr(_owner(method, name), name, None)
    return method


def _owner(method: Any, name: str) -> Any:
    """The configuration that has the option: of a pipeline it is the estimator, unless the pipeline has it itself."""
    if isinstance(method, Pipeline) and name not in (f.name for f in fields(method)):
        return method.occlusion
    return method


def _length(options: Mapping[str, float], unit: str, radius: float) -> float:
    """What a value of 1 stands for; ``options`` hold what was converted before."""
    if unit == "radius":
        return radius
    if unit != "reach":
        return options[unit] if unit else 1.0
    nominal = options.get("radius", math.inf)
    search = nominal * options.get("radius_multiplier", 1.0)
    farthest = max(nominal, search)
    return farthest if math.isfinite(farthest) else radius


def _unit_length(method: Any, radius: float | None) -> float:
    """The radius to measure with: the one given, else the configuration's own, else one scene unit."""
    own = option(method, "radius")
    if radius is not None:
        return radius
    return plain(own) if own is not None and math.isfinite(plain(own)) else 1.0


def continuous(method: Any) -> dict[str, float]:
    """The finite continuous options of a configuration: path -> value in the units of :data:`CONTINUOUS`.

    Of a :class:`gtao.Pipeline` the options of its filter are called ``spatial.…``, those of its way back to full size
    ``upsample.…``.
    """
    found = {path: option(method, path) for path in CONTINUOUS}
    options = {p: plain(v) for p, v in found.items() if v is not None and math.isfinite(plain(v))}
    radius = _unit_length(method, None)
    return {path: value / _length(options, CONTINUOUS[path].unit, radius) for path, value in options.items()}


def scene_options(method: Any, values: Mapping[str, float], radius: float | None = None) -> dict[str, float]:
    """All continuous options as the configuration itself would have them: path -> value in scene units.

    Args and errors as :func:`with_continuous`. Every option is linear in every single value.
    """
    known = continuous(method)
    if unknown := sorted(set(values) - set(known)):
        raise ConfigError(f"there is no continuous option {', '.join(unknown)}; choose from {', '.join(known)}")
    if radius is not None and "radius" not in known:
        raise ConfigError("the method has no finite radius to scale to that of the truth; give it one")
    unit, options = _unit_length(method, radius), {}
    for path, value in (known | dict(values)).items():
        options[path] = value * _length(options, CONTINUOUS[path].unit, unit)
    return options


def with_continuous(method: Any, values: Mapping[str, float], radius: float | None = None) -> Any:
    """The configuration with other values of continuous options, at another radius.

    Args:
        method: a configuration or a pipeline.
        values: path -> number in the units of :data:`CONTINUOUS`.
        radius: in scene units; that of the configuration, or 1 where it is infinite, if left out.

    Returns:
        A configuration of the same type. Lengths without a new value scale with the radius; shares stay what they are.

    Raises:
        ConfigError: a value is out of range, or the configuration has no such option, or no radius to scale.
    """
    return with_options(method, scene_options(method, values, radius))


def at_radius(method: Any, radius: float) -> Any:
    """The configuration for another radius: every length of it scales along.

    Args:
        method: a configuration or a pipeline with a finite radius.
        radius: in scene units.

    Raises:
        ConfigError: the configuration has no finite radius.
    """
    return with_continuous(method, {}, radius)


def with_options(method: Any, options: Mapping[str, Any]) -> Any:
    """The configuration with options replaced all at once: path -> value as the configuration itself has it.

    Raises:
        ConfigError: there is no such option, or its value is out of range.
    """
    own: dict[str, Any] = {}
    parts: dict[str, dict[str, Any]] = {}
    for path, value in options.items():
        name, _, rest = path.partition(".")
        if _owner(method, name) is not method:
            parts.setdefault("occlusion", {})[path] = value
            continue
        if name not in (f.name for f in fields(method)):
            raise ConfigError(f"{type(method).__name__} has no option {name!r}; see its documentation")
        if rest:
            parts.setdefault(name, {})[rest] = value
        else:
            own[name] = value
    for name, inner in parts.items():
        part = own.get(name, getattr(method, name))
        if not is_dataclass(part):
            raise ConfigError(f"{name} of {type(method).__name__} is {part!r}, which has no option {min(inner)}")
        own[name] = with_options(part, inner)
    return replace(method, **own)
