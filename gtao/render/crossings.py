"""Every surface that a ray meets, not only the first."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from .traceable import Traceable, identity

__all__ = ["Crossings", "crossings"]

#: Crossings that one launch keeps for each ray; rays with more go into the next launch.
PER_LAUNCH = 8
#: Surfaces of one colour that a ray is followed through. Scenes of foliage have some hundred.
MOST_CROSSINGS = 4096
#: A ray goes on behind a surface by this share of the largest coordinate: a rounding of float32. Bodies thinner than
#: that are lost; a surface that is met again is recognised and passed.
STEP = 2.0**-23
#: Attempts to pass one, each twice as far.
MOST_ATTEMPTS = 40
#: How far beside a ray that slipped through an edge is sent again, relative to the largest coordinate, and where.
BESIDE = ((1e-5, 0.3), (4e-5, 1.9), (1.6e-4, 3.4), (6.4e-4, 5.0))
#: If more of the rays cross a closed surface an odd number of times, the camera is inside of it.
MOST_SLIP = 0.5


@dataclass(frozen=True)
class Crossings:
    """Where rays cross surfaces; those of one ray and one surface in order of distance.

    Attributes:
        ray: index of the ray.
        t: distance along it, float64, scene units.
        surface: number of the connected surface.
        front: whether it is seen from the side that its geometric normal points to.
    """

    ray: np.ndarray
    t: np.ndarray
    surface: np.ndarray
    front: np.ndarray


def crossings(traceable: Traceable, origin: Any, direction: Any) -> Crossings:
    """Follow rays through everything that they meet.

    A ray that crosses a closed surface an odd number of times has slipped through an edge, by rounding; it is sent
    again a little beside.

    Args:
        traceable: the scene.
        origin: Point3f, world space.
        direction: Vector3f, unit.
    """
    found = _all_parts(traceable, origin, direction)
    sealed = _sealed(found, traceable.closed)
    slipped = np.flatnonzero(_slipped(found, sealed, dr.width(origin)))
    side, other = mi.coordinate_system(direction)
    for offset, turn in BESIDE:
        if not len(slipped):
            break
        lane = mi.UInt32(slipped.astype(np.uint32))
        o, d, u, v = (dr.gather(type(x), x, lane) for x in (origin, direction, side, other))
        o = o + offset * dr.max(abs(mi.Vector3f(o))) * (math.cos(turn) * u + math.sin(turn) * v)
        again = _all_parts(traceable, o, d)
        still = _slipped(again, sealed, len(slipped))
        found = _replaced(found, again, slipped, ~still)
        slipped = slipped[still]
    return found


def _replaced(found: Crossings, again: Crossings, ray: np.ndarray, mended: np.ndarray) -> Crossings:
    """The crossings with those of the mended rays in place of their own, from the same first distance on."""
    first, first_again = np.full((2, found.ray.max(initial=-1) + 1), np.inf)
    new = mended[again.ray]
    again = Crossings(ray[again.ray[new]], again.t[new], again.surface[new], again.front[new])
    np.minimum.at(first, found.ray, found.t)
    np.minimum.at(first_again, again.ray, again.t)
    old = ~np.isin(found.ray, ray[mended])
    t = again.t + first[again.ray] - first_again[again.ray]
    return Crossings(
        np.append(found.ray[old], again.ray),
        np.append(found.t[old], t),
        np.append(found.surface[old], again.surface),
        np.append(found.front[old], again.front),
    )


def _odd(found: Crossings, surfaces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rays and surfaces, of those chosen, in pairs that cross; and whether an odd number of times."""
    chosen = surfaces[found.surface]
    key, count = np.unique(found.ray[chosen] * len(surfaces) + found.surface[chosen], return_counts=True)
    return *np.divmod(key, len(surfaces)), count % 2 == 1


def _sealed(found: Crossings, closed: np.ndarray) -> np.ndarray:
    """Closed surfaces that the camera is not inside of."""
    _, surface, odd = _odd(found, closed)
    n_odd, n = (np.bincount(s, minlength=len(closed)) for s in (surface[odd], surface))
    return closed & (n_odd <= MOST_SLIP * n)


def _slipped(found: Crossings, sealed: np.ndarray, n_rays: int) -> np.ndarray:
    """(N,) whether a ray crosses a sealed surface an odd number of times."""
    ray, _, odd = _odd(found, sealed)
    slipped = np.zeros(n_rays, bool)
    slipped[ray[odd]] = True
    return slipped


def _all_parts(traceable: Traceable, origin: Any, direction: Any) -> Crossings:
    found = [piece for part in traceable.parts for piece in _through(part, origin, direction)]
    return Crossings(*(np.concatenate(column) for column in zip(*found, strict=True)))


def _through(part: tuple, origin: Any, direction: Any) -> Iterator[tuple[np.ndarray, ...]]:
    scene, ids, first, surface = part
    n = dr.width(origin)
    ray = np.arange(n, dtype=np.uint32)
    state = (dr.zeros(mi.Float64, n), dr.zeros(mi.UInt32, n), dr.zeros(mi.UInt32, n), dr.zeros(mi.Bool, n))
    for _ in range(0, MOST_CROSSINGS, PER_LAUNCH):
        count, on, state, (t, shape, prim, front) = _launch(scene, origin, direction, state)
        n = len(ray)
        kept = (np.arange(PER_LAUNCH)[:, None] < count).ravel()
        lane = np.tile(np.arange(n), PER_LAUNCH)[kept]
        which = np.searchsorted(ids, shape[kept])
        last = np.append(first[1:], len(surface))[which] - first[which] - 1
        # Curved shapes are one face, whatever number their pieces have.
        face = first[which] + np.minimum(prim[kept], last)
        yield ray[lane].astype(np.int64), t[kept], surface[face], front[kept]
        if not on.any():
            return
        going = mi.UInt32(np.flatnonzero(on).astype(np.uint32))
        ray = ray[on]
        origin, direction = (dr.gather(type(v), v, going) for v in (origin, direction))
        state = tuple(dr.gather(type(v), v, going) for v in state)


def _launch(scene: Any, origin: Any, direction: Any, state: tuple) -> tuple:
    """Up to ``PER_LAUNCH`` crossings of each ray behind those before.

    ``state`` is where each ray goes on (0 at first) and what it met last: shape, primitive and side.
    """
    n = dr.width(origin)
    lane = dr.arange(mi.UInt32, n)
    size = PER_LAUNCH * n
    t_out, shape_out, prim_out = (dr.zeros(kind, size) for kind in (mi.Float64, mi.UInt32, mi.UInt32))
    front_out = dr.zeros(mi.Bool, size)
    o, d = mi.Point3d(origin), mi.Vector3d(direction)
    most, attempts = dr.opaque(mi.UInt32, PER_LAUNCH), dr.opaque(mi.UInt32, MOST_ATTEMPTS)

    def more(t: Any, shape: Any, prim: Any, front: Any, step: Any, count: Any, tries: Any, on: Any) -> Any:
        return on & (count < most) & (tries < attempts)

    def body(t: Any, shape: Any, prim: Any, front: Any, step: Any, count: Any, tries: Any, on: Any) -> tuple:
        start = o + d * t
        # Rounding the start moves it along the ray as well, which has to be told from the way to the next surface.
        rounded = mi.Point3f(start)
        si = scene.ray_intersect(mi.Ray3f(rounded, direction), ray_flags=mi.RayFlags.Minimal, coherent=False)
        hit = si.is_valid()
        here = t + dr.dot(mi.Vector3d(rounded) - mi.Vector3d(start), d) + mi.Float64(si.t)
        instance, inner = identity(si.instance), identity(si.shape)
        whose = inner ^ (instance << 16)
        side = dr.dot(si.n, direction) < 0
        again = (whose == shape) & (si.prim_index == prim) & (side == front)
        new = hit & ~again
        slot = count * n + lane
        dr.scatter(t_out, here, slot, new)
        # An instance hides the shapes of its group.
        dr.scatter(shape_out, dr.select(instance != 0, instance, inner), slot, new)
        dr.scatter(prim_out, si.prim_index, slot, new)
        dr.scatter(front_out, side, slot, new)
        least = STEP * mi.Float64(dr.max(abs(mi.Vector3f(rounded))) + si.t)
        step = dr.select(again & (2 * step > least), 2 * step, least)
        return (
            dr.select(hit, here + step, t),
            dr.select(hit, whose, shape),
            dr.select(hit, si.prim_index, prim),
            dr.select(hit, side, front),
            step,
            count + dr.select(new, mi.UInt32(1), 0),
            dr.select(new, 0, tries + 1),
            hit,
        )

    zero = dr.zeros(mi.UInt32, n)
    first: tuple[Any, ...] = (*state, dr.zeros(mi.Float64, n), zero, zero, dr.full(mi.Bool, True, n))
    labels = ("t", "shape", "prim", "front", "step", "count", "tries", "on")
    last = dr.while_loop(first, more, body, labels=labels)
    count, on = last[5], last[7] & (last[6] < attempts)
    dr.eval(last, on, t_out, shape_out, prim_out, front_out)
    arrays = tuple(v.numpy() for v in (t_out, shape_out, prim_out, front_out))
    return count.numpy(), on.numpy(), last[:4], arrays
