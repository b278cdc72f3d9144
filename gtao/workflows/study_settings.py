"""What the settings of all studies do alike: they come from a command line, and go into a record."""

from collections.abc import Mapping
from dataclasses import fields
from types import MappingProxyType
from typing import Any, ClassVar, Self

__all__ = ["StudySettings"]


class StudySettings:
    """Base of frozen dataclasses of settings.

    Attributes:
        QUICK: what ``quick`` changes: enough to see every part run, too noisy to keep.
    """

    QUICK: ClassVar[Mapping[str, Any]] = MappingProxyType({})

    @classmethod
    def from_options(cls, *, quick: bool = False, **options: Any) -> Self:
        """Settings from the options of a command line; None and empty lists stand for "not given"."""
        listed = {name: tuple(value) if isinstance(value, list) else value for name, value in options.items()}
        given = {name: value for name, value in listed.items() if value not in (None, ())}
        return cls(**((dict(cls.QUICK) if quick else {}) | given))

    def to_dict(self) -> dict[str, Any]:
        """The settings by name, for a record."""
        return {f.name: getattr(self, f.name) for f in fields(self)}  # type: ignore[arg-type]  # its children are
