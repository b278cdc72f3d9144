"""What a frame shows and the frame before did not, by rays in the scene as it was then."""

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from .motion import Before
from .primary import PrimaryHits
from .sensor import rotation
from .sequence_poses import inverse
from .sequence_stage import Stage, State

__all__ = ["disoccluded"]


def disoccluded(hits: PrimaryHits, before: Before, stage: Stage, state: State, pose: np.ndarray) -> Any:
    """Whether the surface behind each pixel centre was hidden in the frame before.

    It was if its point was outside of the frame or nearer than the near plane, if the camera saw its other side, or if
    a ray from the camera to it meets something else. Where the background shows, the ray goes on without end.

    Args:
        hits, before: the frame and where its points were.
        stage: whose scene it is; it may be in any state.
        state, pose: the frame before: what was where, and the matrix from view frame to world of its camera.

    Returns:
        Bool of ``width * height``.
    """
    camera, valid = hits.camera, hits.valid
    eye, near = mi.Point3f(pose[:3, 3]), dr.opaque(mi.Float, camera.near)
    dr.make_opaque(eye)
    p, n = mi.Point3f(before.position_w), mi.Normal3f(before.normal_w)
    back = rotation(pose) @ mi.Vector3f(0, 0, 1)
    inside = before.ahead & (before.view_z >= near)
    inside &= (before.x >= 0) & (before.x < camera.width) & (before.y >= 0) & (before.y < camera.height)
    if camera.is_orthographic:
        x = dr.opaque(mi.Float, 1 / camera.fx) * (before.x - dr.opaque(mi.Float, camera.cx))
        y = dr.opaque(mi.Float, 1 / camera.fy) * (dr.opaque(mi.Float, camera.cy) - before.y)
        away, distance = -back, before.view_z
        start = dr.select(valid, p + back * (distance - near), eye + rotation(pose) @ mi.Vector3f(x, y, -near))
        reach = distance - near
    else:
        away = dr.select(valid, p - eye, mi.Vector3f(p))
        distance = dr.norm(away)
        away /= distance
        start = eye + away * (near / -dr.dot(away, back))
        reach = distance * (1 - near / before.view_z)
    # Rays end before the surface, as those that start on one do after it: by Mitsuba's offset along the normal. They
    # come from the camera, for which a point in a crevice is as visible as any other.
    facing = -dr.dot(n, away)
    offset = mi.math.RayEpsilon * (1 + dr.max(dr.abs(p)))
    seen = valid & inside & (facing > 0)
    ray = mi.Ray3f(start, away)
    ray.maxt = dr.select(valid, reach - offset / dr.select(seen, facing, 1), dr.inf)
    active = seen | (~valid & inside)
    hidden = mi.Bool(False) if stage.static is None else stage.static.ray_test(ray, active=active)
    for key, (solid, mover) in stage.solids.items():
        at_rest = ray
        if key in state.movers:
            at_rest = _taken(ray, inverse(state.movers[key]))
        elif mover.deform(state.deforming[key]):
            mover.update()
        hidden |= solid.ray_test(at_rest, active=active & ~hidden)
    result = ~active | hidden
    dr.eval(result)
    return result


def _taken(ray: Any, matrix: np.ndarray) -> Any:
    """A ray taken along by a rigid matrix; lengths stay."""
    offset = mi.Vector3f(matrix[:3, 3])
    dr.make_opaque(offset)
    turn = rotation(matrix)
    result = mi.Ray3f(ray)
    result.o, result.d = turn @ ray.o + offset, turn @ ray.d
    return result
