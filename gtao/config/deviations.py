"""What a method does otherwise than the faithful one, option by option."""

from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

from .slices import SliceMethod

__all__ = ["Deviation", "deviations", "faithful"]

#: What a method may choose without deviating: what it looks for, how much it looks, and how it spreads its samples.
_KEPT = {"radius", "n_slices", "n_directions", "n_steps", "n_sectors", "noise", "seed"}


@dataclass(frozen=True, kw_only=True)
class Deviation:
    """One option that differs.

    Attributes:
        option: name of the field.
        value: what the method has.
        faithful: what the definition asks for, the field's default.
    """

    option: str
    value: Any
    faithful: Any

    @property
    def label(self) -> str:
        """For tables: ``power = 2.2``."""
        return f"{self.option} = {_short(self.value)}"


def faithful(method: SliceMethod) -> SliceMethod:
    """The method with every heuristic off: same radius, samples and noise, all other options at their defaults."""
    return replace(method, **{d.option: d.faithful for d in deviations(method)})


def deviations(method: SliceMethod) -> tuple[Deviation, ...]:
    """The options in which a method differs from its faithful form, in an order in which they can be switched on."""
    return tuple(
        Deviation(option=f.name, value=getattr(method, f.name), faithful=f.default)
        for f in fields(method)
        if f.name not in _KEPT and getattr(method, f.name) != f.default
    )


def _short(value: Any) -> str:
    """A value as a table has room for it."""
    if is_dataclass(value):
        return type(value).__name__
    if isinstance(value, tuple):
        return ", ".join(map(_short, value))
    return f"{value:.4g}" if isinstance(value, float) else str(value)
