"""Where the surfaces that a frame shows were in the frame before, and how far they have moved on the image."""

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from gtao.camera.pose import previous_from_view
from gtao.kernels import motion as kernel
from gtao.tensors import scalar

from .primary import PrimaryHits
from .sensor import pixel_centre_rays, rotation
from .sequence_poses import inverse
from .sequence_stage import Stage, State, flat
from .traceable import identity

__all__ = ["Before", "trace_back"]


@dataclass
class Before:
    """The surface point behind every pixel centre, as it was in the frame before; arrays of ``width * height``.

    Attributes:
        motion: Array3f for ``motion`` of :class:`gtao.GBuffer`.
        x, y, view_z: pixel coordinates and depth then; of the background, whose depth is inf, of its direction.
        ahead: whether it was in front of the camera.
        position_w: world space; direction in the world of the background.
        normal_w: geometric normal then, on the side that this frame shows.
        moves: whether it is on a shape that moves or deforms.
    """

    motion: Any
    x: Any
    y: Any
    view_z: Any
    ahead: Any
    position_w: Any
    normal_w: Any
    moves: Any


def trace_back(hits: PrimaryHits, stage: Stage, now: State, before: State, pose_before: np.ndarray) -> Before:
    """Follow the points of a frame back into the one before (theory, eqs. (176), (190) and (191)).

    Args:
        hits: of the scene in its state ``now``.
        stage: whose scene it is.
        now, before: states of the two frames.
        pose_before: matrix from view frame to world of the camera then, as the sensor had it.
    """
    valid, camera = hits.valid, hits.camera
    view_z = dr.detach(hits.view_z)
    matrices = [np.eye(4)]
    for key in stage.movers:
        still = np.array_equal(now.movers[key], before.movers[key])
        matrices.append(np.eye(4) if still else before.movers[key] @ inverse(now.movers[key]))
    slot = _slots(hits, stage)
    # The camera's own motion of shapes that deform; what their vertices add comes below.
    rigid = dr.select(slot < len(matrices), slot, 0)
    rows = _gathered(np.stack([_view_rows(pose_before, m @ hits.view_to_world) for m in matrices]), rigid)
    back = _gathered(np.stack([m[:3] for m in matrices]), rigid)
    p, n = mi.Vector3f(dr.detach(hits.si.p)), mi.Vector3f(dr.detach(hits.n_geo_w))
    ray = pixel_centre_rays(hits.sensor)
    position = mi.Vector3f(*(dr.fma(r[0], p.x, dr.fma(r[1], p.y, dr.fma(r[2], p.z, r[3]))) for r in back))
    normal = mi.Vector3f(*(dr.fma(r[0], n.x, dr.fma(r[1], n.y, r[2] * n.z)) for r in back))
    still = np.array_equal(pose_before, hits.view_to_world) & np.array([np.array_equal(m, np.eye(4)) for m in matrices])
    unmoved = dr.gather(mi.Bool, dr.opaque(mi.Bool(still)), rigid)
    if stage.deforming:
        moved, bent, same = _deformed(hits, ray, stage, now, before, slot - len(matrices))
        position += moved
        moved_v = rotation(pose_before.T) @ moved
        rows = [[*row[:3], row[3] + moved_v[i]] for i, row in enumerate(rows)]
        normal = dr.select(dr.squared_norm(bent) > 0, bent, normal)
        unmoved &= same
    index = dr.arange(mi.UInt32, camera.width * camera.height)
    row = index // camera.width
    x, y = mi.Float(index - row * camera.width) + 0.5, mi.Float(row) + 0.5
    numbers = (scalar(getattr(camera, name), mi.Float) for name in ("fx", "fy", "cx", "cy"))
    view = kernel.View(*numbers, orthographic=camera.is_orthographic)
    # What does not move, moves by 0 and not by a rounding.
    motion = mi.Vector3f(*(dr.select(unmoved, 0, m) for m in kernel.motion(x, y, view_z, view, view, rows)))
    px, py, pz, ahead = kernel.reprojected(x, y, view_z, view, view, rows)
    position = dr.select(valid, position, mi.Vector3f(dr.detach(ray.d)))
    result = Before(motion, px, py, pz, ahead, position, normal, slot > 0)
    dr.eval(vars(result))
    return result


def _view_rows(pose_before: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """(3, 4) map from a view frame, taken along by what moves, to that of the pose before."""
    return np.array(previous_from_view(pose_before.tolist(), moved.tolist()))


def _gathered(matrices: np.ndarray, slot: Any) -> list[list[Any]]:
    """Entries, row by row, of the matrix of every lane."""
    entries = flat(matrices)
    _, n_rows, n_columns = matrices.shape
    first = slot * (n_rows * n_columns)
    return [
        [dr.gather(mi.Float, entries, first + (i * n_columns + j)) for j in range(n_columns)] for i in range(n_rows)
    ]


def _slots(hits: PrimaryHits, stage: Stage) -> Any:
    """Which of the moving shapes each pixel shows, counted from 1; 0 is all the rest."""
    if not stage.moved:
        return dr.zeros(mi.UInt32, dr.width(hits.view_z))
    ids = np.array([identity(mi.ShapePtr(mover.shape)).numpy()[0] for mover in stage.moved.values()])
    table = np.zeros(ids.max() + 1, dtype=np.uint32)
    table[ids] = 1 + np.arange(len(ids))
    shape = identity(hits.si.shape)
    known = dr.opaque(mi.UInt32(table))
    return dr.gather(mi.UInt32, known, shape, hits.valid & (shape < dr.opaque(mi.UInt32, len(table))))


def _deformed(
    hits: PrimaryHits, ray: Any, stage: Stage, now: State, before: State, number: Any
) -> tuple[Any, Any, Any]:
    """How far back deforming surfaces have moved in the world, their normal then (0 elsewhere), and what stayed.

    ``number`` is that of the deforming mesh; others have numbers beyond them.
    """
    found = stage.scene.ray_intersect_preliminary(ray, coherent=True)
    moved, normal, same = dr.zeros(mi.Vector3f), dr.zeros(mi.Vector3f), mi.Bool(True)
    b1, b2 = found.prim_uv.x, found.prim_uv.y
    for k, (key, mover) in enumerate(stage.deforming.items()):
        here = number == k
        same &= ~here | bool(np.array_equal(now.deforming[key], before.deforming[key]))
        corner = mover.shape.face_indices(found.prim_index, here)
        a, b, c = _corners(before.deforming[key] - now.deforming[key], corner, here)
        moved = dr.select(here, dr.fma(1 - b1 - b2, a, dr.fma(b1, b, b2 * c)), moved)
        flats = [_normal(_corners(vertices[key], corner, here)) for vertices in (now.deforming, before.deforming)]
        facing = dr.dot(flats[0], dr.detach(hits.n_geo_w)) > 0
        normal = dr.select(here, dr.select(facing, flats[1], -flats[1]), normal)
    return moved, normal, same


def _corners(vertices: np.ndarray, corner: Any, active: Any) -> list[Any]:
    coordinates = flat(vertices)
    return [
        mi.Vector3f(*(dr.gather(mi.Float, coordinates, index * 3 + axis, active) for axis in range(3)))
        for index in corner
    ]


def _normal(corners: list[Any]) -> Any:
    a, b, c = corners
    return dr.cross(b - a, c - a)
