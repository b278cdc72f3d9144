"""The estimator in Numba: one loop over the pixels, compiled with fast arithmetic, rows shared among threads."""

import math
from typing import NamedTuple

import numba
import numpy as np
from numba import njit, prange

from .convention import PACKAGE
from .noise import directions

__all__ = ["build"]

ONE, ZERO, HALF, QUARTER, PI = (np.float32(v) for v in (1, 0, 0.5, 0.25, math.pi))
#: A sample that is held at the border may be the shaded point itself.
TINY = np.float32(1e-12)
#: Abramowitz & Stegun 4.4.45, error up to 7e-5: a library call per horizon would cost more than the search.
A0, A1, A2, A3 = (np.float32(v) for v in (1.5707288, -0.2121144, 0.0742610, -0.0187293))


@njit(fastmath=True, inline="always")
def _acos(x):
    a = abs(x)
    p = (((A3 * a + A2) * a + A1) * a + A0) * math.sqrt(max(ONE - a, ZERO))
    return PI - p if x < ZERO else p


@njit(fastmath=True, inline="always")
def _horizon(view_z, x, y, dx, dy, start, jitter, n_steps, reach, P, V, s, held):
    best = start
    for j in range(n_steps):
        t = (np.float32(j) + jitter) * s.rcp_steps
        d = t * t * reach + ONE
        tx, ty = np.rint(x + dx * d), np.rint(y + dy * d)
        ix, iy = min(max(tx, ZERO), s.last_x), min(max(ty, ZERO), s.last_y)
        z = view_z[np.int32(iy), np.int32(ix)]
        if held:
            tx, ty = ix, iy
        Dx, Dy, Dz = (tx - s.cx) * s.rcp_f * z - P[0], (s.cy - ty) * s.rcp_f * z - P[1], -z - P[2]
        distance = math.sqrt(Dx * Dx + Dy * Dy + Dz * Dz + TINY)
        c = (Dx * V[0] + Dy * V[1] + Dz * V[2]) / distance
        w = min(max(distance * s.scale + s.offset, ZERO), ONE)
        best = max(best, start + w * (c - start))
    return min(best, ONE)


@njit(parallel=True, fastmath=True)
def _kernel(view_z, normal_v, cosines, sines, out, s, n_steps, held):
    height, width = view_z.shape
    n_slices = cosines.shape[0]
    for row in prange(height):
        for column in range(width):
            x, y, z = np.float32(column), np.float32(row), view_z[row, column]
            P = ((x - s.cx) * s.rcp_f * z, (s.cy - y) * s.rcp_f * z, -z)
            rcp_p = -ONE / math.sqrt(P[0] * P[0] + P[1] * P[1] + z * z)
            V = (P[0] * rcp_p, P[1] * rcp_p, P[2] * rcp_p)
            nx, ny, nz = normal_v[row, column, 0], normal_v[row, column, 1], normal_v[row, column, 2]
            nV = nx * V[0] + ny * V[1] + nz * V[2]
            reach = min(s.reach / z, s.longest)
            rotation = (((column + row) & 3) << 2) + (column & 3)
            jitter = np.float32((row - column) & 3) * QUARTER
            total = ZERO
            for i in range(n_slices):
                dx, dy = cosines[i, rotation], sines[i, rotation]
                dV = dx * V[0] - dy * V[1]
                nT = (dx * nx - dy * ny - dV * nV) / math.sqrt(ONE - dV * dV)
                tangent = nT / math.sqrt(nT * nT + nV * nV)
                c0 = _horizon(view_z, x, y, -dx, -dy, tangent, jitter, n_steps, reach, P, V, s, held)
                c1 = _horizon(view_z, x, y, dx, dy, -tangent, jitter, n_steps, reach, P, V, s, held)
                q0, q1 = ONE - c0 * c0, ONE - c1 * c1
                k0, k1 = _acos(c0) - c0 * math.sqrt(q0), _acos(c1) - c1 * math.sqrt(q1)
                total += HALF * (nV * (q0 + q1) + nT * (k1 - k0))
            out[row, column] = total / np.float32(n_slices)


class Scalars(NamedTuple):
    """What the kernel needs of the work, in float32."""

    cx: np.float32
    cy: np.float32
    rcp_f: np.float32
    reach: np.float32
    longest: np.float32
    scale: np.float32
    offset: np.float32
    rcp_steps: np.float32
    last_x: np.float32
    last_y: np.float32


def build(frame, work, convention=PACKAGE, threads=1):
    """A callable without arguments that returns the visibility, (H, W) in float32."""
    scalars = Scalars(
        *map(
            np.float32,
            (
                work.width / 2 - 0.5,
                work.height / 2 - 0.5,
                1 / work.focal_px,
                work.radius * work.focal_px,
                work.max_radius_px,
                -1 / (work.radius - work.full),
                work.radius / (work.radius - work.full),
                1 / work.n_steps,
                work.width - 1,
                work.height - 1,
            ),
        )
    )
    cosines, sines = directions(work.n_slices, convention.y_down)
    out = np.empty_like(frame.view_z)

    def run():
        numba.set_num_threads(threads)
        _kernel(frame.view_z, frame.normal_v, cosines, sines, out, scalars, work.n_steps, convention.held)
        return out

    return run
