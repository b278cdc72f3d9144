"""Loader of the golden values in ``tests/golden``."""

import json
from functools import cache
from pathlib import Path

_FOLDER = Path(__file__).resolve().parent.parent / "golden"

FLOAT64_TOLERANCE = 1e-9
"""Residual of the quadrature that made the values, and of their 13 printed digits."""

FLOAT32_TOLERANCE = 2e-5
"""Rounding of a short float32 evaluation with results of order one."""


@cache
def _all() -> tuple[dict, ...]:
    return tuple(entry for path in sorted(_FOLDER.glob("*.json")) for entry in json.loads(path.read_text()))


def cases(prefix: str) -> list[tuple[dict, dict]]:
    """``(inputs, outputs)`` of every golden value whose identifier starts with ``prefix`` (e.g. ``"A.arc"``)."""
    found = [(entry["inputs"], entry["outputs"]) for entry in _all() if entry["id"].startswith(prefix + ".")]
    if not found:
        raise KeyError(f"no golden value starts with {prefix!r}")
    return found


def prefixes() -> dict[str, set[str]]:
    """Names of the outputs of every prefix there is."""
    names: dict[str, set[str]] = {}
    for entry in _all():
        names.setdefault(entry["id"].rpartition(".")[0], set()).update(entry["outputs"])
    return names
