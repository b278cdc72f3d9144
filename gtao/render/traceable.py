"""A scene taken apart so that rays can be followed through all of it."""

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from .contacts import colours
from .scenes.mesh import mesh
from .scenes.surface import Surface
from .surfaces import Faces, Surfaces, connected, faces_of

__all__ = ["Traceable", "identity"]

#: Extent of a large surface, diagonal over diagonal of the bounding boxes.
LARGE = 0.5


class Traceable:
    """A scene in parts whose surfaces do not lie on each other, each of which can be traced.

    Attributes:
        closed: (S,) whether each connected surface is closed.
        large: (S,) whether its extent is half of that of the scene or more.
        parts: ``(scene, ids, first, surface)``: Mitsuba scene; the registry's numbers of its shapes, sorted; where the
            faces of each begin in ``surface``, which holds the connected surface of every face.
    """

    def __init__(self, scene: Any):
        shapes = list(scene.shapes())
        faces = faces_of(shapes)
        surfaces = connected(faces)
        self.closed, self.large = surfaces.closed, _large(faces, surfaces)
        # The shapes of a group live outside of the scene, and with them the instances cannot be moved to another.
        divisible = all(shape.class_name() != "Instance" for shape in shapes)
        colour = colours(faces, surfaces)[surfaces.of_face] if divisible else np.zeros(len(faces.prim), int)
        bounds = np.searchsorted(faces.shape, np.arange(len(shapes) + 1))
        self.parts = []
        for c in range(colour.max(initial=-1) + 1):
            pieces, labels = [], []
            for i, shape in enumerate(shapes):
                face = np.arange(bounds[i], bounds[i + 1])
                own = face[colour[face] == c]
                if len(own):
                    pieces.append(shape if len(own) == len(face) else _subset(shape, faces.prim[own]))
                    labels.append(surfaces.of_face[own])
            named = {f"piece{k}": piece for k, piece in enumerate(pieces)}
            part = mi.load_dict({"type": "scene", **named}) if colour.any() else scene
            ids = np.array([identity(mi.ShapePtr(piece)).numpy()[0] for piece in pieces])
            order = np.argsort(ids)
            labels = [labels[k] for k in order]
            first = np.cumsum([0] + [len(label) for label in labels[:-1]])
            self.parts.append((part, ids[order], first, np.concatenate(labels)))


def _large(faces: Faces, surfaces: Surfaces) -> np.ndarray:
    low, high = (np.full((len(surfaces.closed), 3), v) for v in (np.inf, -np.inf))
    np.minimum.at(low, surfaces.of_face, faces.low)
    np.maximum.at(high, surfaces.of_face, faces.high)
    extent = np.linalg.norm(high - low, axis=1)
    return extent >= LARGE * np.linalg.norm(high.max(0) - low.min(0))


def _subset(shape: Any, prims: np.ndarray) -> Any:
    """A mesh of some triangles of another, with their geometric normals."""
    vertex = shape.vertex_position(dr.arange(mi.UInt32, shape.vertex_count())).numpy().T
    face = shape.face_indices(dr.arange(mi.UInt32, shape.face_count())).numpy().T[prims]
    if shape.has_flipped_normals():
        face = face[:, ::-1]
    return mesh(Surface(vertex, face), 0.5)


def identity(shape: Any) -> Any:
    """The registry's numbers of an array of shapes; 0 is no shape."""
    return dr.reinterpret_array(mi.UInt32, shape)
