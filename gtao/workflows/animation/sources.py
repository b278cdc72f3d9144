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
        """First frame after a cut, None where there is none."""
        return self.animation.cut


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
    info = render.animations.get(name)
    n_frames = config.frames or info.n_frames
    # A cut lies at half of the frames, however many they are.
    options = {} if info.cut is None else {"n_frames": n_frames}
    animation = render.animations.build(name, width=config.resolution, height=height, **options)
    return Source(replace(animation, n_frames=n_frames), n_frames, {"path": f"embedded:{name}"})


def _of_scene(config: AnimateConfig) -> Source:
    name = config.animation
    embedded = name in render.scenes.names()
    moves = {} if config.path is None else read_path(Path(config.path))
    n_frames = config.frames or N_FRAMES if config.path is None else _n_frames(moves, config)
    scene, _ = open_scene(name, config.resolution)
    g = render.gbuffer(scene, albedo=False)
    if not g.mask.numpy().any():
        raise SceneError(f"no pixel of scene {name} shows a surface; point its camera at one")
    if config.orbit is not None:
        moves = {"camera": _orbit(scene, g, config, "z" if embedded else "y")}
    radius = config.radius or (render.scenes.get(name).radius if embedded else default_radius(g))
    told = {"name": name if embedded else Path(name).stem, "description": _description(config)}
    # Loaded anew: shapes that were merged could not be moved.
    scene = render.load_scene(name, resolution=config.resolution, merge=False)
    if "movers" in moves:
        moves["movers"] = _by_number(moves["movers"], {shape.id() for shape in scene.shapes()})
    try:
        animation = render.Animation.from_scene(scene, radius=radius, n_frames=n_frames, **moves, **told)
    except GtaoError as cause:
        if config.path is None:
            raise
        raise ConfigError(f"path {config.path}: {cause}") from None
    origin = {"path": f"embedded:{name}"} if embedded else io.file_entry(name)
    origin |= {"moved_by": io.file_entry(config.path)} if config.path is not None else {}
    return Source(animation, n_frames, origin)


def _n_frames(moves: Mapping[str, Any], config: AnimateConfig) -> int:
    """How many frames were asked for, or else what all lists of a path agree on."""
    ways = {"camera": moves.get("camera")} | {f"mover {name!r}": way for name, way in moves.get("movers", {}).items()}
    lengths = {name: len(way) for name, way in ways.items() if way is not None}
    if config.frames is not None:
        return config.frames
    if not lengths:
        raise ConfigError(f"path {config.path} has no list of matrices to tell the number of frames; give --frames")
    if len(set(lengths.values())) > 1:
        told = ", ".join(f"{name} has {n}" for name, n in lengths.items())
        raise ConfigError(
            f"path {config.path} has lists of different lengths: {told}; make them equal, or give --frames"
        )
    return next(iter(lengths.values()))


def _by_number(movers: Mapping[str, Any], ids: set[str]) -> dict[str | int, Any]:
    """Movers by ids of shapes, or by their numbers: keys of JSON are text, so that "0" may be either."""
    return {
        int(key) if key not in ids and key.isdecimal() and str(int(key)) == key else key: way
        for key, way in movers.items()
    }


def _description(config: AnimateConfig) -> str:
    if config.path is not None:
        return f"a scene moved by {Path(config.path).name}"
    return "a scene at rest" if config.orbit is None else f"a camera that goes {config.orbit:g} degrees around a scene"


def read_path(path: Path) -> dict[str, Any]:
    """How a file moves a scene, as arguments of :meth:`gtao.render.Animation.from_scene`.

    The file is a JSON object: ``"camera"`` holds a 4x4 matrix from view frame to world for every frame, ``"movers"``
    an object of such lists by the ids of shapes, or by their numbers where no shape has that id, each of which is
    applied to the shape at rest, ``"cut"`` the first frame after a cut. All are optional.

    Raises:
        ConfigError: the file cannot be read, or holds something else.
    """
    try:
        content = read_json(path, "path", advice="mend the file")
    except GtaoError as cause:
        raise ConfigError(str(cause)) from None
    if not isinstance(content, dict) or not content or content.keys() - {"camera", "movers", "cut"}:
        raise ConfigError(f"path {path} must hold an object with camera, movers or cut, see `gtao animate --help`")
    movers = content.get("movers", {})
    if not isinstance(movers, Mapping) or not isinstance(content.get("camera", [None]), list):
        raise ConfigError(f"path {path}: camera must be a list of matrices, movers an object of such lists")
    if not all(isinstance(way, list) for way in movers.values()):
        raise ConfigError(f"path {path}: every mover must be a list of matrices, one per frame")
    if not all([content.get("camera", [None]), *movers.values()]):
        raise ConfigError(f"path {path} has an empty list; give a matrix for every frame, or leave it out")
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
