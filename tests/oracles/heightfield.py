"""Brute force: rays marched through the solid behind a single-layer depth buffer, float64 NumPy.

No slices, no horizons, no closed form: every pixel sends stratified directions from its surface point, and each ray
is followed exactly, cell by cell, across the image. A ray is blocked as soon as it is behind the surface as the eye
sees it (the solid is infinitely thick), no farther from its origin than ``radius``. Outside the frame (the rectangle
that the pixels cover) and over background (``view_z`` = inf) nothing blocks.

Along a ray P + t d the parameter u = t (orthographic) or u = t / view_z(t) (perspective) makes image position *and*
w = -view_z (orthographic) or w = 1/view_z (perspective) linear in u. "Behind the surface" is w_surface > w_ray.

Surface models:
    "linear": w bilinear between texel centres (exact on planes in both cameras). Within a cell the difference
        w_surface - w_ray is quadratic in u and its maximum is taken exactly. Cells with a background corner are open;
        the half pixel outside of the outermost texel centres continues their cells.
    "nearest": w constant over a texel (blocks). The ray's own texel does not block.
"""

from dataclasses import dataclass

import numpy as np

from . import harmonics
from .fields import Field

_CHUNK = 1 << 15
_REPLICATES = 4


@dataclass(frozen=True)
class Estimate:
    """Visibility and its standard error, from the spread of independent replicates of the whole direction set."""

    visibility: np.ndarray
    standard_error: np.ndarray


@dataclass(frozen=True)
class Directions:
    """The open directions of each pixel: their mean and their spherical harmonics, each with its standard error.

    ∫ V ω and ∫ V Y_lm over the hemisphere, with the factors ⟨N, ω⟩/π and ⟨N, ω⟩ (cosine) or 1/(2π) and 1 (uniform).
    """

    mean: np.ndarray
    mean_error: np.ndarray
    harmonics: np.ndarray
    harmonics_error: np.ndarray


def visibility(
    field: Field,
    pixels=None,
    *,
    n_rays: int = 1024,
    radius: float = np.inf,
    surface: str = "linear",
    weighting: str = "cosine",
    seed: int = 0,
) -> Estimate:
    """Fraction of unblocked rays per pixel.

    Args:
        field: depth layer, normals and camera.
        pixels: (N, 2) rows and columns of surface pixels, or None for the whole image (background: visibility 1).
        n_rays: directions per pixel, ``4 m²``: four replicates of m x m jittered strata.
        radius: distance beyond which nothing blocks, scene units; may be inf.
        surface: "linear" or "nearest".
        weighting: "cosine" or "uniform": the distribution of the directions over the normal's hemisphere.

    Returns:
        Arrays of shape (N,), or (H, W) if ``pixels`` is None.
    """
    whole = pixels is None
    where = np.argwhere(np.isfinite(field.view_z)) if whole else np.asarray(pixels)
    mean, error = _means(field, where, lambda d: np.ones((*d.shape[:-1], 1)), n_rays, radius, surface, weighting, seed)
    mean, error = mean[:, 0], error[:, 0]
    if not whole:
        return Estimate(mean, error)
    full = Estimate(np.ones(field.view_z.shape), np.zeros(field.view_z.shape))
    full.visibility[where[:, 0], where[:, 1]] = mean
    full.standard_error[where[:, 0], where[:, 1]] = error
    return full


def directional(
    field: Field,
    pixels,
    *,
    n_rays: int = 1024,
    radius: float = np.inf,
    surface: str = "linear",
    weighting: str = "cosine",
    seed: int = 0,
) -> Directions:
    """Mean open direction (N, 3) and nine harmonics (N, 9) of each of ``pixels``; arguments of :func:`visibility`."""

    def values(d):
        return np.concatenate([d, harmonics.basis(d)], axis=-1)

    mean, error = _means(field, np.asarray(pixels), values, n_rays, radius, surface, weighting, seed)
    # The integral of the weight over the hemisphere.
    total = np.pi if weighting == "cosine" else 2 * np.pi
    return Directions(mean[:, :3], error[:, :3], total * mean[:, 3:], total * error[:, 3:])


def _means(field, where, values, n_rays, radius, surface, weighting, seed):
    """Means of ``values(directions)`` over all rays, blocked ones counting as 0, and their standard errors."""
    m = round(np.sqrt(n_rays / _REPLICATES))
    if _REPLICATES * m * m != n_rays:
        raise ValueError(f"n_rays must be 4 m², got {n_rays}")
    scene = _Surface.of(field, surface)
    rng = np.random.default_rng(seed)
    means, errors = [], []
    per_chunk = max(1, _CHUNK // n_rays)
    for start in range(0, len(where), per_chunk):
        part = where[start : start + per_chunk]
        normals = field.normal_v[part[:, 0], part[:, 1]]
        directions = _directions(normals, m, weighting, rng)
        blocked = scene.blocked(field, np.repeat(part, n_rays, axis=0), directions.reshape(-1, 3), radius)
        of_rays = values(directions) * ~blocked.reshape(len(part), n_rays, 1)
        replicate = of_rays.reshape(len(part), _REPLICATES, m * m, -1).mean(axis=2)
        means.append(replicate.mean(axis=1))
        errors.append(replicate.std(axis=1, ddof=1) / np.sqrt(_REPLICATES))
    return np.concatenate(means), np.concatenate(errors)


def _directions(normals, m, weighting, rng) -> np.ndarray:
    """Jittered directions about each normal: (n, replicates * m * m, 3)."""
    shape = (len(normals), _REPLICATES, m, m)
    u = (np.arange(m)[:, None] + rng.random(shape)) / m
    v = (np.arange(m)[None, :] + rng.random(shape)) / m
    u, phi = u.reshape(len(normals), -1), 2 * np.pi * v.reshape(len(normals), -1)
    if weighting == "cosine":
        cosine = np.sqrt(1.0 - u)
    elif weighting == "uniform":
        cosine = 1.0 - u
    else:
        raise ValueError(f"weighting must be 'cosine' or 'uniform', got {weighting!r}")
    sine = np.sqrt(1.0 - cosine**2)
    helper = np.where(np.abs(normals[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    b1 = np.cross(normals, helper)
    b1 /= np.linalg.norm(b1, axis=1, keepdims=True)
    b2 = np.cross(normals, b1)
    return (
        (sine * np.cos(phi))[..., None] * b1[:, None]
        + (sine * np.sin(phi))[..., None] * b2[:, None]
        + cosine[..., None] * normals[:, None]
    )


@dataclass(frozen=True)
class _Surface:
    """w as a + b ξ + c η + d ξη per cell, (ξ, η) the position in the cell; open cells have a = -inf."""

    coefficients: tuple[np.ndarray, ...]
    n_columns: int
    n_rows: int
    origin: float
    """Image coordinate of the first grid line."""
    own_cell_blocks: bool
    highest: float
    tolerance: float

    @staticmethod
    def of(field: Field, surface: str) -> "_Surface":
        w = np.where(np.isfinite(field.view_z), -field.view_z if field.orthographic else 1.0 / field.view_z, np.nan)
        if surface == "nearest":
            corners, origin = (w, w, w, w), 0.0
        elif surface == "linear":
            wide = np.column_stack([2 * w[:, 0] - w[:, 1], w, 2 * w[:, -1] - w[:, -2]])
            wide = np.vstack([2 * wide[0] - wide[1], wide, 2 * wide[-1] - wide[-2]])
            corners, origin = (wide[:-1, :-1], wide[:-1, 1:], wide[1:, :-1], wide[1:, 1:]), -0.5
        else:
            raise ValueError(f"surface must be 'linear' or 'nearest', got {surface!r}")
        c00, c10, c01, c11 = corners
        parts = (c00, c10 - c00, c01 - c00, c11 - c10 - c01 + c00)
        is_open = np.isnan(parts[3])
        return _Surface(
            coefficients=tuple(
                np.where(is_open, fill, part).ravel() for part, fill in zip(parts, (-np.inf, 0, 0, 0), strict=True)
            ),
            n_columns=c00.shape[1],
            n_rows=c00.shape[0],
            origin=origin,
            own_cell_blocks=surface == "linear",
            highest=float(np.nanmax(corners)),
            # Rounding of w along a ray; a ray that grazes a plane must not be blocked by it.
            tolerance=1e-12 * float(np.nanmax(np.abs(w))),
        )

    def blocked(self, field: Field, pixels, directions, radius) -> np.ndarray:
        """Whether each ray (origin pixel, unit direction) is blocked."""
        fx, fy = field.scale
        rows, columns = pixels[:, 0], pixels[:, 1]
        z0 = field.view_z[rows, columns]
        dx, dy, dz = directions[:, 0], directions[:, 1], -directions[:, 2]
        if field.orthographic:
            w0, slope = -z0, -dz
            sx, sy = fx * dx, -fy * dy
            end = np.full_like(z0, radius)
        else:
            px, py = columns + 0.5 - field.camera["cx"], rows + 0.5 - field.camera["cy"]
            w0, slope = 1.0 / z0, -dz / z0
            sx, sy = fx * dx - px * dz, -fy * dy - py * dz
            with np.errstate(divide="ignore", invalid="ignore"):
                depth = z0 + radius * dz if np.isfinite(radius) else np.where(dz > 0, np.inf, -np.inf)
                at_radius = 1.0 / dz if np.isinf(radius) else radius / depth
            # Rays toward the eye reach the eye plane (depth 0) at u = inf.
            end = np.where(depth > 0, at_radius, np.inf)
        end = np.minimum(end, self._exit(columns + 0.5, sx, field.view_z.shape[1]))
        end = np.minimum(end, self._exit(rows + 0.5, sy, field.view_z.shape[0]))
        rays = np.stack([columns + 0.5 - self.origin, rows + 0.5 - self.origin, sx, sy, w0, slope, end])
        return self._march(rays)

    @staticmethod
    def _exit(x, s, size) -> np.ndarray:
        """u at which x + s u leaves [0, size]."""
        with np.errstate(divide="ignore"):
            return np.where(s > 0, (size - x) / s, np.where(s < 0, -x / s, np.inf))

    def _march(self, rays) -> np.ndarray:
        blocked = np.zeros(rays.shape[1], dtype=bool)
        index = np.arange(rays.shape[1])
        x0, y0, sx, sy = rays[:4]
        step_x, step_y = np.where(sx > 0, 1, -1), np.where(sy > 0, 1, -1)
        # On a grid line the first cell is the one the ray enters.
        cx = np.where(sx > 0, np.floor(x0), np.ceil(x0) - 1).astype(np.int64)
        cy = np.where(sy > 0, np.floor(y0), np.ceil(y0) - 1).astype(np.int64)
        u = np.zeros_like(x0)
        own = np.full(len(index), not self.own_cell_blocks)
        while len(index):
            x0, y0, sx, sy, w0, slope, end = rays
            inside = (cx >= 0) & (cx < self.n_columns) & (cy >= 0) & (cy < self.n_rows)
            alive = inside & (u < end) & ((slope <= 0) | (w0 + slope * u <= self.highest))
            if not alive.all():
                keep = np.flatnonzero(alive)
                index, rays, u, own = index[keep], rays[:, keep], u[keep], own[keep]
                cx, cy, step_x, step_y = cx[keep], cy[keep], step_x[keep], step_y[keep]
                continue
            with np.errstate(divide="ignore", invalid="ignore"):
                ux = np.where(sx != 0, (cx + (step_x > 0) - x0) / sx, np.inf)
                uy = np.where(sy != 0, (cy + (step_y > 0) - y0) / sy, np.inf)
            crossing = np.minimum(ux, uy)
            u1 = np.maximum(np.minimum(crossing, end), u)
            hit = self._highest_excess(rays, cx, cy, u, u1) > self.tolerance
            hit &= ~own
            blocked[index[hit]] = True
            cx, cy = cx + np.where(ux <= crossing, step_x, 0), cy + np.where(uy <= crossing, step_y, 0)
            own[:] = False
            # A blocked or finished ray is retired by an interval that has no length left.
            u = np.where(hit, np.inf, u1)
        return blocked

    def _highest_excess(self, rays, cx, cy, u0, u1) -> np.ndarray:
        """Largest w_surface - w_ray over [u0, u1] within one cell (a quadratic of u)."""
        x0, y0, sx, sy, w0, slope, _ = rays
        cell = cy * self.n_columns + cx
        a, b, c, d = (p[cell] for p in self.coefficients)
        # A vertical ray has no end in the image: nothing but its own column can block it.
        last = np.where(np.isfinite(u1), u1, u0)
        xi0, eta0 = x0 + sx * u0 - cx, y0 + sy * u0 - cy
        xi1, eta1 = x0 + sx * last - cx, y0 + sy * last - cy
        f0 = a + b * xi0 + c * eta0 + d * xi0 * eta0 - w0 - slope * u0
        f1 = a + b * xi1 + c * eta1 + d * xi1 * eta1 - w0 - slope * last
        curvature = d * (xi1 - xi0) * (eta1 - eta0)
        # Open cells make f0 and f1 infinite, flat ones have no vertex.
        with np.errstate(divide="ignore", invalid="ignore"):
            vertex = f0 - (f1 - f0 - curvature) ** 2 / (4 * curvature)
            interior = (curvature < 0) & (np.abs(f1 - f0) < -curvature)
        return np.where(interior, vertex, np.maximum(f0, f1))
