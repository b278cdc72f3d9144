"""Bodies along a ray from the definition: points inside a closed surface, by the solid angle that it subtends.

Nothing is paired and nothing is sorted into fronts and backs: whether a stretch between two crossings is inside is
asked of its midpoint alone.
"""

from itertools import pairwise

import numpy as np


def crossings(origin, direction, triangles):
    """Sorted distances at which a ray hits triangles (n, 3, 3)."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    p = np.cross(direction, c - a)
    det = ((b - a) * p).sum(1)
    hit = np.abs(det) > 1e-14
    inverse = 1 / np.where(hit, det, 1)
    s = origin - a
    u = (s * p).sum(1) * inverse
    q = np.cross(s, b - a)
    v = q @ direction * inverse
    t = (q * (c - a)).sum(1) * inverse
    return np.sort(t[hit & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)])


def winding(point, triangles):
    """How often a surface goes round a point: its signed solid angle over 4π (Van Oosterom and Strackee 1983)."""
    r = triangles - point
    length = np.linalg.norm(r, axis=2)
    a, b, c = r[:, 0], r[:, 1], r[:, 2]
    la, lb, lc = length.T
    volume = (a * np.cross(b, c)).sum(1)
    scale = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
    return np.arctan2(volume, scale).sum() / (2 * np.pi)


def layers(origin, direction, solids, sheets, n, gap=1e-3):
    """``(front, back)``, each (n,), of the first n bodies along a ray; infinite where there are no more.

    Args:
        origin, direction: (3,) of the ray.
        solids: closed surfaces (m, 3, 3), oriented either way, that may overlap and touch.
        sheets: open ones.
        n: bodies to return.
        gap: bodies nearer than this along the ray count as one.
    """
    t = np.concatenate([[0.0], *(crossings(origin, direction, s) for s in solids)])
    t.sort()
    pieces = []
    for low, high in pairwise(t):
        middle = origin + 0.5 * (low + high) * direction
        if high - low > 1e-9 and any(abs(winding(middle, s)) > 0.5 for s in solids):
            pieces.append([low, high])
    for sheet in sheets:
        pieces += [[hit, hit] for hit in crossings(origin, direction, sheet)]
    front, back = np.full((2, n), np.inf)
    joined: list[list[float]] = []
    for low, high in sorted(pieces):
        if joined and low <= joined[-1][1] + gap:
            joined[-1][1] = max(joined[-1][1], high)
        else:
            joined.append([low, high])
    for k, (low, high) in enumerate(joined[:n]):
        front[k], back[k] = low, high
    return front, back
