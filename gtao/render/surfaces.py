"""Connected surfaces: which faces of a scene belong together, and which of the surfaces are closed.

A face is a triangle, or a whole analytic shape. Two faces that alone share an edge of one mesh are one surface, and so
are faces whose remaining edges lie in the same place. The shapes of the scene do not matter: files split one body by
its materials, put many bodies into one mesh and repeat the vertices of a crease.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

__all__ = ["Faces", "Surfaces", "cells", "connected", "faces_of"]

#: Points nearer than this share of the largest coordinate are one: a few roundings of a float32 transformation.
WELD = 2.0**-20


@dataclass(frozen=True)
class Faces:
    """Faces of a scene, F of them, with V vertices and E edges.

    Attributes:
        shape, prim: (F,) which shape it is of, and its number there.
        low, high: (F, 3) bounding box.
        point: (F, 3) a point of the face.
        normal: (F, 3) unit normal of flat faces, 0 of curved and of degenerate ones.
        rimmed: (F,) whether all edges of the face are known.
        vertex: (V, 3) ends of the edges; a round rim ends in the two points beside its centre, on its axis, at the
            distance of its radius.
        edge: (E, 2) vertices of each edge.
        edge_face: (E,) the face that an edge is of.
    """

    shape: np.ndarray
    prim: np.ndarray
    low: np.ndarray
    high: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    rimmed: np.ndarray
    vertex: np.ndarray
    edge: np.ndarray
    edge_face: np.ndarray


@dataclass(frozen=True)
class Surfaces:
    """Which surface each face is of, and whether each surface is closed (every edge has faces in pairs)."""

    of_face: np.ndarray
    closed: np.ndarray


def faces_of(shapes: Sequence[Any]) -> Faces:
    """The faces of Mitsuba shapes, in their order."""
    parts = [_triangles(i, s) if s.is_mesh() else _analytic(i, s) for i, s in enumerate(shapes)]

    def numbered(name: str, counted: str) -> np.ndarray:
        starts = np.cumsum([0] + [len(getattr(part, counted)) for part in parts])
        return np.concatenate([getattr(p, name) + s for p, s in zip(parts, starts[:-1], strict=True)])

    columns = {name: np.concatenate([getattr(part, name) for part in parts]) for name in Faces.__annotations__}
    columns |= {"edge": numbered("edge", "vertex"), "edge_face": numbered("edge_face", "prim")}
    return Faces(**columns)


def _triangles(index: int, mesh: Any) -> Faces:
    n = mesh.face_count()
    vertex = mesh.vertex_position(dr.arange(mi.UInt32, mesh.vertex_count())).numpy().T.astype(np.float64)
    face = mesh.face_indices(dr.arange(mi.UInt32, n)).numpy().T.astype(np.int64)
    corner = vertex[face]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return Faces(
        shape=np.full(n, index),
        prim=np.arange(n),
        low=corner.min(1),
        high=corner.max(1),
        point=corner[:, 0],
        normal=normal / np.where(length > 0, length, 1),
        rimmed=np.ones(n, bool),
        vertex=vertex,
        edge=np.stack([face, np.roll(face, -1, axis=1)], axis=2).reshape(-1, 2),
        edge_face=np.repeat(np.arange(n), 3),
    )


def _analytic(index: int, shape: Any) -> Faces:
    kind, box = shape.class_name(), shape.bbox()
    low, high = (np.array(p, dtype=np.float64) for p in (box.min, box.max))
    rims, normal, point = np.zeros((0, 3)), np.zeros(3), low
    if kind in ("Disk", "Cylinder"):
        matrix = np.array(mi.traverse(shape)["to_world"].matrix, dtype=np.float64).reshape(4, 4)
        axis = matrix[:3, 2] / np.linalg.norm(matrix[:3, 2])
        reach = np.linalg.norm(matrix[:3, 0]) * axis
        ends = [matrix[:3, 3]] if kind == "Disk" else [matrix[:3, 3], matrix[:3, 3] + matrix[:3, 2]]
        rims = np.concatenate([(centre - reach, centre + reach) for centre in ends])
        if kind == "Disk":
            normal, point = axis, ends[0]
    return Faces(
        shape=np.array([index]),
        prim=np.array([0]),
        low=low.reshape(1, 3),
        high=high.reshape(1, 3),
        point=point.reshape(1, 3),
        normal=normal.reshape(1, 3),
        rimmed=np.array([kind in ("Disk", "Cylinder", "Sphere")]),
        vertex=rims,
        edge=np.arange(len(rims)).reshape(-1, 2),
        edge_face=np.zeros(len(rims) // 2, int),
    )


def connected(faces: Faces) -> Surfaces:
    """Put faces together that share edges: first by the mesh, then by the place of the edges left over."""
    ends = np.sort(faces.edge, axis=1)
    edge = numbers(ends[:, 0] * (ends.max(initial=0) + 1) + ends[:, 1])
    paired = (np.bincount(edge) == 2)[edge] if len(edge) else np.zeros(0, bool)
    # By the mesh's own vertices, bodies that merely touch along an edge stay apart.
    pair = np.flatnonzero(paired)[np.argsort(edge[paired], kind="stable")].reshape(-1, 2)

    rest = faces.edge[~paired]
    used, rest = np.unique(rest, return_inverse=True)
    ends = np.sort(_welded(faces.vertex[used])[rest.reshape(-1, 2)], axis=1) if len(used) else rest.reshape(-1, 2)
    face = faces.edge_face[~paired]
    whole = ends[:, 0] != ends[:, 1]  # the short side of a sliver is no edge
    ends, face = ends[whole], face[whole]
    place = numbers(ends[:, 0] * (ends.max(initial=0) + 1) + ends[:, 1])
    leader = np.zeros(place.max(initial=-1) + 1, int)
    leader[place] = face

    a = np.concatenate([faces.edge_face[pair[:, 0]], face])
    b = np.concatenate([faces.edge_face[pair[:, 1]], leader[place]])
    label = numbers(_joined(len(faces.prim), a, b))
    closed = np.ones(label.max(initial=-1) + 1, bool)
    closed[label[~faces.rimmed]] = False
    odd = np.bincount(place) % 2 == 1
    closed[label[leader[odd]]] = False
    return Surfaces(label, closed)


def numbers(key: np.ndarray) -> np.ndarray:
    """Equal keys -> equal numbers, counted from 0."""
    return np.unique(key, return_inverse=True)[1].reshape(-1)


def cells(rows: np.ndarray) -> np.ndarray:
    """Equal rows of whole numbers -> equal numbers, counted from 0; a 64-bit hash stands for a row."""
    mixed = np.zeros(len(rows), np.uint64)
    for column in rows.T:
        mixed = (mixed ^ column.astype(np.int64).view(np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    return numbers(mixed)


def _welded(points: np.ndarray) -> np.ndarray:
    """Number of each of the points (n, 3), the same for points nearer than the tolerance."""
    scaled = points / (WELD * max(np.abs(points).max(), np.finfo(float).tiny))
    # A pair that straddles a border of one lattice lies within a cell of the other, half a cell beside it.
    first, second = cells(np.round(scaled)), cells(np.floor(scaled))
    leader = np.zeros(second.max() + 1, int)
    leader[second] = first
    return _joined(first.max() + 1, first, leader[second])[first]


def _joined(n: int, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Smallest number that each of ``n`` things is joined to, when a[i] is joined to b[i]."""
    label = np.arange(n)
    while True:
        least = np.minimum(label[a], label[b])
        joined = label.copy()
        for end in (a, b):
            np.minimum.at(joined, label[end], least)
        while not np.array_equal(joined, joined[joined]):
            joined = joined[joined]
        if np.array_equal(joined, label):
            return label
        label = joined
