"""What moves in a sequence: a scene, the path of its camera, and the ways of its shapes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from gtao.errors import ConfigError

from .sequence_poses import matrix_of
from .sequence_stage import Stage, State, check_vertices

__all__ = ["Animation"]

#: Something for every frame, 0 to n_frames - 1: a function of the frame's number, or a list.
Path = Callable[[int], Any] | Sequence[Any]


def _length(path: Path | None) -> int | None:
    return None if path is None or callable(path) else len(path)


def _at(path: Path, frame: int) -> Any:
    return path(frame) if callable(path) else path[frame]


@dataclass(frozen=True, kw_only=True, eq=False)
class Animation:
    """A scene in motion, of which :func:`gtao.render.sequence` makes frames.

    Every state is given outright and not as a step from the last one, so that any frame can be made without those
    before it. Shapes of the scene are called by their ids, or by their number in ``mitsuba.Scene.shapes()``.

    Args:
        name: short, for files and reports.
        description: one line.
        radius: a sensible ambient-occlusion radius, in scene units.
        n_frames: number of frames.
        scene: the scene at rest: whatever :func:`gtao.render.load_scene` takes. It is loaded when first needed, without
            merging shapes, and then updated from frame to frame: a loaded ``mitsuba.Scene`` and shapes that come as
            objects are moved in place.
        camera: pose of the camera in each frame: 4x4 rigid matrix from view frame (+x right, +y up, looking along -z)
            to world, as of :func:`gtao.render.look_at`; a function of the frame's number or a list. None leaves the
            camera where the scene has it.
        movers: way of each moving shape: 4x4 rigid matrix in the world that is applied to the shape at rest, as of
            :func:`gtao.render.rigid`; functions of the frame's number or lists.
        deforming: vertices of each deforming mesh: (V, 3) in world space, as many as the mesh has and in its order;
            functions of the frame's number or lists. Vertex normals, if the mesh has them, are made anew.
        cut: first frame after a cut, at which the camera jumps; None without.

    Raises:
        ConfigError: the radius is not positive, there are no frames, a list is too short, or a shape is to move in
            two ways.
        ShapeError: a list holds a matrix that is not rigid, or vertices that are not (V, 3) finite numbers. Of
            functions, that is found when a frame is made.
    """

    name: str
    description: str
    radius: float
    n_frames: int
    scene: Any
    camera: Path | None = None
    movers: Mapping[str | int, Path] = field(default_factory=dict)
    deforming: Mapping[str | int, Path] = field(default_factory=dict)
    cut: int | None = None

    def __post_init__(self):
        if not self.radius > 0:
            raise ConfigError(f"the radius of an animation must be positive, got {self.radius}")
        if isinstance(self.n_frames, bool) or not isinstance(self.n_frames, int) or self.n_frames < 1:
            raise ConfigError(f"n_frames must be a whole number >= 1, got {self.n_frames!r}")
        if self.cut is not None and not 0 < self.cut < self.n_frames:
            raise ConfigError(f"a cut lies between two of the {self.n_frames} frames, got {self.cut}")
        twice = [key for key in self.movers if key in self.deforming]
        if twice:
            raise ConfigError(
                f"shape {twice[0]!r} cannot both move and deform; give the vertices of its way as a whole"
            )
        for what, path in self._paths():
            length = _length(path)
            if length is not None and length < self.n_frames:
                raise ConfigError(f"{what} has {length} entries for {self.n_frames} frames")
        self._check_lists()

    def _paths(self):
        yield "the camera's path", self.camera
        for key, path in (*self.movers.items(), *self.deforming.items()):
            yield f"the way of shape {key!r}", path

    def _check_lists(self) -> None:
        """Look at every entry that is there already: a wrong one is not to be found hours later."""
        for frame in range(_length(self.camera) or 0):
            self._camera(frame)
        for key, path in self.movers.items():
            for frame in range(_length(path) or 0):
                self._matrix(key, frame)
        for key, path in self.deforming.items():
            for frame in range(_length(path) or 0):
                self._vertices(key, frame)

    def _camera(self, frame: int) -> np.ndarray | None:
        return (
            None if self.camera is None else matrix_of(f"the camera's pose in frame {frame}", _at(self.camera, frame))
        )

    def _matrix(self, key: str | int, frame: int) -> np.ndarray:
        return matrix_of(f"the matrix of shape {key!r} in frame {frame}", _at(self.movers[key], frame))

    def _vertices(self, key: str | int, frame: int) -> np.ndarray:
        return check_vertices(f"the vertices of {key!r} in frame {frame}", _at(self.deforming[key], frame))

    @classmethod
    def from_scene(
        cls,
        scene: Any,
        *,
        radius: float,
        camera: Path | None = None,
        movers: Mapping[str | int, Path] | None = None,
        deforming: Mapping[str | int, Path] | None = None,
        n_frames: int | None = None,
        name: str = "animation",
        description: str = "",
        cut: int | None = None,
    ) -> "Animation":
        """An animation of any scene; parameters as for the class.

        ``n_frames`` may be left out where a list tells it: the shortest one does.

        Raises:
            ConfigError: as for the class; or nothing tells the number of frames.
            SceneError: the scene cannot be loaded, or has no such shape.
            ShapeError: as for the class; or a mesh in a list has another number of vertices than the scene's.
        """
        movers, deforming = dict(movers or {}), dict(deforming or {})
        if n_frames is None:
            paths = (camera, *movers.values(), *deforming.values())
            lengths = [length for length in map(_length, paths) if length is not None]
            if not lengths:
                raise ConfigError("nothing tells the number of frames; give n_frames, or a path as a list")
            n_frames = min(lengths)
        result = cls(
            name=name,
            description=description,
            radius=radius,
            n_frames=n_frames,
            scene=scene,
            camera=camera,
            movers=movers,
            deforming=deforming,
            cut=cut,
        )
        _ = result.stage  # what is wrong with the scene is said now, not at the first frame
        return result

    @property
    def static_camera(self) -> bool:
        """Whether the camera never moves."""
        return self.camera is None

    @property
    def static_scene(self) -> bool:
        """Whether nothing but the camera moves."""
        return not self.movers and not self.deforming

    @cached_property
    def stage(self) -> Stage:
        """The scene, loaded, with its moving parts at hand.

        Raises:
            SceneError: it cannot be loaded, or has no such shape.
            ShapeError: a mesh in a list has another number of vertices.
        """
        stage = Stage(self.scene, tuple(self.movers), tuple(self.deforming))
        for key, path in self.deforming.items():
            for frame in range(_length(path) or 0):
                stage.check_count(key, self._vertices(key, frame))
        return stage

    def state(self, frame: int) -> State:
        """Where camera and shapes are in a frame.

        Raises:
            ConfigError: there is no such frame.
            ShapeError: a matrix is not rigid, or the vertices of a mesh are not (V, 3) finite numbers.
        """
        if isinstance(frame, bool) or not isinstance(frame, int) or not 0 <= frame < self.n_frames:
            raise ConfigError(f"there is no frame {frame!r}: {self.name} has frames 0 to {self.n_frames - 1}")

        return State(
            self._camera(frame),
            {key: self._matrix(key, frame) for key in self.movers},
            {key: self._vertices(key, frame) for key in self.deforming},
        )

    def __repr__(self) -> str:
        return f"Animation({self.name}, {self.n_frames} frames, radius={self.radius:g})"
