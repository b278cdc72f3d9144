"""Triangle surfaces in NumPy: the solids that the embedded scenes are assembled from.

All solids are closed: every edge is shared by two triangles of opposite sense and triangles run anticlockwise seen
from outside. Solids may overlap; walls that only touched along an edge would leak light.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gtao.errors import ConfigError


class Surface(NamedTuple):
    """Triangles: ``vertices`` (n, 3) float64 in scene units, ``faces`` (m, 3) int64 indices into them."""

    vertices: np.ndarray
    faces: np.ndarray


IDENTITY = np.eye(3)
#: First corner of the polygons that stand for circles, in steps: no edge lies on an axis or a diagonal, where a
#: centred camera sends rays exactly through it, and such a ray may slip between the two triangles.
PHASE = 0.37


def generator(seed: int) -> np.random.Generator:
    """Random numbers of a scene.

    Raises:
        ConfigError: the seed is not a whole number >= 0.
    """
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise ConfigError(f"seed must be a whole number >= 0, got {seed!r}")
    return np.random.default_rng(seed)


def merge(*surfaces: Surface) -> Surface:
    """All triangles of the given surfaces as one surface; nothing is welded."""
    starts = np.cumsum([0] + [len(s.vertices) for s in surfaces[:-1]])
    return Surface(
        np.concatenate([s.vertices for s in surfaces]),
        np.concatenate([s.faces + start for s, start in zip(surfaces, starts, strict=True)]),
    )


def rotation(axis: Sequence[float], angle) -> np.ndarray:
    """Rotation matrices (..., 3, 3) about ``axis`` (..., 3) by ``angle`` (...) radians (Rodrigues)."""
    k = np.asarray(axis, float) / np.linalg.norm(axis, axis=-1, keepdims=True)
    zero = np.zeros_like(k[..., 0])
    cross = np.stack(
        [zero, -k[..., 2], k[..., 1], k[..., 2], zero, -k[..., 0], -k[..., 1], k[..., 0], zero], axis=-1
    ).reshape(*k.shape, 3)
    angle = np.asarray(angle, float)[..., None, None]
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def move(surface: Surface, offset: Sequence[float] = (0, 0, 0), linear=IDENTITY) -> Surface:
    """The surface under ``p -> linear @ p + offset``; ``linear`` must keep the sense of rotation."""
    return Surface(surface.vertices @ np.asarray(linear, float).T + np.asarray(offset, float), surface.faces)


def copies(surface: Surface, offsets: np.ndarray, linear: np.ndarray) -> Surface:
    """One copy for each row of ``offsets`` (k, 3) and ``linear`` (k, 3, 3)."""
    vertices = np.einsum("kij,nj->kni", linear, surface.vertices) + offsets[:, None]
    faces = surface.faces + len(surface.vertices) * np.arange(len(offsets))[:, None, None]
    return Surface(vertices.reshape(-1, 3), faces.reshape(-1, 3))


def _quads(index: np.ndarray) -> np.ndarray:
    """Two triangles for each cell of a grid of vertex indices (a, b), anticlockwise in (first, second) axis."""
    p, q, r, s = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    return np.concatenate([np.stack([p, q, r], -1).reshape(-1, 3), np.stack([p, r, s], -1).reshape(-1, 3)])


def block(xs: Sequence[float], ys: Sequence[float], zs: Sequence[float]) -> Surface:
    """Axis-aligned box whose faces are cut at the given ascending coordinates.

    Cuts near the region of interest keep the hit points of a very large box exact in float32.
    """
    shape = (len(xs), len(ys), len(zs))
    index = np.arange(np.prod(shape)).reshape(shape)
    faces = np.concatenate(
        [
            _quads(index[-1]),
            _quads(index[0].T),
            _quads(index[:, -1].T),
            _quads(index[:, 0]),
            _quads(index[:, :, -1]),
            _quads(index[:, :, 0].T),
        ]
    )
    used, faces = np.unique(faces, return_inverse=True)
    lattice = np.stack(np.meshgrid(xs, ys, zs, indexing="ij"), axis=-1).reshape(-1, 3)
    return Surface(lattice[used].astype(float), faces.reshape(-1, 3))


def box(low: Sequence[float], high: Sequence[float]) -> Surface:
    """Axis-aligned box between two corners."""
    return block(*([a, b] for a, b in zip(low, high, strict=True)))


def relief(points: np.ndarray, bottom: float) -> Surface:
    """Solid between the grid ``points`` (a, b, 3) and the plane z = ``bottom``.

    The first grid axis runs along +x, the second along +y. The grid's border, dropped to the plane, must be seen
    whole from its centre.
    """
    n_a, n_b = points.shape[:2]
    index = np.arange(n_a * n_b).reshape(n_a, n_b)
    border = np.concatenate([index[:-1, 0], index[-1, :-1], index[:0:-1, -1], index[0, :0:-1]])
    top = points.reshape(-1, 3)
    skirt = top[border] * (1, 1, 0) + (0, 0, bottom)
    lower = len(top) + np.arange(len(border))
    centre = np.full_like(lower, len(top) + len(border))
    sides = _quads(np.stack([np.append(lower, lower[0]), np.append(border, border[0])], axis=-1))
    fan = np.stack([np.roll(lower, -1), lower, centre], axis=-1)
    return Surface(
        np.concatenate([top, skirt, skirt.mean(axis=0, keepdims=True)]),
        np.concatenate([_quads(index), sides, fan]),
    )


def loft(rings: np.ndarray, *, ends: np.ndarray | None = None, closed: bool = False) -> Surface:
    """Skin over a stack of rings.

    Args:
        rings: (a, b, 3); each ring runs anticlockwise seen from the side to which the stack grows.
        ends: (2, 3) points that close the first and the last ring with a fan; default: the rings' centroids.
        closed: join the last ring to the first (a torus) instead of closing the ends.
    """
    n_rings, n_around = rings.shape[:2]
    index = np.arange(n_rings * n_around).reshape(n_rings, n_around)
    wrapped = np.concatenate([index, index[:, :1]], axis=1)
    vertices = rings.reshape(-1, 3)
    if closed:
        return Surface(vertices, _quads(np.concatenate([wrapped, wrapped[:1]]).T))
    if ends is None:
        ends = rings[[0, -1]].mean(axis=1)
    first, last = np.full(n_around, len(vertices)), np.full(n_around, len(vertices) + 1)
    return Surface(
        np.concatenate([vertices, ends]),
        np.concatenate(
            [
                _quads(wrapped.T),
                np.stack([wrapped[0, 1:], wrapped[0, :-1], first], axis=-1),
                np.stack([wrapped[-1, :-1], wrapped[-1, 1:], last], axis=-1),
            ]
        ),
    )


def revolve(profile: Sequence[Sequence[float]], n_around: int, *, closed: bool = False) -> Surface:
    """Solid of revolution about z.

    Args:
        profile: (a, 2) of (radius > 0, z), ordered so that the solid lies to the left of the curve in the (r, z)
            plane. An open profile is joined to the axis at its first and last height.
        n_around: sides of the polygon that stands for the circle. Its area equals the circle's.
        closed: the profile is a closed curve that stays off the axis.
    """
    curve = np.asarray(profile, float)
    phi = 2 * np.pi * (np.arange(n_around) + PHASE) / n_around
    r = curve[:, :1] * equal_area_radius(n_around)
    rings = np.stack([r * np.cos(phi), r * np.sin(phi), np.broadcast_to(curve[:, 1:], (len(r), n_around))], -1)
    ends = curve[[0, -1], 1][:, None] * (0, 0, 1)
    return loft(rings, ends=ends, closed=closed)


def equal_area_radius(n_around: int) -> float:
    """Circumradius of the regular polygon that has the area of the unit disc."""
    step = 2 * np.pi / n_around
    return float(np.sqrt(step / np.sin(step)))


def cylinder(radius: float, low: float, high: float, n_around: int = 32) -> Surface:
    """Upright cylinder about the z axis between two heights."""
    return revolve([(radius, low), (radius, high)], n_around)


def sphere(n_around: int = 24, n_rings: int = 12) -> Surface:
    """Unit sphere about the origin, poles on z."""
    theta = np.pi * (np.arange(n_rings) + 1) / (n_rings + 1)
    phi = 2 * np.pi * (np.arange(n_around) + PHASE) / n_around
    z, r = -np.cos(theta)[:, None], np.sin(theta)[:, None]
    rings = np.stack([r * np.cos(phi), r * np.sin(phi), np.broadcast_to(z, (n_rings, n_around))], axis=-1)
    return loft(rings, ends=np.array([(0.0, 0, -1), (0.0, 0, 1)]))


def tube(path: np.ndarray, radius, n_around: int = 16, *, closed: bool = False) -> Surface:
    """Round tube along a path.

    Args:
        path: (a, 3) points, smoothly curved: the radius must stay below the path's radius of curvature.
        radius: one value, or (a,) values.
        n_around: sides of the cross-section.
        closed: the path returns to its start (which is not repeated), in a plane.
    """
    path = np.asarray(path, float)
    if closed:
        tangent = np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0)
    else:
        tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
    across = np.empty_like(tangent)
    side = np.eye(3)[np.argmin(np.abs(tangent[0]))]
    for i, t in enumerate(tangent):
        side = side - (side @ t) * t
        side = side / np.linalg.norm(side)
        across[i] = side
    phi = 2 * np.pi * (np.arange(n_around) + PHASE) / n_around
    ring = np.cos(phi)[:, None] * across[:, None] + np.sin(phi)[:, None] * np.cross(tangent, across)[:, None]
    return loft(path[:, None] + np.broadcast_to(radius, len(path))[:, None, None] * ring, closed=closed)


def torus(radius: float, thickness: float, n_along: int = 48, n_around: int = 16) -> Surface:
    """Ring about z: circle of ``radius`` swept by a disc of radius ``thickness``."""
    phi = 2 * np.pi * np.arange(n_along) / n_along
    circle = np.stack([radius * np.cos(phi), radius * np.sin(phi), np.zeros(n_along)], axis=-1)
    return tube(circle, thickness, n_around, closed=True)
