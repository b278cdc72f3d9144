"""Lists of embedded things: how each is entered, found by name and built."""

import inspect
from collections.abc import Callable, Iterator
from typing import Any, Generic, Protocol, TypeVar

from gtao.errors import ConfigError, SceneError

__all__ = ["Catalogue", "summary"]


class Entry(Protocol):
    """What any entry has to say."""

    @property
    def function(self) -> Callable[..., Any]: ...


Info = TypeVar("Info", bound=Entry)


def summary(function: Callable) -> str:
    """The first line of a function's docstring, without its full stop."""
    return (inspect.getdoc(function) or "").partition("\n")[0].rstrip(".")


class Catalogue(Generic[Info]):
    """What is known of embedded things of one kind, by their names, in the order in which they were entered.

    Args:
        kind: what they are, as in "no embedded scene 'x'".
    """

    def __init__(self, kind: str):
        self.kind = kind
        self._entries: dict[str, Info] = {}

    def enter(self, name: str, info: Info) -> None:
        self._entries[name] = info

    def items(self) -> Iterator[tuple[str, Info]]:
        yield from self._entries.items()

    def get(self, name: str) -> Info:
        """What is known of ``name``.

        Raises:
            SceneError: there is no such thing; the message lists those that exist.
        """
        if name not in self._entries:
            raise SceneError(f"no embedded {self.kind} {name!r}; there are: {', '.join(self._entries)}")
        return self._entries[name]

    def build(self, name: str, width: int, height: int, parameters: dict[str, Any]) -> Any:
        """What the ``function`` that is known of ``name`` makes of the parameters.

        Raises:
            SceneError: there is no such thing.
            ConfigError: it has no such parameter, or a value is out of range.
        """
        function = self.get(name).function
        known = inspect.signature(function).parameters
        unknown = [key for key in parameters if key not in known]
        if unknown:
            raise ConfigError(f"{self.kind} {name!r} has no parameter {unknown[0]!r}; it has: {', '.join(known)}")
        return function(width, height, **parameters)
