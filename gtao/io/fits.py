"""Multi-bounce coefficients as JSON files."""

import math
import os
from typing import Any

from gtao.data.multibounce import FORM_PARAMETERS, MultibounceFit
from gtao.errors import ConfigError, RecordError

from .atomic import write_text
from .jsontext import pretty_json, read_json, with_infinities

__all__ = ["fit_from_dict", "fit_of_record", "fit_text", "fit_to_dict", "read_fit", "write_fit"]

KIND = "gtao.multibounce"
SCHEMA = 1


def fit_to_dict(fit: MultibounceFit) -> dict[str, Any]:
    """Plain values: each coefficient by name with value, standard error and interval (None if unknown)."""
    rows = {}
    for i, name in enumerate(fit.names):
        rows[name] = {
            "value": fit.numbers[i],
            "standard_error": None if fit.standard_errors is None else fit.standard_errors[i],
            "interval": None if fit.intervals is None else list(fit.intervals[i]),
        }
    return {
        "kind": KIND,
        "schema": SCHEMA,
        "form": fit.form,
        "bounces": fit.bounces,
        "coefficients": rows,
        "level": fit.level,
        "source": fit.source,
    }


def _real(value: Any, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise RecordError(f"{what} must be a number, got {value!r}")
    return float(value)


def _all_or_none(values: list[Any], what: str) -> tuple[Any, ...] | None:
    missing = [value is None for value in values]
    if any(missing) and not all(missing):
        raise RecordError(f"{what} must be given for all coefficients or for none")
    return None if not values or missing[0] else tuple(values)


def fit_from_dict(data: Any) -> MultibounceFit:
    """The fit that :func:`fit_to_dict` described; infinities may be numbers or the string "inf".

    Raises:
        RecordError: something is missing or of the wrong kind; the message says what.
    """
    if not isinstance(data, dict) or data.get("kind") != KIND:
        raise RecordError(f"not multi-bounce coefficients: 'kind' must be {KIND!r}")
    if data.get("schema") != SCHEMA:
        raise RecordError(f"coefficients have schema {data.get('schema')!r}, this gtao knows {SCHEMA}")
    data = with_infinities(data)
    rows = data.get("coefficients")
    if not isinstance(rows, dict) or not all(isinstance(row, dict) for row in rows.values()):
        raise RecordError("'coefficients' must be an object of objects with a value each")
    for key in ("form", "source"):
        if not isinstance(data.get(key), str):
            raise RecordError(f"{key!r} must be a string, got {data.get(key)!r}")
    level = data.get("level")
    try:
        names = FORM_PARAMETERS.get(data["form"])
        if names is None:
            raise RecordError(f"unknown form {data['form']!r}; known are {', '.join(FORM_PARAMETERS)}")
        if set(names) != set(rows):
            raise RecordError(f"form {data['form']!r} has coefficients {', '.join(names)}, got {', '.join(rows)}")
        values = tuple(_real(rows[name].get("value"), f"coefficient {name}") for name in names)
        errors = [rows[name].get("standard_error") for name in names]
        intervals = [rows[name].get("interval") for name in names]
        for name, interval in zip(names, intervals, strict=True):
            if interval is not None and not (isinstance(interval, list) and len(interval) == 2):
                raise RecordError(f"the interval of {name} must be [low, high], got {interval!r}")
        return MultibounceFit(
            form=data["form"],
            coefficients=values,
            bounces=_real(data.get("bounces"), "bounces"),
            source=data["source"],
            standard_errors=_all_or_none(
                [None if e is None else _real(e, "standard_error") for e in errors], "standard errors"
            ),
            intervals=_all_or_none(
                [None if i is None else (_real(i[0], "interval"), _real(i[1], "interval")) for i in intervals],
                "intervals",
            ),
            level=None if level is None else _real(level, "level"),
        )
    except ConfigError as cause:
        raise RecordError(str(cause)) from None


def read_fit(path: str | os.PathLike) -> MultibounceFit:
    """Read coefficients, for example for ``gtao.multibounce(..., fit=...)``.

    Raises:
        RecordError: the file is missing, not JSON, or not what :func:`write_fit` writes.
    """
    content = read_json(path, "coefficient file")
    try:
        return fit_from_dict(content)
    except RecordError as cause:
        raise RecordError(f"{path}: {cause}") from None


def write_fit(path: str | os.PathLike, fit: MultibounceFit) -> None:
    """Write coefficients with their standard errors and intervals as JSON, whole or not at all; see :func:`fit_text`.

    Raises:
        RecordError: a number is NaN, or the file cannot be written.
    """
    write_text(path, fit_text(fit), error=RecordError)


def fit_text(fit: MultibounceFit) -> str:
    """Coefficients with their standard errors and intervals as JSON.

    Numbers are written so that reading gives the same bits; infinitely many bounces are the string "inf".

    Raises:
        RecordError: a number is NaN.
    """
    if math.isnan(fit.bounces):
        raise RecordError("bounces is NaN; give a count or math.inf")
    return pretty_json(fit_to_dict(fit))


def fit_of_record(record: dict[str, Any]) -> MultibounceFit:
    """The headline fit of the record of a refit.

    Raises:
        RecordError: the record holds no fit, or not a whole one.
    """
    try:
        numbers = record["numbers"]["fit"]
        settings = numbers["settings"]
        names = FORM_PARAMETERS[settings["form"]]

        def values(key: str) -> tuple[Any, ...] | None:
            return None if numbers[key] is None else tuple(numbers[key][name] for name in names)

        coefficients, intervals = values("coefficients"), values("intervals")
        assert coefficients is not None
        return MultibounceFit(
            form=settings["form"],
            coefficients=coefficients,
            bounces=float(settings["bounces"]),
            source=f"refit on {len(numbers['scenes'])} scenes",
            standard_errors=values("standard_errors"),
            intervals=None if intervals is None else tuple((low, high) for low, high in intervals),
            level=None if intervals is None else settings["level"],
        )
    except (KeyError, TypeError, ValueError, AssertionError) as cause:
        raise RecordError(f"the record holds no whole multi-bounce fit: {cause!r}") from None
