"""Which views of which scenes take part, and under what names."""

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gtao import io, render
from gtao.errors import SceneError
from gtao.gbuffer import GBuffer

__all__ = [
    "View",
    "all_values",
    "default_radius",
    "open_scene",
    "portable",
    "scene_names",
    "scene_views",
    "scenes_only",
    "sources",
    "value_of",
]


@dataclass(frozen=True, eq=False)
class View:
    """One camera of one scene.

    Attributes:
        name: scene, and camera where there are several.
        source: what a record says of it: where the scene comes from, with hashes.
        scene, sensor: for rays.
        g: the frame.
        mask: (H, W) pixels that show a surface.
        radius: reach of occluders in scene units.
    """

    name: str
    source: dict[str, Any]
    scene: Any
    sensor: int
    g: GBuffer
    mask: np.ndarray
    radius: float


def scene_views(
    name: str,
    source: str,
    resolution: int | None,
    *,
    all_sensors: bool,
    radius: float | None,
    albedo: bool = True,
) -> Iterator[View]:
    """The views of one scene, one per camera.

    Raises:
        SceneError: the scene cannot be loaded, or shows no surface.
    """
    scene, n_sensors = open_scene(source, resolution)
    for sensor in range(n_sensors if all_sensors else 1):
        g = render.gbuffer(scene, sensor, albedo=albedo)
        mask = g.mask.numpy()
        if not mask.any():
            raise SceneError(f"no pixel of scene {source} shows a surface; point its camera at one")
        label = name if n_sensors == 1 or not all_sensors else f"{name}, camera {sensor}"
        origin = _origin(scene, sensor, source) | {"frame": label}
        yield View(label, origin, scene, sensor, g, mask, _reach(source, g, radius))


def sources(given: Sequence[str]) -> dict[str, str]:
    """Name -> source of every scene; folders stand for the scenes and EXR files in them, and */scene.xml below.

    Raises:
        SceneError: a folder holds none, or a source is given twice.
    """
    found: list[str] = []
    for source in given:
        folder = Path(source)
        if source in render.scenes.names() or not folder.is_dir():
            found.append(source)
            continue
        inside = sorted(str(path) for pattern in ("*.xml", "*/scene.xml", "*.exr") for path in folder.glob(pattern))
        if not inside:
            raise SceneError(f"folder {source} holds no .xml scene and no .exr frame")
        found += inside
    return scene_names(found or render.scenes.names("procedural"))


def scenes_only(given: Sequence[str]) -> dict[str, str]:
    """:func:`sources`, of which none is an image.

    Raises:
        SceneError: a source is given twice, a folder holds no scene, or a source is an image, whose light is unknown.
    """
    found = sources(given)
    images = [source for source in found.values() if source.lower().endswith(".exr")]
    if images:
        raise SceneError(f"{images[0]} is an image; light is traced through scenes: give the scene that it shows")
    return found


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


def value_of(given: Any, scene: str) -> Any:
    """What a setting says of a scene: itself, or the entry of a mapping from names of scenes, None without one."""
    return given.get(scene) if isinstance(given, Mapping) else given


def all_values(given: Any) -> tuple[Any, ...]:
    """All that a setting says of any scene."""
    return tuple(given.values()) if isinstance(given, Mapping) else () if given is None else (given,)


def portable(sources: Sequence[str]) -> list[str]:
    """The sources as a record may hold them: files by names that mean something elsewhere."""
    embedded = render.scenes.names()
    return [source if source in embedded else io.portable(source) for source in sources]


def open_scene(source: str, resolution: int | None) -> tuple[Any, int]:
    """The scene at a resolution, and how many cameras it has.

    Raises:
        SceneError: it cannot be loaded or has no camera.
    """
    scene = render.load_scene(source, resolution=resolution)
    n_sensors = len(scene.sensors())
    if n_sensors == 0:
        raise SceneError(f"scene {source} has no sensor; add one, or choose another scene")
    return scene, n_sensors


def default_radius(g: GBuffer) -> float:
    """A tenth of the frame's height at the median depth, to two digits."""
    z = g.view_z.numpy()[g.mask.numpy()]
    height = g.shape[0] / g.camera.fy
    radius = 0.1 * height * (1.0 if g.camera.is_orthographic else float(np.median(z)))
    digits = 1 - math.floor(math.log10(radius))
    return round(radius, digits)


def _reach(source: str, g: GBuffer, given: float | None) -> float:
    """Radius for a frame: the given one, the embedded scene's own, or :func:`default_radius`."""
    if given is not None:
        return given
    return render.scenes.get(source).radius if source in render.scenes.names() else default_radius(g)


def _origin(scene: Any, sensor: int, source: str) -> dict[str, Any]:
    """What a record says of a view: where its scene comes from, with hashes of that and of what the camera sees."""
    view = render.fingerprint(scene, sensor)
    embedded = source in render.scenes.names()
    entry = {"path": f"embedded:{source}", "sha256": view} if embedded else io.file_entry(source)
    return entry | {"view": view}
