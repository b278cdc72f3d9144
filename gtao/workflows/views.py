"""Which views of which scenes take part, and under what names."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gtao import io, render
from gtao.errors import SceneError

__all__ = ["open_scene", "portable", "scene_names"]


def scene_names(sources: Sequence[str]) -> dict[str, str]:
    """A short, unique name for every source.

    An embedded scene keeps its name; a file is called after its stem, or after its folder where many files share a
    stem (``bunny/scene.xml``).

    Raises:
        SceneError: a source is given twice.
    """
    embedded = set(render.scenes.names())
    # One file can be spelled in several ways.
    identities = [source if source in embedded else os.path.realpath(source) for source in sources]
    twice = [s for s, identity in zip(sources, identities, strict=True) if identities.count(identity) > 1]
    if twice:
        raise SceneError(f"scenes given more than once: {', '.join(dict.fromkeys(twice))}")
    kept = embedded & set(sources)
    names: dict[str, str] = {}
    for source in sources:
        if source in kept:
            names[source] = source
            continue
        path = Path(os.path.abspath(source))
        base = path.parent.name if path.stem == "scene" and path.parent.name else path.stem
        name, n = base, 2
        while name in names or name in kept:
            name, n = f"{base} ({n})", n + 1
        names[name] = source
    return names


def portable(sources: Sequence[str]) -> list[str]:
    """The sources as a record may hold them: files by names that mean something elsewhere."""
    embedded = render.scenes.names()
    return [source if source in embedded else io.portable(source) for source in sources]


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
