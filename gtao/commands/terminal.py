"""What a terminal shows: text, errors, progress."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

__all__ = ["Bars", "out", "report"]

out = Console()
_err = Console(stderr=True)


class Bars:
    """One progress bar per task, on standard error; a workflow reports ``(task, done, total)``."""

    def __init__(self) -> None:
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TaskProgressColumn(),
            TimeElapsedColumn(),
            console=_err,
        )
        self._tasks: dict[str, Any] = {}

    def __enter__(self) -> "Bars":
        self._progress.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self._progress.stop()
        else:  # leave the error behind, and no bars
            self._progress.live.transient = True
            self._progress.live.stop()

    def __call__(self, task: str, done: int, total: int) -> None:
        if task not in self._tasks:
            self._tasks[task] = self._progress.add_task(task, total=total)
        self._progress.update(self._tasks[task], completed=done, total=total)


def report(workflow: Callable[..., Any], config: Any, output: Path, **options: Any) -> None:
    """Run a workflow that leaves a report in a directory, with bars, and say what it found and where."""
    with Bars() as bars:
        result = workflow(config, output, progress=bars, **options)
    out.print(result.summary(), soft_wrap=True, highlight=False)
    out.print(f"report: {output / 'report.html'}", soft_wrap=True)
