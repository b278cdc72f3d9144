"""Text from a command line into configurations."""

import types
import typing
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

from gtao.config import (
    BilateralUpsample,
    BilinearUpsample,
    Downsample,
    EdgeAwareFilter,
    NearestDepthUpsample,
    Pipeline,
    PlaneAwareFilter,
    PlaneAwareUpsample,
    SpatialFilter,
    TemporalFilter,
    method_from_dict,
    named,
)
from gtao.errors import ConfigError

__all__ = ["changed_pipeline", "pipeline_from_options"]

#: What each stage of a pipeline can be, which its fields leave open.
_STAGES: dict[str, Any] = {
    "downsample": Downsample | None,
    "spatial": SpatialFilter | EdgeAwareFilter | PlaneAwareFilter | None,
    "temporal": TemporalFilter | None,
    "upsample": BilateralUpsample | BilinearUpsample | NearestDepthUpsample | PlaneAwareUpsample | None,
}


def pipeline_from_options(
    method: str,
    settings: Iterable[str] = (),
    radius: float | None = None,
    *,
    others: Mapping[str, Callable[[float], Pipeline]] = types.MappingProxyType({}),
) -> Pipeline:
    """A named method with options changed by ``key=value`` texts.

    A key names an option of the estimator (``n_slices=2``), of a part of it (``falloff.start=0.1``), or of the
    pipeline (``clamp=true``, ``spatial.passes=2``). A part that is not there is made, of the class that has the
    options given; ``falloff.type=SampleCut`` chooses one by name and ``falloff=none`` removes it.

    Args:
        method: a key of :data:`gtao.config.NAMED`.
        settings: options.
        radius: in scene units, where the settings name none; the method's own default if left out.
        others: more methods by name, which have no default.

    Raises:
        ConfigError: the method or a key does not exist, or a value has the wrong type or range.
    """
    values = dict(_split(setting) for setting in settings)
    if "radius" in values:
        # Presets derive other lengths from it.
        radius = _number("radius", values.pop("radius"))
    if method in others and radius is not None:
        return _changed(others[method](radius), values)
    return _changed(named(method, radius), values)


def changed_pipeline(pipeline: Pipeline, settings: Iterable[str]) -> Pipeline:
    """A pipeline with options changed as :func:`pipeline_from_options` does; a radius is an option like any other.

    Raises:
        ConfigError: a key does not exist, or a value has the wrong type or range.
    """
    return _changed(pipeline, dict(_split(setting) for setting in settings))


def _changed(pipeline: Pipeline, values: dict[str, str]) -> Pipeline:
    described = pipeline.to_dict()
    own = {f.name for f in fields(pipeline)} - {"occlusion"}
    changed: dict[str, tuple[dict[str, Any], list[type]]] = {}
    for key, text in values.items():
        path = key.split(".")
        inside, config = (described, pipeline) if path[0] in own else (described["occlusion"], pipeline.occlusion)
        _set(inside, config, path, text, values)
        if len(path) > 1:
            changed[path[0]] = inside[path[0]], _parts(_hints(config)[path[0]])
    for name, part in changed.items():
        _check_part(name, *part)
    return method_from_dict(described)


def _check_part(name: str, described: dict[str, Any], kinds: list[type]) -> None:
    """Raise what is wrong with a part on its own, in the names that its options have."""
    options = {f.name for kind in kinds for f in fields(kind)}
    try:
        method_from_dict(described)
    except ConfigError as cause:
        text = str(cause)
        raise ConfigError(f"{name}.{text}" if text.split()[0] in options else f"{name}: {text}") from None


def _split(setting: str) -> tuple[str, str]:
    key, separator, text = setting.partition("=")
    if not separator:
        raise ConfigError(f"an option is written key=value, got {setting!r}")
    return key.strip(), text.strip()


def _number(key: str, text: str) -> Any:
    try:
        return float(text)
    except ValueError:
        raise ConfigError(f"{key} must be a number, got {text!r}") from None


def _set(described: dict[str, Any], config: Any, path: list[str], text: str, values: dict[str, str]) -> None:
    """Change one value of a description, or of a part of it, which is made if need be."""
    hints = _hints(config)
    names = [f.name for f in fields(config)]
    if path[0] not in names or len(path) > 2:
        known = (n if not _parts(hints[n]) else f"{n}.…" for n in names if n != "occlusion")
        raise ConfigError(f"there is no option {'.'.join(path)!r}; choose from {', '.join(known)}")
    name, annotation = path[0], hints[path[0]]
    if len(path) == 1:
        described[name] = _value(name, text, annotation)
        return
    if not _parts(annotation):
        raise ConfigError(f"{name} has no options of its own; write {name}=VALUE, got {'.'.join(path)!r}")
    part = described[name]
    if part is None or f"{name}.type" in values:
        kind = _part_class(name, annotation, values)
        if part is None or part["type"] != kind.__name__:
            described[name] = part = {"type": kind.__name__}
    if path[1] == "type":
        return
    kind = next(kind for kind in _parts(annotation) if kind.__name__ == part["type"])
    hints = typing.get_type_hints(kind)
    if path[1] not in hints:
        raise ConfigError(f"there is no option {'.'.join(path)!r}; {kind.__name__} has {', '.join(hints) or 'none'}")
    part[path[1]] = _value(".".join(path), text, hints[path[1]])


def _hints(config: Any) -> dict[str, Any]:
    """What each field of a configuration can hold."""
    hints = typing.get_type_hints(type(config), {"Pipeline": Pipeline})
    return hints | _STAGES if isinstance(config, Pipeline) else hints


def _parts(annotation: Any) -> list[type]:
    """The configuration classes that a field can hold."""
    return [arm for arm in _arms(annotation) if isinstance(arm, type) and is_dataclass(arm)]


def _part_class(name: str, annotation: Any, values: dict[str, str]) -> type:
    """The class named by ``name.type``, or the first that has all options given for the part."""
    kinds = _parts(annotation)
    chosen = values.get(f"{name}.type")
    given = {key.partition(".")[2] for key in values if key.startswith(f"{name}.")} - {"type"}
    for kind in kinds:
        if kind.__name__ == chosen or (chosen is None and given <= {f.name for f in fields(kind)}):
            return kind
    raise ConfigError(
        f"no {name} has the options {', '.join(sorted(given))}; choose {name}.type from"
        f" {', '.join(kind.__name__ for kind in kinds) or 'none'}"
    )


def _arms(annotation: Any) -> tuple[Any, ...]:
    union = typing.get_origin(annotation) in (types.UnionType, typing.Union)
    return typing.get_args(annotation) if union else (annotation,)


def _value(key: str, text: str, annotation: Any) -> Any:
    """``text`` as a value of the field that ``annotation`` describes."""
    arms = _arms(annotation)
    if text.lower() == "none" and type(None) in arms:
        return None
    if bool in arms and text.lower() in ("true", "false"):
        return text.lower() == "true"
    if any(typing.get_origin(arm) is typing.Literal for arm in arms):
        return text
    if bool in arms:
        raise ConfigError(f"{key} must be true or false, got {text!r}")
    if _parts(annotation):
        raise ConfigError(f"{key} has options of its own: write {key}.NAME=VALUE, got {text!r}")
    try:
        return int(text) if int in arms else _number(key, text)
    except ValueError:
        raise ConfigError(f"{key} must be a whole number, got {text!r}") from None
