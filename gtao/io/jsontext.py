"""One way to write JSON: sorted keys, plain numbers, infinities as strings "inf" and "-inf", never NaN."""

import json
import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from gtao.errors import RecordError

__all__ = ["canonical_json", "plain", "pretty_json", "read_json", "with_infinities"]


def plain(value: Any, where: str = "value") -> Any:
    """``value`` as dicts, lists, strings, numbers, booleans and None.

    Objects with ``to_dict`` are asked for it, other dataclasses become dicts with their class name under
    ``"type"``, NumPy scalars and arrays become numbers and lists, infinities become ``"inf"`` and ``"-inf"``,
    which :func:`with_infinities` turns back.

    Args:
        value: what to convert.
        where: how to call it in an error.

    Raises:
        RecordError: there is a NaN, a key that is no string, or an object that JSON cannot hold.
    """
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, int):
        return int(value)
    if isinstance(value, float):
        if math.isnan(value):
            raise RecordError(f"{where} is NaN; a record holds numbers, so leave it out or find where it comes from")
        return float(value) if math.isfinite(value) else ("inf" if value > 0 else "-inf")
    if callable(getattr(value, "to_dict", None)):
        return plain(value.to_dict(), where)
    if is_dataclass(value) and not isinstance(value, type):
        named = {f.name: getattr(value, f.name) for f in fields(value)}
        return plain({"type": type(value).__name__, **named}, where)
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise RecordError(f"{where} has the key {key!r}; keys must be strings")
        return {key: plain(item, f"{where}.{key}") for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item, f"{where}[{i}]") for i, item in enumerate(value)]
    raise RecordError(
        f"{where} is a {type(value).__name__}, which a record cannot hold; give numbers, strings or lists"
    )


def with_infinities(value: Any) -> Any:
    """A copy of parsed JSON in which the strings "inf" and "-inf" are numbers again."""
    if isinstance(value, dict):
        return {key: with_infinities(item) for key, item in value.items()}
    if isinstance(value, list):
        return [with_infinities(item) for item in value]
    return float(value) if isinstance(value, str) and value in ("inf", "-inf") else value


def canonical_json(value: Any) -> str:
    """The one text of ``value``, without blanks: what is hashed.

    Raises:
        RecordError: as for :func:`plain`.
    """
    return json.dumps(plain(value), sort_keys=True, ensure_ascii=False, allow_nan=False, separators=(",", ":"))


def pretty_json(value: Any) -> str:
    """``value`` as indented JSON with sorted keys and a final newline: what is stored.

    Raises:
        RecordError: as for :func:`plain`.
    """
    text = json.dumps(plain(value), sort_keys=True, ensure_ascii=False, allow_nan=False, indent=2)
    return text + "\n"


def _refuse_constant(name: str):
    raise ValueError(f"it holds {name}, which is not JSON")


def read_json(path: str | PathLike, what: str, *, advice: str = "write it again with gtao") -> Any:
    """The content of a JSON file.

    Args:
        path: the file.
        what: what it should be, for the error.
        advice: what to do with a file that is not JSON, for the error.

    Raises:
        RecordError: the file is missing, unreadable or not JSON.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except FileNotFoundError:
        raise RecordError(f"no {what} at {path}; check the path") from None
    except (OSError, UnicodeDecodeError, ValueError) as cause:
        reason = getattr(cause, "strerror", None) or "it is not text"
        raise RecordError(f"cannot read {what} {path}: {reason}; check the path") from None
    try:
        return json.loads(text, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as cause:
        raise RecordError(f"{path} is not a {what}: {cause}; {advice}") from None
