"""Records: JSON files that say which numbers came out of which command on which input; never edited."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gtao.errors import RecordError

from .atomic import write_text
from .jsontext import plain, pretty_json, read_json

__all__ = ["SCHEMA", "number", "read_record", "without_timestamps", "write_record"]

#: Version of the layout of records.
SCHEMA = 1

#: key -> what it must be.
_LAYOUT: dict[str, tuple[type, ...]] = {
    "schema": (int,),
    "kind": (str,),
    "created": (str,),
    "command": (list,),
    "git": (dict, type(None)),
    "versions": (dict,),
    "device": (dict,),
    "seed": (int, type(None)),
    "config": (dict,),
    "inputs": (list,),
    "outputs": (list,),
    "numbers": (dict,),
}
_TIMES = frozenset({"created", "started", "finished", "elapsed_s", "timing"})
_HEX = frozenset("0123456789abcdef")


def number(
    value: float,
    standard_error: float | None = None,
    interval: tuple[float, float] | None = None,
    **more: Any,
) -> dict[str, Any]:
    """A number of a record with its uncertainty: ``{"value", "standard_error"[, "interval"], …}``."""
    entry: dict[str, Any] = {"value": value, "standard_error": standard_error, **more}
    if interval is not None:
        entry["interval"] = list(interval)
    return entry


def _name(kinds: tuple[type, ...]) -> str:
    words = {int: "an integer", str: "a string", list: "a list", dict: "an object", type(None): "null"}
    return " or ".join(words[kind] for kind in kinds)


def _check_files(where: str, entries: list[Any]) -> None:
    for i, entry in enumerate(entries):
        digest = entry.get("sha256") if isinstance(entry, dict) else None
        if not (isinstance(digest, str) and len(digest) == 64 and set(digest) <= _HEX):
            raise RecordError(f"record {where}[{i}] must be an object with a sha256 of 64 hexadecimal digits")


def _check_numbers(where: str, value: Any) -> None:
    """Every object with a value states its standard error, be it null."""
    if isinstance(value, dict):
        if "value" in value and "standard_error" not in value:
            raise RecordError(f"record {where} has a value but no standard_error; give one, or null")
        for key, item in value.items():
            _check_numbers(f"{where}.{key}", item)
    elif isinstance(value, list):
        for i, item in enumerate(value):
            _check_numbers(f"{where}[{i}]", item)


def _check_portable(where: str, value: Any) -> None:
    if isinstance(value, dict):
        for key, item in value.items():
            _check_portable(f"{where}.{key}", item)
    elif isinstance(value, list):
        for i, item in enumerate(value):
            _check_portable(f"{where}[{i}]", item)
    elif isinstance(value, str) and value.startswith(("/", "file:/")) and "/" in value[1:]:
        raise RecordError(f"{where} is a path of this machine ({value}); use portable() on it")


def _validate(record: Any) -> dict[str, Any]:
    if not isinstance(record, dict):
        raise RecordError(f"a record is a JSON object, got {type(record).__name__}")
    schema = record.get("schema")
    if isinstance(schema, int) and schema > SCHEMA:
        raise RecordError(f"record has schema {schema}, this gtao knows up to {SCHEMA}; upgrade gtao")
    for key, kinds in _LAYOUT.items():
        if key not in record:
            raise RecordError(f"record has no {key!r}; it must be {_name(kinds)}")
        if not isinstance(record[key], kinds) or isinstance(record[key], bool):
            raise RecordError(f"record {key!r} must be {_name(kinds)}, got {type(record[key]).__name__}")
    if schema != SCHEMA:
        raise RecordError(f"record has schema {schema}, this gtao knows {SCHEMA}")
    for where in ("inputs", "outputs"):
        _check_files(where, record[where])
    _check_numbers("numbers", record["numbers"])
    return record


def read_record(path: str | os.PathLike) -> dict[str, Any]:
    """Read and check a record.

    Infinities stay the strings "inf" and "-inf"; :func:`gtao.io.with_infinities` turns them into numbers.

    Raises:
        RecordError: the file is missing, not JSON, or not what the schema says.
    """
    content = read_json(path, "record")
    try:
        return _validate(content)
    except RecordError as cause:
        raise RecordError(f"{path}: {cause}") from None


def write_record(path: str | os.PathLike, record: Mapping[str, Any], *, overwrite: bool = False) -> None:
    """Check and write a record, whole or not at all; ``schema`` is filled in.

    Args:
        path: the file.
        record: ``kind``, what :func:`gtao.io.provenance` gives, ``inputs`` and ``outputs`` (lists of
            :func:`gtao.io.file_entry`), and ``numbers``, where each object with a ``value`` has a
            ``standard_error``. Further keys are kept.
        overwrite: replace an existing file. Records are not edited: a newer one supersedes them.

    Raises:
        RecordError: the record is incomplete, holds NaN or a path of this machine, exists already, or cannot be
            written.
    """
    if not overwrite and Path(path).exists():
        raise RecordError(f"{path} exists and records are not overwritten; choose another name or folder")
    complete = _validate(plain({"schema": SCHEMA, **record}, "record"))
    _check_portable("record", complete)
    write_text(path, pretty_json(complete), error=RecordError)


def without_timestamps(record: Any) -> Any:
    """A copy without what differs between identical runs.

    Dropped at every depth: ``created``, ``started``, ``finished``, ``elapsed_s`` and ``timing``.
    """
    if isinstance(record, Mapping):
        return {key: without_timestamps(item) for key, item in record.items() if key not in _TIMES}
    if isinstance(record, list | tuple):
        return [without_timestamps(item) for item in record]
    return record
