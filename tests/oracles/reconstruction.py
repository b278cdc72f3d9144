"""The surface between texel centres, edge cells included, and rays against it point by point. Float64 NumPy.

Texel coordinates here: x = 0 is the centre of column 0. The surface is w = 1/z (perspective) or w = -z (parallel
projection), -inf or 0 over background.
"""

from dataclasses import dataclass

import numpy as np

from .fields import Field

#: κ of the theory page: a step beyond its neighbours' slopes by more than this many pixel footprints is an edge.
KAPPA = 2.0


@dataclass(frozen=True)
class Surface:
    """``edge`` is (H - 1, W - 1): whether the cell right of and below a texel falls apart into its texels."""

    w: np.ndarray
    edge: np.ndarray

    @staticmethod
    def of(field: Field, fetch: str) -> "Surface":
        z = field.view_z
        w = -z if field.orthographic else 1 / z
        height, width = z.shape
        edge = np.ones((height - 1, width - 1), bool)
        if fetch == "linear":
            for j in range(height - 1):
                for i in range(width - 1):
                    rows = all(_continues(field, w[k], z[k], i) for k in (j, j + 1))
                    columns = all(_continues(field, w[:, k], z[:, k], j) for k in (i, i + 1))
                    edge[j, i] = not (rows and columns)
        return Surface(w, edge)

    def at(self, x, y):
        """w at texel coordinates, which may lie half a texel outside of the outermost centres."""
        height, width = self.w.shape
        i, j = np.clip(np.floor(x).astype(int), 0, width - 2), np.clip(np.floor(y).astype(int), 0, height - 2)
        u, v = x - i, y - j
        w = self.w
        with np.errstate(invalid="ignore"):
            top = w[j, i] + u * (w[j, i + 1] - w[j, i])
            bottom = w[j + 1, i] + u * (w[j + 1, i + 1] - w[j + 1, i])
            smooth = top + v * (bottom - top)
        column, row = self.texel(x, y)
        return np.where(self.edge[j, i], w[row, column], smooth)

    def texel(self, x, y):
        """The texel under a point: column and row."""
        height, width = self.w.shape
        i, j = np.clip(np.floor(x).astype(int), 0, width - 2), np.clip(np.floor(y).astype(int), 0, height - 2)
        return i + (x - i > 0.5), j + (y - j > 0.5)

    def is_edge(self, x, y):
        height, width = self.w.shape
        i, j = np.clip(np.floor(x).astype(int), 0, width - 2), np.clip(np.floor(y).astype(int), 0, height - 2)
        return self.edge[j, i]


def _continues(field, w, z, k) -> bool:
    """Whether the step from texel k to k + 1 of a row or column continues the surface beside it."""
    before, after = w[max(k - 1, 0)], w[min(k + 2, len(w) - 1)]
    with np.errstate(invalid="ignore"):
        left, step, right = w[k] - before, w[k + 1] - w[k], after - w[k + 1]
    tolerance = KAPPA / min(field.scale)
    if not field.orthographic:
        tolerance /= max(z[k], z[k + 1])
    return bool(min(left, right) - tolerance <= step <= max(left, right) + tolerance)


def highest_excess(field: Field, surface: Surface, row, column, direction, radius, n_points=4000):
    """Largest (w of the surface - w of the ray) / w of the pixel's depth, over points of one ray.

    Points of the ray itself, evenly spread over its image: as pinhole or parallel projection puts them, one by one.
    The pixel's own texel does not count where it is a block.
    """
    P = field.positions()[row, column]
    far = radius if np.isfinite(radius) else 1e6 * np.abs(P).max()
    if not field.orthographic and direction[2] > 0:
        far = min(far, (1 - 1e-6) * -P[2] / direction[2])

    def image(s):
        t = s * far if field.orthographic else _even(P, direction, far, s)
        points = P + np.multiply.outer(t, direction)
        z = -points[..., 2]
        fx, fy = field.scale
        scale = 1.0 if field.orthographic else z
        x = field.camera["cx"] + fx * points[..., 0] / scale - 0.5
        return x, field.camera["cy"] - fy * points[..., 1] / scale - 0.5, z

    def inside(s):
        x, y, _ = image(s)
        height, width = field.view_z.shape
        return (x > -0.5) & (x < width - 0.5) & (y > -0.5) & (y < height - 0.5)

    low, high = 0.0, 1.0
    if not inside(1.0):
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if inside(middle) else (low, middle)
        high = low
    x, y, z = image(high * np.linspace(0, 1, n_points + 1)[1:])
    i, j = surface.texel(x, y)
    own = surface.is_edge(x, y) & (i == column) & (j == row)
    with np.errstate(invalid="ignore"):
        excess = (surface.at(x, y) - (-z if field.orthographic else 1 / z))[~own]
    return np.nanmax(excess, initial=-np.inf) / abs(surface.w[row, column])


def _even(P, d, end, s):
    """Lengths whose t/z(t) are spread evenly up to ``end``."""
    z = -P[2]
    u = s * end / (z - end * d[2])
    return u * z / (1 + u * d[2])
