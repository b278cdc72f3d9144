"""Which numbers of a configuration or a camera carry gradients."""

from dataclasses import is_dataclass
from typing import Any

import drjit as dr

__all__ = ["attached_numbers", "is_attached"]

_PLAIN = frozenset({float, int, bool, str, tuple, type(None)})


def is_attached(value: Any) -> bool:
    """Whether a number carries a gradient."""
    return dr.is_array_v(value) and dr.grad_enabled(value)


def attached_numbers(config: Any, prefix: str = "") -> tuple[str, ...]:
    """Paths of the numbers in a configuration or a camera that carry gradients, such as "falloff.end"."""
    found: list[str] = []
    # Every call of an estimator asks, so that the usual answer has to be quick.
    for name, value in vars(config).items():
        if type(value) in _PLAIN:
            continue
        if is_dataclass(value):
            found += attached_numbers(value, f"{prefix}{name}.")
        elif is_attached(value):
            found.append(prefix + name)
    return tuple(found)
