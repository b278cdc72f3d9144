"""Which numbers of a configuration or a camera carry gradients."""

from dataclasses import fields, is_dataclass
from typing import Any

import drjit as dr

__all__ = ["attached_numbers", "is_attached"]


def is_attached(value: Any) -> bool:
    """Whether a number carries a gradient."""
    return dr.is_array_v(value) and dr.grad_enabled(value)


def attached_numbers(config: Any, prefix: str = "") -> tuple[str, ...]:
    """Paths of the numbers in a configuration or a camera that carry gradients, such as "falloff.end"."""
    found: list[str] = []
    for f in fields(config):
        value = getattr(config, f.name)
        if is_dataclass(value):
            found += attached_numbers(value, f"{prefix}{f.name}.")
        elif is_attached(value):
            found.append(prefix + f.name)
    return tuple(found)
