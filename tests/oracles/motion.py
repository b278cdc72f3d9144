"""Scenes of a few moving solids, cast and projected in double precision straight from the definitions.

A solid is given at rest in the world, with a matrix for each frame that takes it along; a camera is a view matrix and
the numbers that its pixels are made of. Nothing is known here of frames, kernels or renderers.
"""

from dataclasses import dataclass

import numpy as np


def turned(matrix, directions):
    return directions @ matrix[:3, :3].T


def moved(matrix, points):
    return turned(matrix, points) + matrix[:3, 3]


@dataclass
class Eye:
    """A camera: pixel (x, y) looks along ((x - cx) / fx, (cy - y) / fy, -1), or all along -z if ``parallel``."""

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int
    near: float
    parallel: bool = False

    def rays(self, view_to_world, x, y):
        """Origins on the near plane and directions whose component along the optical axis is 1."""
        across = np.stack([(x - self.cx) / self.fx, (self.cy - y) / self.fy, np.zeros_like(x)], axis=-1)
        ahead = np.broadcast_to((0.0, 0, -1), across.shape)
        start, direction = (across, ahead) if self.parallel else (0 * across, across + ahead)
        return moved(view_to_world, start + self.near * direction), turned(view_to_world, direction)

    def project(self, view_to_world, points):
        """Pixel coordinates and distance along the optical axis of world points."""
        P = (points - view_to_world[:3, 3]) @ view_to_world[:3, :3]
        z = -P[..., 2]
        scale = np.ones_like(z) if self.parallel else z
        return self.cx + self.fx * P[..., 0] / scale, self.cy - self.fy * P[..., 1] / scale, z

    def centres(self):
        y, x = np.mgrid[: self.height, : self.width] + 0.5
        return x, y


@dataclass
class Ball:
    centre: tuple
    radius: float

    def meet(self, origin, direction):
        """Distance in units of the direction, inf without, and the normal on the ray's side."""
        o = origin - self.centre
        a, b, c = (direction**2).sum(-1), (o * direction).sum(-1), (o**2).sum(-1) - self.radius**2
        root = np.sqrt(np.maximum(b * b - a * c, 0))
        near, far = (-b - root) / a, (-b + root) / a
        t = np.where(near > 0, near, np.where(far > 0, far, np.inf))
        t = np.where(b * b > a * c, t, np.inf)
        return t, o + np.where(np.isfinite(t), t, 0)[..., None] * direction


@dataclass
class Triangles:
    vertices: np.ndarray
    faces: np.ndarray

    def meet(self, origin, direction):
        best, normal = np.full(origin.shape[:-1], np.inf), np.zeros_like(origin)
        for _, n, t, _ in self._hits(origin, direction):
            closer = t < best
            best = np.where(closer, t, best)
            normal = np.where(closer[..., None], n, normal)
        return best, normal

    def coordinates(self, origin, direction):
        """Number of the nearest triangle and weights of its corners."""
        best, face = np.full(origin.shape[:-1], np.inf), np.zeros(origin.shape[:-1], int)
        weights = np.zeros_like(origin)
        for k, _, t, w in self._hits(origin, direction):
            closer = t < best
            best, face = np.where(closer, t, best), np.where(closer, k, face)
            weights = np.where(closer[..., None], w, weights)
        return face, weights

    def _hits(self, origin, direction):
        for k, (a, b, c) in enumerate(self.vertices[self.faces]):
            n = np.cross(b - a, c - a)
            with np.errstate(divide="ignore", invalid="ignore"):
                t = ((a - origin) @ n) / (direction @ n)
                p = origin + t[..., None] * direction
                w = np.stack([np.cross(q - p, r - p) @ n for q, r in ((b, c), (c, a), (a, b))], axis=-1) / (n @ n)
                t = np.where((w >= 0).all(-1) & (t > 0), t, np.inf)
            yield k, n, t, w


def cast(solids, matrices, origin, direction):
    """Distance, number of the solid (-1: none) and normal of what rays meet first."""
    best, which = np.full(origin.shape[:-1], np.inf), np.full(origin.shape[:-1], -1)
    normal = np.zeros_like(origin)
    for k, (solid, matrix) in enumerate(zip(solids, matrices, strict=True)):
        back = np.linalg.inv(matrix)
        t, n = solid.meet(moved(back, origin), turned(back, direction))
        closer = t < best
        best, which = np.where(closer, t, best), np.where(closer, k, which)
        normal = np.where(closer[..., None], turned(matrix, n), normal)
    facing = (normal * direction).sum(-1, keepdims=True) > 0
    return best, which, np.where(facing, -normal, normal)


@dataclass
class Step:
    """What happens to every pixel of a frame since the one before; arrays (H, W, …).

    ``clearance`` is how far above the plane of a point that thing is which hides it, inf where nothing does.

    """

    which: np.ndarray
    motion: np.ndarray
    ahead: np.ndarray
    disoccluded: np.ndarray
    z: np.ndarray
    clearance: np.ndarray


def step(eye, solids, now, before, pose_now, pose_before, deformed_before=None):
    """Motion and disocclusion from one frame to the next.

    Args:
        solids: at rest, in their state of this frame if they deform.
        now, before: their matrices in the two frames.
        deformed_before: number of a deforming solid -> its Triangles in the frame before.
    """
    deformed_before = deformed_before or {}
    x, y = eye.centres()
    origin, direction = eye.rays(pose_now, x, y)
    t, which, normal = cast(solids, now, origin, direction)
    surface = which >= 0
    point = origin + np.where(surface, t, 0)[..., None] * direction
    was, normal_was = direction.copy(), normal.copy()
    for k, (a, b) in enumerate(zip(now, before, strict=True)):
        on = which == k
        back = b @ np.linalg.inv(a)
        was[on], normal_was[on] = moved(back, point)[on], turned(back, normal)[on]
    for k, old in deformed_before.items():
        on = which == k
        face, weights = solids[k].coordinates(origin, direction)
        corner = old.vertices[old.faces[face]]
        was[on] = (weights[..., None] * corner).sum(-2)[on]
        a, b, c = (corner[..., i, :] for i in range(3))
        new = solids[k].vertices[solids[k].faces[face]]
        flat = np.cross(new[..., 1, :] - new[..., 0, :], new[..., 2, :] - new[..., 0, :])
        side = np.sign((flat * normal).sum(-1, keepdims=True))
        normal_was[on] = (side * np.cross(b - a, c - a))[on]
    px, py, pz = eye.project(pose_before, np.where(surface[..., None], was, pose_before[:3, 3] + was))
    if eye.parallel:
        px, py, pz = np.where(surface, px, x), np.where(surface, py, y), np.where(surface, pz, 1.0)
    ahead = pz > 0
    _, _, z = eye.project(pose_now, point)
    motion = np.stack([x - px, y - py, np.where(surface, z - pz, 0)], axis=-1)

    old_solids = [deformed_before.get(k, solid) for k, solid in enumerate(solids)]
    origin, direction = eye.rays(pose_before, px, py)
    met, _, _ = cast(old_solids, before, origin, direction)
    # Where a ray whose component along the axis is 1 meets its point.
    own = np.where(surface, pz - eye.near, np.inf)
    hidden = met < own * (1 - 1e-6)
    upright = normal_was / np.maximum(np.linalg.norm(normal_was, axis=-1, keepdims=True), 1e-30)
    with np.errstate(invalid="ignore"):
        clearance = np.where(hidden & surface, (met - own) * (upright * direction).sum(-1), np.inf)
    inside = (px >= 0) & (px < eye.width) & (py >= 0) & (py < eye.height)
    turned_away = surface & ((normal_was * direction).sum(-1) >= 0)
    near = surface & (pz < eye.near)
    disoccluded = ~ahead | ~inside | near | turned_away | hidden
    return Step(which, motion, ahead, disoccluded, np.where(surface, z, np.inf), clearance)
