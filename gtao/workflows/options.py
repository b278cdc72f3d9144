"""Text from a command line into configuration values."""

import dataclasses
import types
import typing
from collections.abc import Callable, Iterable
from typing import Any

from gtao.config import GTAO, LinearFalloff
from gtao.errors import ConfigError

__all__ = ["PRESETS", "method_from_options"]

PRESETS: dict[str, Callable[..., GTAO]] = {"gtao": GTAO, "published": GTAO.as_published}


def _number(text: str) -> Any:
    try:
        return int(text)
    except ValueError:
        return float(text)


def _value(key: str, text: str, annotation: Any) -> Any:
    """``text`` as a value of the field that ``annotation`` describes."""
    arms = typing.get_args(annotation) if typing.get_origin(annotation) is types.UnionType else (annotation,)
    if text.lower() == "none" and type(None) in arms:
        return None
    if any(typing.get_origin(arm) is typing.Literal for arm in arms):
        return text
    if bool in arms:
        if text.lower() not in ("true", "false"):
            raise ConfigError(f"{key} must be true or false, got {text!r}")
        return text.lower() == "true"
    try:
        return float(text) if float in arms else _number(text)
    except ValueError:
        raise ConfigError(f"{key} must be a number, got {text!r}") from None


def method_from_options(method: str, settings: Iterable[str]) -> GTAO:
    """A configuration from a preset and ``key=value`` texts.

    Args:
        method: "gtao" for the defaults, "published" for the papers' own settings.
        settings: options; ``falloff.start`` and ``falloff.end`` set the falloff.

    Raises:
        ConfigError: the preset or a key does not exist, or a value has the wrong type or range.
    """
    if method not in PRESETS:
        raise ConfigError(f"method must be one of {', '.join(PRESETS)}, got {method!r}")
    hints = typing.get_type_hints(GTAO)
    names = [field.name for field in dataclasses.fields(GTAO) if field.name != "falloff"]
    known = [*names, "falloff.start", "falloff.end"]
    values: dict[str, Any] = {}
    falloff: dict[str, float] = {}
    for setting in settings:
        key, separator, text = setting.partition("=")
        key, text = key.strip(), text.strip()
        if not separator:
            raise ConfigError(f"an option is written key=value, got {setting!r}")
        if key not in known:
            raise ConfigError(f"there is no option {key!r}; choose from {', '.join(known)}")
        if key.startswith("falloff."):
            falloff[key.removeprefix("falloff.")] = _value(key, text, float)
        else:
            values[key] = _value(key, text, hints[key])
    if falloff:
        if len(falloff) < 2:
            raise ConfigError("a falloff needs both falloff.start and falloff.end")
        values["falloff"] = LinearFalloff(**falloff)
    return PRESETS[method](**values)
