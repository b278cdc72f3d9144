"""Triangle meshes behind the centres of pixels, in float64 NumPy from the definitions."""

from dataclasses import dataclass

import numpy as np

__all__ = ["Camera", "look_at", "mesh_frame", "vertex_normals"]


@dataclass(frozen=True)
class Camera:
    """Where a camera stands and how it sees.

    Attributes:
        to_world: (4, 4) from the view frame (+x right, +y up, looking along -z) to the world.
        size: width and height in pixels.
        fx, fy, cx, cy: in pixels, or for a parallel projection fx and fy in pixels per unit.
        parallel: whether it is one.
    """

    to_world: np.ndarray
    size: tuple[int, int]
    fx: float
    fy: float
    cx: float
    cy: float
    parallel: bool = False

    def rays(self) -> tuple[np.ndarray, np.ndarray]:
        """(N, 3) origins and directions in the view frame; lengths along them are distances along the axis."""
        width, height = self.size
        x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
        slope = np.stack([(x - self.cx) / self.fx, (self.cy - y) / self.fy], -1).reshape(-1, 2)
        still = np.zeros((len(slope), 1))
        axis = np.tile([0.0, 0.0, -1.0], (len(slope), 1))
        if self.parallel:
            return np.hstack([slope, still]), axis
        return np.zeros((len(slope), 3)), np.hstack([slope, still - 1])


def look_at(origin, target, up) -> np.ndarray:
    """(4, 4) from the view frame to the world."""
    back = np.subtract(origin, target, dtype=float)
    back /= np.linalg.norm(back)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3] = np.stack([right, np.cross(back, right), back, np.asarray(origin, float)], -1)
    return matrix


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(V, 3) unit sums of the normals of the faces around a vertex, weighted by the angle that each fills there."""
    corners = vertices[faces]
    sums = np.zeros_like(vertices)
    for k in range(3):
        a, b = corners[:, (k + 1) % 3] - corners[:, k], corners[:, (k + 2) % 3] - corners[:, k]
        n = np.cross(a, b)
        n /= np.linalg.norm(n, axis=-1, keepdims=True)
        cosine = np.sum(a * b, -1) / (np.linalg.norm(a, axis=-1) * np.linalg.norm(b, axis=-1))
        np.add.at(sums, faces[:, k], n * np.arccos(cosine)[:, None])
    return sums / np.linalg.norm(sums, axis=-1, keepdims=True)


def mesh_frame(vertices, faces, camera: Camera, *, smooth: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What lies behind the pixel centres.

    Args:
        smooth: interpolate the normals of the vertices instead of taking those of the faces.

    Returns:
        ``view_z`` (N,), inf where there is nothing; unit ``normal_v`` (N, 3) that faces the camera; the number of the
        triangle (N,), -1 where there is none.
    """
    vertices = np.asarray(vertices, float)
    R, c = camera.to_world[:3, :3], camera.to_world[:3, 3]
    P = (vertices - c) @ R
    A, B, C = (P[faces[:, k]] for k in range(3))
    o, d = (v[:, None, :] for v in camera.rays())
    # o + t d = A + u (B - A) + v (C - A), by Cramer's rule.
    e, f, r = B - A, C - A, o - A
    n = np.cross(e, f)
    with np.errstate(divide="ignore", invalid="ignore"):
        determinant = -np.sum(d * n, -1)
        t = np.sum(r * n, -1) / determinant
        u = np.sum(np.cross(r, d) * f, -1) / determinant
        v = np.sum(np.cross(r, d) * -e, -1) / determinant
    t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf)
    lane, best = np.arange(len(t)), t.argmin(1)
    view_z, u, v = t[lane, best], u[lane, best][:, None], v[lane, best][:, None]
    hit = np.isfinite(view_z)
    if smooth:
        a, b, c = np.moveaxis((vertex_normals(vertices, faces) @ R)[faces[best]], 1, 0)
        normal = (1 - u - v) * a + u * b + v * c
    else:
        normal = n[best]
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    normal *= np.where(np.sum(normal * d[:, 0], -1) > 0, -1, 1)[:, None]
    return view_z, np.where(hit[:, None], normal, [0.0, 0.0, 1.0]), np.where(hit, best, -1)
