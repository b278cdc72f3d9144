"""Which views of which scenes take part, and under what names."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gtao import render
from gtao.errors import SceneError

__all__ = ["View", "open_scene", "scene_names"]


@dataclass(frozen=True)
class View:
    """One camera of one scene."""

    scene_name: str
    source: str
    sensor: int
    fingerprint: str

    @property
    def name(self) -> str:
        return f"{self.scene_name}, camera {self.sensor}"


def scene_names(sources: Sequence[str]) -> dict[str, str]:
    """A short, unique name for every source.

    An embedded scene keeps its name; a file is called after its stem, or after its folder where many files share a
    stem (``bunny/scene.xml``).

    Raises:
        SceneError: a source is given twice.
    """
    if len(set(sources)) < len(sources):
        twice = sorted({s for s in sources if sources.count(s) > 1})
        raise SceneError(f"scenes given more than once: {', '.join(twice)}")
    names: dict[str, str] = {}
    for source in sources:
        path = Path(source)
        is_file = bool(path.suffix) or os.sep in source
        base = path.stem if is_file else source
        if is_file and base == "scene" and path.resolve().parent.name:
            base = path.resolve().parent.name
        name, n = base, 2
        while name in names:
            name, n = f"{base} ({n})", n + 1
        names[name] = source
    return names


def open_scene(source: str, resolution: int) -> tuple[Any, int]:
    """The scene at a resolution, and how many cameras it has.

    Raises:
        SceneError: it cannot be loaded or has no camera.
    """
    scene = render.load_scene(source, resolution=resolution)
    n_sensors = len(scene.sensors())
    if n_sensors == 0:
        raise SceneError(f"scene {source} has no sensor; add one, or choose another scene")
    return scene, n_sensors
