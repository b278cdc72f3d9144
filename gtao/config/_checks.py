"""Checks that every configuration makes when it is built."""

import math
import numbers
from typing import Any, get_args

from gtao.errors import ConfigError

__all__ = [
    "check_ceiling",
    "check_choice",
    "check_count",
    "check_flag",
    "check_instance",
    "check_number",
    "check_positive",
    "check_share",
    "is_array",
    "plain",
]


def is_array(value: Any) -> bool:
    """Whether an option is a Dr.Jit array, which may carry a gradient, instead of a Python number."""
    # This room knows the standard library only.
    return type(value).__module__.partition(".")[0] == "drjit"


def plain(value: Any) -> float:
    """The Python number of an option, whether it is one or a Dr.Jit float of width 1."""
    return float(value[0]) if is_array(value) else float(value)


def check_choice(name: str, value: Any, allowed: Any) -> None:
    """``value`` is one of the texts of the Literal ``allowed``."""
    choices = get_args(allowed)
    if value not in choices:
        raise ConfigError(f"{name} must be one of {', '.join(map(repr, choices))}, got {value!r}")


def check_count(name: str, value: Any, low: int, high: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise ConfigError(f"{name} must be an integer from {low} to {high}, got {value!r}")


def check_flag(name: str, value: Any) -> None:
    if not isinstance(value, bool):
        raise ConfigError(f"{name} must be True or False, got {value!r}")


def check_number(name: str, value: Any) -> float:
    """The plain number of ``value``, which is one or a Dr.Jit float of width 1."""
    if is_array(value):
        if not hasattr(value, "__len__") or len(value) != 1 or not isinstance(value[0], float):
            raise ConfigError(
                f"{name} must be a number or a Dr.Jit float of width 1, got {type(value).__name__} {value}"
            )
        return plain(value)
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise ConfigError(f"{name} must be a number, got {value!r}")
    return float(value)


def check_positive(name: str, value: Any, *, infinite: bool = False) -> None:
    number = check_number(name, value)
    if not number > 0 or (math.isinf(number) and not infinite):
        bound = "positive" if infinite else "positive and finite"
        raise ConfigError(f"{name} must be {bound}, got {value!r}")


def check_share(name: str, value: Any, *, high: float = 1.0) -> None:
    """``value`` lies in [0, high]."""
    if not 0 <= check_number(name, value) <= high:
        raise ConfigError(f"{name} must lie in [0, {high:g}], got {value!r}")


def check_ceiling(value: Any) -> None:
    """``value`` limits results from above, at 1 or more."""
    if not check_number("ceiling", value) >= 1:
        raise ConfigError(f"ceiling must be at least 1, got {value!r}")


def check_instance(name: str, value: Any, kinds: Any) -> None:
    """``value`` is None or one of the classes ``kinds``."""
    kinds = kinds if isinstance(kinds, tuple) else (kinds,)
    if value is not None and not isinstance(value, kinds):
        choices = ", ".join(kind.__name__ for kind in kinds)
        raise ConfigError(f"{name} must be None or one of {choices}, got {value!r}")
