"""From the crossings of a ray to the bodies that it goes through.

A body begins where a ray enters a surface and ends where it leaves it again: crossings of one connected surface pair up
like brackets, seen from its front and from its back. On a closed surface the first crossing is an entrance, whichever
way its normals point. What finds no partner is a sheet without thickness, for nothing says where it would end; but if
the surface is as large as the scene and the ray meets nothing behind it, it is a body that is never left (the ground, a
backdrop). Bodies that overlap or touch are one.
"""

import numpy as np

from .crossings import Crossings

__all__ = ["bodies"]

#: Bodies nearer than this share of the largest coordinate touch: a few roundings of float32, fifty times as long on a
#: ray that grazes them.
GAP = 2.0**-16


def bodies(
    crossings: Crossings, closed: np.ndarray, large: np.ndarray, n_bodies: int, reach: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The first bodies along each ray.

    Args:
        crossings: of all rays with all surfaces; at most 2^18 rays.
        closed, large: (S,) of each connected surface, see :class:`gtao.render.traceable.Traceable`.
        n_bodies: K, how many to keep.
        reach: (N,) largest coordinate of each ray's origin.

    Returns:
        ``(front, back)``, each (K, N) float64 distances along the ray: ``front_k <= back_k < front_(k+1)``; both
        infinite where there is no body, the back alone where it is never left.
    """
    front, back = np.full((2, n_bodies, len(reach)), np.inf)
    if not len(crossings.ray):
        return front, back
    ray, t, weight, endless = _paired(crossings, closed, large)
    start, end = _united(ray, t, weight, endless, reach)
    first = np.flatnonzero(_changes(ray[start]))
    rank = np.arange(len(start)) - np.repeat(first, np.diff(np.append(first, len(start))))
    kept = rank < n_bodies
    front[rank[kept], ray[start[kept]]] = t[start[kept]]
    back[rank[kept], ray[start[kept]]] = end[kept]
    return front, back


def _paired(c: Crossings, closed: np.ndarray, large: np.ndarray) -> tuple[np.ndarray, ...]:
    """Crossings sorted along each ray: its number; the distance; +1 for a beginning, -1 for an end, 0 without a
    partner; whether, without one, it may be endless."""
    # Crossings of one ray with one surface come in order of distance already.
    order = np.argsort(c.ray * len(closed) + c.surface, kind="stable")
    ray, t, surface, side = c.ray[order], np.abs(c.t[order]), c.surface[order], np.where(c.front[order], 1, -1)
    begins = _changes(ray) | _changes(surface)
    start, group = np.flatnonzero(begins), np.cumsum(begins) - 1
    side = np.where(closed[surface], side * side[start][group], side)
    total = np.cumsum(side)
    depth = total - (total - side)[start][group]
    # Running minima within the groups: moved apart, no group reaches into the range of another.
    lift = (2 * len(side) + 1) * group
    before = np.where(begins, 0, np.roll(depth, 1))
    lowest_before = np.minimum.accumulate(before - lift) + lift
    lowest_behind = np.minimum.accumulate((depth + lift)[::-1])[::-1] - lift
    alone = np.where(side > 0, lowest_behind == depth, depth < lowest_before)

    weight, endless = np.where(alone, 0, side), alone & large[surface]
    # One key for the ray, the distance to 32 bits, and beginnings before ends: the bits of positive floating-point
    # numbers are in the order of the numbers.
    order = np.argsort((ray << 45) | (t.view(np.int64) >> 20 << 2) | (1 - weight))
    return ray[order], t[order], weight[order], endless[order]


def _united(
    ray: np.ndarray, t: np.ndarray, weight: np.ndarray, endless: np.ndarray, reach: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Where bodies begin, as indices of crossings, and the distances at which they end."""
    gap = GAP * (reach[ray] + t)
    begins = _changes(ray)
    last = np.append(np.flatnonzero(begins)[1:], len(ray)) - 1
    never_left = endless & (t + gap >= t[last][np.cumsum(begins) - 1])
    # Every beginning has its end on the same ray, so that the depth is 0 again behind it.
    depth = np.cumsum(weight)
    solid = (weight > 0) & (depth == 1)
    start = np.flatnonzero(solid | never_left | ((weight == 0) & (depth == 0)))
    end = np.where(never_left, np.inf, t)[start]
    end[solid[start]] = t[(weight < 0) & (depth == 0)]

    apart = _changes(ray[start]) | (t[start] > np.append(-np.inf, end[:-1]) + gap[start])
    farthest = np.full(apart.sum(), -np.inf)
    np.maximum.at(farthest, np.cumsum(apart) - 1, end)
    return start[apart], farthest


def _changes(values: np.ndarray) -> np.ndarray:
    """Whether each value differs from the one before; the first does."""
    return np.append(True, np.diff(values) != 0)
