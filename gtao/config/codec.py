"""Configurations as plain values and back."""

import math
from dataclasses import MISSING, fields, is_dataclass
from typing import Any

from gtao.errors import ConfigError

from ._checks import is_array, plain

__all__ = ["from_dict", "known_types", "register", "to_dict"]

_TYPES: dict[str, Any] = {}


def register(*classes: type) -> None:
    """Let :func:`from_dict` make these classes by their names."""
    _TYPES.update({cls.__name__: cls for cls in classes})


def known_types() -> tuple[str, ...]:
    return tuple(_TYPES)


def to_dict(config: Any) -> dict[str, Any]:
    """The fields of a configuration, nested ones too, each with the name of its class under "type"."""
    values = {f.name: getattr(config, f.name) for f in fields(config)}
    return {"type": type(config).__name__} | {k: _described(v) for k, v in values.items()}


def _described(value: Any) -> Any:
    if is_dataclass(value):
        return to_dict(value)
    return plain(value) if is_array(value) else value


def from_dict(data: Any, default: str | None = None) -> Any:
    """What :func:`to_dict` described; the text "inf" stands for infinity, as in the records.

    Args:
        default: class to assume where "type" is missing.

    Raises:
        ConfigError: the type is unknown, a name does not exist or a value is out of range.
    """
    if not isinstance(data, dict):
        raise ConfigError(f"a method is described by an object of names and values, got {type(data).__name__}")
    data = dict(data)
    kind = data.pop("type", default)
    if kind not in _TYPES:
        raise ConfigError(f"unknown method {kind!r}; choose {', '.join(_TYPES)}")
    values = {name: _value(name, value) for name, value in data.items()}
    known = [f.name for f in fields(_TYPES[kind])]
    if unknown := sorted(set(values) - set(known)):
        raise ConfigError(f"bad {kind} options: there is no {', '.join(unknown)}; choose from {', '.join(known)}")
    required = (f.name for f in fields(_TYPES[kind]) if f.default is MISSING is f.default_factory)
    missing = [name for name in required if name not in values]
    if missing:
        raise ConfigError(f"{kind} also needs {' and '.join(missing)}")
    return _TYPES[kind](**values)


def _value(name: str, value: Any) -> Any:
    if isinstance(value, dict):
        # Records written before falloffs had types hold the linear one.
        return from_dict(value, "LinearFalloff" if name == "falloff" else None)
    # JSON has no number for it.
    return math.inf if isinstance(value, str) and value == "inf" else value
