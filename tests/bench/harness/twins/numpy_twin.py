"""The estimator in NumPy: whole-array arithmetic in float32, a block of rows at a time so that it stays in cache."""

import numpy as np

from .convention import PACKAGE
from .noise import directions, pattern

__all__ = ["ROWS", "build"]

ROWS = 16
#: A sample that is held at the border may be the shaded point itself.
TINY = np.float32(1e-12)


def build(frame, work, convention=PACKAGE, rows=ROWS):
    """A callable without arguments that returns the visibility, (H, W) in float32."""
    out = np.empty_like(frame.view_z)

    def run():
        for top in range(0, work.height, rows):
            block = slice(top, min(top + rows, work.height))
            out[block] = _rows(frame, work, convention, block)
        return out

    return run


def _rows(frame, work, convention, block):
    f = np.float32
    rcp_f = f(1 / work.focal_px)
    centre = f(work.width / 2 - 0.5), f(work.height / 2 - 0.5)
    scale, offset = f(-1 / (work.radius - work.full)), f(work.radius / (work.radius - work.full))
    y, x = (a.astype(f) for a in np.mgrid[block, : work.width])
    z = frame.view_z[block]
    # Image down is -y of the frame, and the camera looks along -z.
    P = (x - centre[0]) * rcp_f * z, (centre[1] - y) * rcp_f * z, -z
    rcp_p = f(-1) / np.sqrt(P[0] * P[0] + P[1] * P[1] + z * z)
    V = tuple(c * rcp_p for c in P)
    N = np.moveaxis(frame.normal_v[block], -1, 0)
    nV = N[0] * V[0] + N[1] * V[1] + N[2] * V[2]
    reach = np.minimum(f(work.radius * work.focal_px) / z, f(work.max_radius_px))
    rotation, jitter = pattern(range(block.start, block.stop), range(work.width))
    total = np.zeros_like(z)
    for dx, dy in zip(*(table[:, rotation] for table in directions(work.n_slices, convention.y_down)), strict=True):
        dV = dx * V[0] - dy * V[1]
        nT = (dx * N[0] - dy * N[1] - dV * nV) / np.sqrt(1 - dV * dV)
        tangent = nT / np.sqrt(nT * nT + nV * nV)
        horizons = []
        for side, start in ((f(-1), tangent), (f(1), -tangent)):
            best = start
            for j in range(work.n_steps):
                t = (jitter + f(j)) * f(1 / work.n_steps)
                d = (t * t * reach + 1) * side
                tx, ty, zs = _fetch(frame.view_z, x + dx * d, y + dy * d, convention.held)
                D = (tx - centre[0]) * rcp_f * zs - P[0], (centre[1] - ty) * rcp_f * zs - P[1], z - zs
                distance = np.sqrt(D[0] * D[0] + D[1] * D[1] + D[2] * D[2] + TINY)
                c = (D[0] * V[0] + D[1] * V[1] + D[2] * V[2]) / distance
                w = np.clip(distance * scale + offset, 0, 1)
                best = np.maximum(best, start + w * (c - start))
            horizons.append(np.minimum(best, 1))
        total += _arc(nV, nT, *horizons)
    return total * f(1 / work.n_slices)


def _fetch(view_z, x, y, held):
    """The nearest texel's coordinates and depth."""
    height, width = view_z.shape
    tx, ty = np.rint(x), np.rint(y)
    inside = np.clip(tx, 0, width - 1), np.clip(ty, 0, height - 1)
    z = view_z[inside[1].astype(np.int32), inside[0].astype(np.int32)]
    return (*inside, z) if held else (tx, ty, z)


def _arc(nV, nT, c0, c1):
    """Cosine-weighted integral between two horizon cosines: theory, eq. (12)."""
    q0, q1 = 1 - c0 * c0, 1 - c1 * c1
    k0, k1 = np.arccos(c0) - c0 * np.sqrt(q0), np.arccos(c1) - c1 * np.sqrt(q1)
    return np.float32(0.5) * (nV * (q0 + q1) + nT * (k1 - k0))
