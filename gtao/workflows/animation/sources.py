"""What moves: an embedded animation, or a scene whose camera or shapes a file or a number moves."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from gtao import io, render
from gtao.errors import ConfigError, GtaoError, SceneError
from gtao.io.jsontext import read_json
from gtao.workflows.views import default_radius, open_scene

from .settings import AnimateConfig

__all__ = ["Source", "read_path", "source_of"]

#: Frames of a scene, where nothing says how many.
N_FRAMES = 48
#: Width over height of embedded animations.
_ASPECT = 4 / 3
#: Axis that points upward in a scene: in embedded ones, and in files.
_UP = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


@dataclass(frozen=True, eq=False)
class Source:
    """What is to be shown.

    Attributes:
        animation: a :class:`gtao.render.Animation`.
        n_frames: how many of its frames.
        origin: what a record says of where it comes from.
    """

    animation: Any
    n_frames: int
    origin: dict[str, Any]

    @property
    def cut(self) -> int | None:
        """First frame after a cut, None where there is none among the frames."""
        cut = self.animation.cut
        return cut if cut is not None and cut < self.n_frames else None


def source_of(config: AnimateConfig) -> Source:
    """The animation that the settings name.

    Raises:
        SceneError: there is no such animation or scene, it cannot be loaded, or has no such shape.
        ConfigError: a path is for an embedded animation, is no path, or nothing shows a surface to go around.
    """
    name = config.animation
    if name in render.animations.names():
        return _embedded(config)
    if name not in render.scenes.names() and not name.lower().endswith(".xml") and not Path(name).exists():
        known = ", ".join(render.animations.names())
        raise ConfigError(f"there is no animation or scene {name!r}; animations are {known}; see also `gtao scenes`")
    return _of_scene(config)


def _embedded(config: AnimateConfig) -> Source:
    name = config.animation
    if config.path is not None or config.orbit is not None:
        raise ConfigError(f"animation {name!r} moves by itself; leave path and orbit out, or name a scene")
    height = round(config.resolution / _ASPECT)
    animation = render.animations.build(name, width=config.resolution, height=height)
    n_frames = config.frames or animation.n_frames
    if n_frames > animation.n_frames:
        animation = replace(animation, n_frames=n_frames)
    return Source(animation, n_frames, {"path": f"embedded:{name}"})


def _of_scene(config: AnimateConfig) -> Source:
    name = config.animation
    embedded = name in render.scenes.names()
    moves = read_path(Path(config.path)) if config.path is not None else {}
    scene, _ = open_scene(name, config.resolution)
    g = render.gbuffer(scene, albedo=False)
    if not g.mask.numpy().any():
        raise SceneError(f"no pixel of scene {name} shows a surface; point its camera at one")
    if config.orbit is not None:
        moves = {"camera": _orbit(scene, g, config, "z" if embedded else "y")}
    radius = config.radius or (render.scenes.get(name).radius if embedded else default_radius(g))
    told = {"name": name if embedded else Path(name).stem, "description": _description(config)}
    listed = config.path is not None and config.frames is None
    # Loaded anew: shapes that were merged could not be moved.
    scene = render.load_scene(name, resolution=config.resolution, merge=False)
    n_frames = None if listed else config.frames or N_FRAMES
    animation = render.Animation.from_scene(scene, radius=radius, n_frames=n_frames, **moves, **told)
    origin = {"path": f"embedded:{name}"} if embedded else io.file_entry(name)
    origin |= {"moved_by": io.file_entry(config.path)} if config.path is not None else {}
    return Source(animation, animation.n_frames, origin)


def _description(config: AnimateConfig) -> str:
    if config.path is not None:
        return f"a scene moved by {Path(config.path).name}"
    return "a scene at rest" if config.orbit is None else f"a camera that goes {config.orbit:g} degrees around a scene"


def read_path(path: Path) -> dict[str, Any]:
    """How a file moves a scene, as arguments of :meth:`gtao.render.Animation.from_scene`.

    The file is a JSON object: ``"camera"`` holds a 4x4 matrix from view frame to world for every frame, ``"movers"``
    an object of such lists by the ids of shapes, each of which is applied to the shape at rest, ``"cut"`` the first
    frame after a cut. All are optional.

    Raises:
        ConfigError: the file cannot be read, or holds something else.
    """
    try:
        content = read_json(path, "path")
    except GtaoError as cause:
        raise ConfigError(str(cause)) from None
    if not isinstance(content, dict) or not content or content.keys() - {"camera", "movers", "cut"}:
        raise ConfigError(f"path {path} must hold an object with camera, movers or cut, see `gtao animate --help`")
    movers = content.get("movers", {})
    if not isinstance(movers, Mapping) or not isinstance(content.get("camera", []), list):
        raise ConfigError(f"path {path}: camera must be a list of matrices, movers an object of such lists")
    if not all(isinstance(way, list) for way in movers.values()):
        raise ConfigError(f"path {path}: every mover must be a list of matrices, one per frame")
    cut = content.get("cut")
    if cut is not None and (isinstance(cut, bool) or not isinstance(cut, int)):
        raise ConfigError(f"path {path}: cut must be the number of a frame, got {cut!r}")
    return content


def _orbit(scene: Any, g: Any, config: AnimateConfig, up: str) -> Any:
    """The camera's way around what it looks at, in as many frames as there are."""
    assert config.orbit is not None
    pose = render.view_to_world(scene)
    z = float(np.median(g.view_z.numpy()[g.mask.numpy()]))
    about = pose[:3, 3] - z * pose[:3, 2]
    angle = math.radians(config.orbit) / (config.frames or N_FRAMES)
    return lambda frame: render.rigid(axis=_UP[config.up or up], angle=angle * frame, about=about) @ pose
