"""What a whole job leaves in its directory."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gtao import io
from gtao.errors import RecordError

__all__ = ["listed", "save_figures"]

PLOT_DPI = 110


def listed(record_path: Path) -> set[str]:
    """Names of the files beside the record that it lists as its outputs."""
    try:
        found = {entry.get("path") for entry in io.read_record(record_path)["outputs"]}
    except RecordError:
        return set()
    return {name for name in found if isinstance(name, str) and name == Path(name).name}


def save_figures(output: Path, figures: Mapping[str, Any]) -> list[str]:
    """Write every figure as PNG; the names of the files."""
    for name, figure in figures.items():
        with io.atomic_path(output / f"{name}.png") as path:
            figure.savefig(path, format="png", dpi=PLOT_DPI, metadata={"Software": None})
    return [f"{name}.png" for name in figures]
