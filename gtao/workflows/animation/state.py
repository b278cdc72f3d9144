"""What lets a killed run go on: after every frame, what each method remembers and what was measured.

Everything of a frame is written into a folder of its own, then ``state.json`` is moved into place, which names that
folder: at every moment there is one whole state, or none.
"""

import contextlib
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from gtao import evaluate, io
from gtao.errors import GtaoError, RecordError
from gtao.history import History
from gtao.io.jsontext import read_json

__all__ = ["Memory", "Progress", "Unfinished"]

#: Folder in the output of a run that is not finished.
FOLDER = "unfinished"
STATE = "state.json"
#: Part of the settings' hash: raise it when an older state must not be gone on from.
SCHEMA = 1


@dataclass(eq=False)
class Memory:
    """What is remembered of one method.

    Attributes:
        history: of its temporal filter.
        scores: of its frames so far.
        curves: quantity -> its value in every frame so far.
    """

    history: History = field(default_factory=History)
    scores: evaluate.TemporalScores = field(default_factory=evaluate.TemporalScores)
    curves: dict[str, list[float]] = field(default_factory=dict)


@dataclass(eq=False)
class Progress:
    """How far a run has come.

    Attributes:
        views: fingerprint of every frame so far, whose number is that of the next frame.
        memories: by method.
    """

    views: list[str]
    memories: dict[str, Memory]


class Unfinished:
    """The state of a run in its output directory.

    Args:
        output: the directory.
        settings: everything that the frames depend on. A state of other settings does not count.
    """

    def __init__(self, output: Path, settings: Mapping[str, Any]):
        self.folder = output / FOLDER
        self._settings = io.canonical_json({"schema": SCHEMA, **settings})

    def load(self, methods: list[str]) -> Progress:
        """Where the run stopped; its beginning if there is no state of these settings, or none that can be read."""
        with contextlib.suppress(GtaoError, OSError, ValueError, KeyError, TypeError):
            state = read_json(self.folder / STATE, "state")
            if state["settings"] == self._settings:
                folder = self.folder / state["folder"]
                curves = state["curves"]
                memories = {name: _read(folder, name, curves[name]) for name in methods}
                return Progress([*map(str, state["views"])], memories)
        return Progress([], {name: Memory() for name in methods})

    def save(self, progress: Progress) -> None:
        """Keep the state after a frame.

        Raises:
            RecordError, ImageError: it cannot be written.
        """
        name = f"{len(progress.views):06d}"
        # What a killed run began to write.
        shutil.rmtree(self.folder / name, ignore_errors=True)
        for method, memory in progress.memories.items():
            io.write_history(self.folder / name / f"{method}.history.npz", memory.history)
            with (
                io.atomic_path(self.folder / name / f"{method}.scores.npz", error=RecordError) as path,
                path.open("wb") as file,
            ):
                np.savez(file, **memory.scores.state())
        state = {
            "settings": self._settings,
            "folder": name,
            "views": progress.views,
            "curves": {method: memory.curves for method, memory in progress.memories.items()},
        }
        io.write_text(self.folder / STATE, io.pretty_json(state), error=RecordError)
        for other in self.folder.iterdir():
            if other.is_dir() and other.name != name:
                shutil.rmtree(other, ignore_errors=True)

    def remove(self) -> None:
        """The run is finished, or another one begins."""
        with contextlib.suppress(FileNotFoundError):
            # First the file without which the rest means nothing.
            (self.folder / STATE).unlink()
        shutil.rmtree(self.folder, ignore_errors=True)


def _read(folder: Path, method: str, curves: dict[str, Any]) -> Memory:
    with np.load(folder / f"{method}.scores.npz", allow_pickle=False) as stored:
        scores = evaluate.TemporalScores.from_state(dict(stored))
    history = io.read_history(folder / f"{method}.history.npz")
    return Memory(history, scores, {name: list(values) for name, values in curves.items()})
