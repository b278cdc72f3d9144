"""What a whole job leaves in its directory, and in which order, so that a directory with a record is finished."""

from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from gtao import io
from gtao.errors import RecordError

__all__ = ["OutputDirectory", "save_figures"]

PLOT_DPI = 110
RECORD, REPORT = "record.json", "report.html"


class OutputDirectory:
    """Directory of a job's files, the record last.

    Made before the work begins: a place that cannot be written to is found out at once, and nothing of an earlier run
    is touched until there is something to replace it.

    Raises:
        RecordError: nothing can be written there.
    """

    def __init__(self, path: Path | str):
        self.path = Path(path)
        self._started = datetime.now(UTC)
        io.ensure_writable(self.path / RECORD, error=RecordError)

    def publish(
        self,
        record: Mapping[str, Any],
        texts: Mapping[str, str],
        figures: Mapping[str, Any],
        page: Callable[[dict[str, Any]], str],
    ) -> dict[str, Any]:
        """Write texts, figures, the report and the record; remove what an earlier run listed and this one has not.

        Args:
            record: provenance, kind, inputs and numbers.
            texts: file name -> contents.
            figures: name -> Matplotlib figure.
            page: makes the report of the record, in which the other files are listed. It shows the record, which
                therefore cannot hold its hash.

        Returns:
            The record as it was written.
        """
        # From here on files change: without its record the directory counts as unfinished.
        earlier = _listed(self.path / RECORD)
        (self.path / RECORD).unlink(missing_ok=True)
        for name, text in texts.items():
            io.write_text(self.path / name, text)
        names = [*texts, *save_figures(self.path, figures)]
        for name in earlier - {*names, REPORT}:
            (self.path / name).unlink(missing_ok=True)
        entries = [io.file_entry(self.path / name, self.path) for name in names]
        whole = {**record, "started": self._started.isoformat(timespec="seconds"), "outputs": entries}
        io.write_text(self.path / REPORT, page(whole))
        io.write_record(self.path / RECORD, whole, overwrite=True)
        return whole


def _listed(record_path: Path) -> set[str]:
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
