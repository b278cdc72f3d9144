"""What lets a killed run go on: after every frame, what each method remembers and what was measured.

Everything of a frame is written into a folder of its own, then ``state.json`` is moved into place, which names that
folder: at every moment there is one whole state, or none.
"""

import contextlib
import hashlib
import shutil
import zipfile
from collections.abc import Callable, Mapping
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

#: What every frame adds a value to.
CURVES = ("rmse", "bias", "step", "lag")


@dataclass(eq=False)
class Memory:
    """What is remembered of one method.

    Attributes:
        history: of its temporal filter.
        scores: of its frames so far.
        curves: quantity -> its value in every frame so far, None where there is none.
    """

    history: History = field(default_factory=History)
    scores: evaluate.TemporalScores = field(default_factory=evaluate.TemporalScores)
    curves: dict[str, list[float | None]] = field(default_factory=lambda: {name: [] for name in CURVES})


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
        settings: everything that the frames depend on. A state of other settings, or of another version of the
            program, does not count.
    """

    def __init__(self, output: Path, settings: Mapping[str, Any]):
        self.folder = output / FOLDER
        self._settings = io.canonical_json({"program": _program(), **settings})

    def methods(self) -> list[str]:
        """Names of the methods of whatever run has left its state here."""
        with contextlib.suppress(GtaoError, ValueError, KeyError, TypeError, AttributeError):
            return [*map(str, read_json(self.folder / STATE, "state")["curves"].keys())]
        return []

    def load(self, methods: list[str], whole: Callable[[int], bool]) -> Progress:
        """Where the run stopped; its beginning if there is no state of these settings, or none that can be read.

        Args:
            methods: names of the files of the methods.
            whole: whether the pictures of so many frames are there. Without them a state is good for nothing.
        """
        with contextlib.suppress(GtaoError, OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile):
            state = read_json(self.folder / STATE, "state")
            if state["settings"] == self._settings:
                folder = self.folder / state["folder"]
                curves = state["curves"]
                memories = {name: _read(folder, name, curves[name]) for name in methods}
                views = [*map(str, state["views"])]
                if whole(len(views)):
                    return Progress(views, memories)
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


def _program() -> dict[str, Any]:
    """What says whether it is the same program: versions of packages, and a hash of this one's own files."""
    package, hasher = Path(__file__).parents[2], hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        hasher.update(path.relative_to(package).as_posix().encode() + path.read_bytes())
    return {"versions": io.versions(), "sha256": hasher.hexdigest()}


def _read(folder: Path, method: str, curves: dict[str, Any]) -> Memory:
    path = folder / f"{method}.scores.npz"
    with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
        scores = evaluate.TemporalScores.from_state(dict(stored))
    history = io.read_history(folder / f"{method}.history.npz")
    return Memory(history, scores, {name: list(curves[name]) for name in CURVES})
