"""What a whole job leaves in its directory, and in which order, so that a directory with a record is finished."""

from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from types import MappingProxyType
from typing import Any

from gtao import io
from gtao.errors import RecordError

__all__ = ["OutputDirectory", "command_line", "save_figures"]

PLOT_DPI = 110
RECORD, REPORT = "record.json", "report.html"


def command_line(
    command: str,
    scenes: Sequence[str],
    output: Path,
    config: Any,
    plain: Sequence[str],
    repeated: Mapping[str, Sequence[Any]] = MappingProxyType({}),
) -> list[str]:
    """The words that repeat a run; what is set by scene, which they cannot say, is in the record's settings alone.

    Args:
        command: subcommand of ``gtao``.
        scenes: as :func:`gtao.workflows.views.portable` names them.
        output: the directory.
        config: its settings.
        plain: names of the settings that are options of the same name with a single value.
        repeated: option -> values, of those that are given once for each value.
    """
    options: list[Any] = ["-o", io.portable(output)]
    options += [word for option, values in repeated.items() for value in values for word in (option, value)]
    for name in plain:
        value = getattr(config, name)
        if value is not None and not isinstance(value, Mapping):
            options += [f"--{name.replace('_', '-')}", value]
    options += ["--all-sensors"] if getattr(config, "all_sensors", False) else []
    return ["gtao", command, *scenes, *map(str, options)]


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

    def begin(self) -> None:
        """Remove the record, the report and what they list, where files change before the end of the job."""
        earlier = _listed(self.path / RECORD)
        (self.path / RECORD).unlink(missing_ok=True)
        for name in (*earlier, REPORT):
            (self.path / name).unlink(missing_ok=True)

    def publish(
        self,
        record: Mapping[str, Any],
        texts: Mapping[str, str],
        figures: Mapping[str, Any],
        page: Callable[[dict[str, Any]], str],
        present: Sequence[str] = (),
    ) -> dict[str, Any]:
        """Write texts, figures, the report and the record; remove what an earlier run listed and this one has not.

        Args:
            record: provenance, kind, inputs and numbers.
            texts: file name -> contents.
            figures: name -> Matplotlib figure.
            page: makes the report of the record, in which the other files are listed. It shows the record, which
                therefore cannot hold its hash.
            present: names of files that the job has written itself, to be listed with the others.

        Returns:
            The record as it was written.
        """
        # From here on files change: without its record the directory counts as unfinished.
        earlier = _listed(self.path / RECORD)
        (self.path / RECORD).unlink(missing_ok=True)
        for name, text in texts.items():
            io.write_text(self.path / name, text)
        names = [*texts, *save_figures(self.path, figures), *present]
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
