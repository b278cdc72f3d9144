"""Scenes from files, dictionaries, names and Mitsuba objects."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mitsuba as mi

from gtao.errors import SceneError

from . import scenes
from .variant import ensure_variant

__all__ = ["load_scene", "select_sensor"]

Resolution = int | tuple[int, int]


def _one_line(error: Exception) -> str:
    """Mitsuba's message without the source line of its parser, on one line."""
    text = " ".join(str(error).split())
    if text.startswith("[") and "] " in text:
        text = text.split("] ", 1)[1]
    return text


def _load(loader: Any, what: str, source: Any, merge: bool) -> Any:
    try:
        scene = loader(source, optimize=merge)
    except Exception as error:
        raise SceneError(f"cannot load {what}: {_one_line(error)}") from None
    if not isinstance(scene, mi.Scene):
        raise SceneError(f"{what} describes a {type(scene).__name__}, not a scene; put it inside one")
    return scene


def _load_path(path: Path, merge: bool) -> Any:
    if not path.exists():
        raise SceneError(f"no scene file {path}")
    if path.is_dir():
        raise SceneError(f"{path} is a directory; give the scene's .xml file")
    return _load(mi.load_file, f"scene {path}", os.fspath(path), merge)


def _load_text(source: str, resolution: Resolution | None, merge: bool) -> Any:
    if source in scenes.names():
        size = {}
        if resolution is not None:
            size = dict(zip(("width", "height"), _target_size(resolution, [1, 1]), strict=True))
        return _load(mi.load_dict, f"embedded scene {source}", scenes.build(source, **size), merge)
    path = Path(source)
    if path.suffix or path.exists() or os.sep in source:
        return _resized(_load_path(path, merge), resolution)
    raise SceneError(
        f"no embedded scene is called {source!r}; give a Mitsuba .xml file or one of: {', '.join(scenes.names())}"
    )


def load_scene(source: Any, *, resolution: Resolution | None = None, merge: bool = True) -> Any:
    """A Mitsuba scene from whatever describes one.

    Args:
        source: path of a Mitsuba XML file, name of an embedded scene (see :mod:`gtao.render.scenes`),
            dictionary as for ``mitsuba.load_dict``, or a loaded ``mitsuba.Scene``, which is returned as is.
        resolution: image size for all sensors instead of their own: ``(width, height)`` in pixels, or one
            number for the longer side with the aspect ratio kept. Horizontal fields of view stay as they are.
            Not for a loaded scene, whose sensors belong to the caller.
        merge: let Mitsuba put meshes of one material into one, as it does by itself. With False every shape stays
            what it is, so that shapes can be found by their ids and moved.

    Returns:
        ``mitsuba.Scene``.

    Raises:
        SceneError: the file is missing or broken, the name unknown, or the source describes no scene.
        BackendError: there is no usable backend.
    """
    ensure_variant()
    if isinstance(source, mi.Scene):
        if resolution is not None:
            raise SceneError("resolution cannot change a loaded scene; set the film size of its sensors instead")
        return source
    if isinstance(source, str):
        return _load_text(source, resolution, merge)
    if isinstance(source, os.PathLike):
        return _resized(_load_path(Path(source), merge), resolution)
    if isinstance(source, Mapping):
        return _resized(_load(mi.load_dict, "scene dictionary", dict(source), merge), resolution)
    raise SceneError(f"a scene is a path, a name, a dictionary or a mitsuba.Scene, got {type(source).__name__}")


def _target_size(resolution: Resolution, crop: list[int]) -> list[int]:
    sides = tuple(resolution) if isinstance(resolution, tuple | list) else (resolution,)
    if len(sides) not in (1, 2) or not all(isinstance(side, int) and side > 0 for side in sides):
        raise SceneError(f"resolution must be a positive number of pixels or (width, height), got {resolution!r}")
    if len(sides) == 2:
        return list(sides)
    return [max(1, round(sides[0] * side / max(crop))) for side in crop]


def _resized(scene: Any, resolution: Resolution | None) -> Any:
    """Change the size of every crop window, and of the film around it in proportion."""
    for sensor in scene.sensors() if resolution is not None else ():
        parameters: Any = mi.traverse(sensor)
        film, crop, offset = (
            [int(v) for v in parameters[f"film.{name}"]] for name in ("size", "crop_size", "crop_offset")
        )
        target = _target_size(resolution, crop)
        scaled = [round(f * t / c) for f, t, c in zip(film, target, crop, strict=True)]
        parameters["film.size"] = scaled
        parameters["film.crop_size"] = target
        parameters["film.crop_offset"] = [
            min(f - t, round(o * t / c)) for f, o, t, c in zip(scaled, offset, target, crop, strict=True)
        ]
        parameters.update()
    return scene


def select_sensor(scene: Any, sensor: Any = 0) -> Any:
    """The sensor with an index, counted from 0 in the scene's order; a ``mitsuba.Sensor`` stands for itself.

    Raises:
        SceneError: the scene has no such sensor.
    """
    if not isinstance(scene, mi.Scene):
        raise SceneError(f"expected a mitsuba.Scene (see gtao.render.load_scene), got {type(scene).__name__}")
    if isinstance(sensor, mi.Sensor):
        return sensor
    if isinstance(sensor, bool) or not isinstance(sensor, int):
        raise SceneError(f"sensor must be an index or a mitsuba.Sensor, got {sensor!r}")
    available = scene.sensors()
    if not available:
        raise SceneError("the scene has no sensor; add one or pass a mitsuba.Sensor")
    if not 0 <= sensor < len(available):
        have = "one sensor, number 0" if len(available) == 1 else f"sensors 0 to {len(available) - 1}"
        raise SceneError(f"there is no sensor {sensor}: the scene has {have}")
    return available[sensor]
