"""One loaded scene whose camera and shapes are put where a frame wants them."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from gtao.errors import SceneError, ShapeError

from .fingerprint import feed
from .loading import load_scene
from .scenes.mesh import mesh
from .scenes.surface import Surface
from .sensor import camera_from_sensor, pose_matrix, scale_of

__all__ = ["Stage", "State", "check_vertices", "flat"]

#: Mitsuba's shapes without vertices that a rigid matrix can move, and the names of their plugins.
ANALYTIC = {"Sphere": "sphere", "Rectangle": "rectangle", "Disk": "disk", "Cylinder": "cylinder"}

Key = str | int


@dataclass(frozen=True, eq=False)
class State:
    """Where things are in one frame.

    Attributes:
        camera: 4x4 pose; None for that of the scene.
        movers: 4x4 matrix of each moving shape.
        deforming: (V, 3) vertices of each deforming mesh.
    """

    camera: np.ndarray | None
    movers: Mapping[Key, np.ndarray]
    deforming: Mapping[Key, np.ndarray]

    def same(self, other: "State | None") -> bool:
        """Whether nothing differs between two states of one animation."""
        if other is None:
            return False
        pairs = [(self.camera, other.camera)]
        pairs += [(self.movers[k], other.movers[k]) for k in self.movers]
        pairs += [(self.deforming[k], other.deforming[k]) for k in self.deforming]
        return all(a is b or np.array_equal(a, b) for a, b in pairs)


def flat(values: np.ndarray) -> Any:
    """Numbers as a Dr.Jit float of their own: NumPy's memory would be aliased, and its alignment part of kernels."""
    return dr.opaque(mi.Float(np.ascontiguousarray(values, dtype=np.float32).ravel()))


def check_vertices(name: str, value: Any) -> np.ndarray:
    """Vertices as (V, 3) float64.

    Raises:
        ShapeError: they are something else, or not finite.
    """
    vertices = np.asarray(value, dtype=np.float64)
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise ShapeError(f"{name} must have shape (V, 3), got {vertices.shape}")
    if not np.isfinite(vertices).all():
        raise ShapeError(f"{name} hold numbers that are not finite")
    return vertices


class _Mover:
    """One shape of the scene, how it is put elsewhere, and how it was at rest."""

    def __init__(self, shape: Any, parameters: Any):
        self.shape, self._parameters = shape, parameters
        properties = parameters.properties.items()
        self._keys = {name.rpartition(".")[2]: name for name, entry in properties if entry[2] is shape}
        self._now: np.ndarray | None = None
        if self.is_mesh:
            self.vertices = self._read("vertex_positions")
            self.faces = np.array(parameters[self._keys["faces"]], dtype=np.int64).reshape(-1, 3)
            self.normals = self._read("vertex_normals")
        elif shape.class_name() in ANALYTIC:
            self.to_world = np.array(parameters[self._keys["to_world"]].matrix, dtype=np.float64).reshape(4, 4)

    @property
    def is_mesh(self) -> bool:
        return "vertex_positions" in self._keys

    def _read(self, name: str) -> np.ndarray:
        return np.array(self._parameters[self._keys[name]], dtype=np.float64).reshape(-1, 3)

    def _write(self, name: str, values: np.ndarray) -> None:
        self._parameters[self._keys[name]] = flat(values)

    def move(self, matrix: np.ndarray) -> bool:
        """Put the shape where a matrix takes it from rest; whether it was not there."""
        if self._now is not None and np.array_equal(self._now, matrix):
            return False
        if self.is_mesh:
            self._write("vertex_positions", self.vertices @ matrix[:3, :3].T + matrix[:3, 3])
            if len(self.normals):
                # Given together with the positions, they are taken as they are and not made from the new positions.
                self._write("vertex_normals", self.normals @ matrix[:3, :3].T)
        else:
            self._parameters[self._keys["to_world"]] = mi.Transform4f(matrix @ self.to_world)
        self._now = matrix
        return True

    def deform(self, vertices: np.ndarray) -> bool:
        """Put the mesh's vertices in their places; whether they were not there."""
        if self._now is not None and np.array_equal(self._now, vertices):
            return False
        self._write("vertex_positions", vertices)
        self._now = vertices
        return True

    def update(self) -> None:
        """Let the scene know."""
        self._parameters.update()

    def copy(self) -> Any:
        """A shape of its own with the same surface at rest, to be asked where rays meet it."""
        if self.is_mesh:
            return mesh(Surface(self.vertices, self.faces), 0.5)
        kind = ANALYTIC[self.shape.class_name()]
        return mi.load_dict({"type": kind, "to_world": mi.ScalarTransform4f(self.to_world)})


class Stage:
    """A loaded scene and its moving parts.

    Args:
        source: what :func:`gtao.render.load_scene` takes.
        movers: ids or numbers of the shapes that move, which are never two names of one.
        deforming: of the meshes that deform.

    Raises:
        SceneError: it cannot be loaded, there is no such shape, or one that cannot be moved.
    """

    def __init__(self, source: Any, movers: Sequence[Key], deforming: Sequence[Key]):
        self.scene = load_scene(source, merge=False)
        self._sensors: list[tuple[Any, np.ndarray]] = []
        shapes = {key: _shape(self.scene, key) for key in (*movers, *deforming)}
        self._parameters: Any = mi.traverse(self.scene) if shapes else None
        self.movers = {key: self._mover(key, shapes[key]) for key in movers}
        self.deforming = {key: self._mover(key, shapes[key], deforms=True) for key in deforming}
        moved = [mover.shape for mover in self.moved.values()]
        if any(a is b for i, a in enumerate(moved) for b in moved[:i]):
            raise SceneError("one shape is moved under two names; give its id or its number, not both")
        if moved and any(shape.class_name() == "Instance" for shape in self.scene.shapes()):
            raise SceneError("shapes cannot move in a scene with instances; put copies in their place")

    @property
    def moved(self) -> dict[Key, _Mover]:
        """All shapes that move or deform."""
        return self.movers | self.deforming

    @cached_property
    def static(self) -> Any:
        """Scene of the shapes that stay where they are; None if there is none."""
        moved = [mover.shape for mover in self.moved.values()]
        if not moved:
            return self.scene
        rest = [shape for shape in self.scene.shapes() if not any(shape is m for m in moved)]
        return mi.load_dict({"type": "scene", **{f"shape{i}": s for i, s in enumerate(rest)}}) if rest else None

    @cached_property
    def solids(self) -> dict[Key, tuple[Any, _Mover]]:
        """Each shape that moves or deforms at rest, alone in a scene of its own."""
        result = {}
        for key, mover in self.moved.items():
            scene = mi.load_dict({"type": "scene", "shape": mover.copy()}, optimize=False)
            result[key] = scene, _Mover(scene.shapes()[0], mi.traverse(scene))
        return result

    def put(self, state: State, sensor: Any) -> None:
        """Bring camera and shapes into a state.

        Raises:
            ShapeError: a mesh has another number of vertices.
        """
        self.look(state, sensor)
        changed = [self.movers[key].move(matrix) for key, matrix in state.movers.items()]
        for key, vertices in state.deforming.items():
            self.check_count(key, vertices)
            changed.append(self.deforming[key].deform(vertices))
        if any(changed):
            self._parameters.update()

    def check_count(self, key: Key, vertices: np.ndarray) -> None:
        """Vertices of a mesh that deforms are as many as it has.

        Raises:
            ShapeError: they are not.
        """
        expected = len(self.deforming[key].vertices)
        if len(vertices) != expected:
            raise ShapeError(f"shape {key!r} has {expected} vertices, got {len(vertices)}")

    def digest(self) -> str:
        """SHA-256 of all that the scene holds as it stands, materials and textures too, as 64 hexadecimal digits."""
        digest = hashlib.sha256()
        feed(digest, self.scene)
        return digest.hexdigest()

    def look(self, state: State, sensor: Any) -> np.ndarray:
        """Bring the camera alone into a state, and return where the sensor then stands (view frame to world)."""
        if state.camera is not None:
            parameters: Any = mi.traverse(sensor)
            parameters["to_world"] = mi.Transform4f(pose_matrix(state.camera, self._scale(sensor)))
            parameters.update()
        return camera_from_sensor(sensor)[1]

    def _scale(self, sensor: Any) -> np.ndarray:
        """Scale of a sensor at rest, which its poses keep; asked only once, so that it does not drift."""
        for known, scale in self._sensors:
            if known is sensor:
                return scale
        self._sensors.append((sensor, scale_of(sensor)))
        return self._sensors[-1][1]

    def _mover(self, key: Key, shape: Any, deforms: bool = False) -> _Mover:
        mover, kind = _Mover(shape, self._parameters), shape.class_name()
        if not mover.is_mesh and (deforms or kind not in ANALYTIC):
            what = "deform: only meshes do" if deforms else f"move: meshes and {', '.join(ANALYTIC.values())} do"
            raise SceneError(f"shape {key!r} is of the kind {kind} and cannot {what}")
        return mover


def _shape(scene: Any, key: Key) -> Any:
    """The shape with an id or a number.

    Raises:
        SceneError: there is none, or several have the id; the message lists what there is.
    """
    shapes = list(scene.shapes())
    found = [s for i, s in enumerate(shapes) if (i == key if isinstance(key, int) else s.id() == key)]
    if len(found) == 1:
        return found[0]
    known = ", ".join(f"{i}: {s.id() or 'without an id'} ({s.class_name()})" for i, s in enumerate(shapes[:20]))
    known += f" … {len(shapes)} in all" if len(shapes) > 20 else ""
    count = "there is no shape" if not found else f"{len(found)} shapes are called"
    raise SceneError(f"{count} {key!r}; give an id or number of: {known or 'no shapes'}")
