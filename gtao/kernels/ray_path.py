"""Rays over a depth buffer: is this one ever behind the surface?

Along a ray P + t d the parameter u = t/z(t) (perspective) or u = t (parallel projection) makes the image position *and*
w (see :mod:`gtao.kernels.depth_cells`) linear in u (theory, eq. (76)). The ray is a straight line over the image, and
blocked where the surface's w exceeds its own.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import drjit as dr

__all__ = ["Path", "found_behind", "over_image", "passes_behind"]

FAR = 1e30
# Slower sideways than this a ray counts as parallel to its eye ray.
PARALLEL = 1e-20


@dataclass(frozen=True)
class Path:
    """A ray over the image: position (x + sx u, y + sy u), w = w0 + slope u, for u up to ``end``."""

    x: Any
    y: Any
    sx: Any
    sy: Any
    rcp_sx: Any
    rcp_sy: Any
    slope: Any
    end: Any
    w0: Any

    def at(self, u):
        return dr.fma(self.sx, u, self.x), dr.fma(self.sy, u, self.y)


def over_image(d, point, w0, cells, view, unlimited):
    """The path of a ray up to the end of the radius or the border of the frame.

    Args:
        d: its unit direction.
        point: texel coordinates (x, y), image-plane coordinates (X, Y) and depth z of its origin.
        w0: w of its origin.
        cells, view: :class:`gtao.kernels.depth_cells.DepthCells` and :class:`gtao.kernels.depth_cells.View`.
        unlimited: the radius is infinite.
    """
    x, y, X, Y, z = point
    dz = -d[2]
    if cells.orthographic:
        sx, sy, slope = view.fx * d[0], -view.fy * d[1], -dz
        end = FAR if unlimited else view.radius
    else:
        sx, sy, slope = view.fx * dr.fma(-X, dz, d[0]), -view.fy * dr.fma(-Y, dz, d[1]), -dz / z
        # A ray toward the plane of the eye comes to its end beyond all u.
        if unlimited:
            end = dr.select(dz > 0, 1 / dz, FAR)
        else:
            depth = dr.fma(view.radius, dz, z)
            end = dr.select(depth > 0, view.radius / depth, FAR)
    sx, sy = dr.select(abs(sx) > PARALLEL, sx, PARALLEL), dr.select(abs(sy) > PARALLEL, sy, PARALLEL)
    rcp_sx, rcp_sy = 1 / sx, 1 / sy
    for other in (
        (dr.select(sx > 0, cells.width - 0.5, -0.5) - x) * rcp_sx,
        (dr.select(sy > 0, cells.height - 0.5, -0.5) - y) * rcp_sy,
        FAR,
    ):
        end = dr.select(end < other, end, other)
    return Path(x, y, sx, sy, rcp_sx, rcp_sy, slope, end, w0)


def passes_behind(path: Path, cells, bounds, active, types):
    """Whether the ray is blocked, exactly: the highest excess of the surface in every cell that it may touch.

    Two loops, so that lanes wait for each other only where they have something to do (Aila and Laine 2009): the inner
    one goes from node to node of the pyramid to the next cell whose bound is not below the ray, the outer one looks at
    that cell. A node that is passed over makes the next one larger, one that is not makes it smaller.
    """
    Int = types.Int
    right, down = path.sx > 0, path.sy > 0
    ahead_x, ahead_y = dr.select(right, Int(1), 0), dr.select(down, Int(1), 0)

    def leave(cx, cy, level, u):
        """Where the ray leaves the node of a cell: u, and the cell beyond."""
        low_x, low_y, size = (cx >> level) << level, (cy >> level) << level, Int(1) << level
        line_x, line_y = low_x + ahead_x * size, low_y + ahead_y * size
        ux, uy = (types.Float(line_x) - path.x) * path.rcp_sx, (types.Float(line_y) - path.y) * path.rcp_sy
        sideways = ux <= uy
        last = dr.select(sideways, ux, uy)
        last = dr.select(last < path.end, last, path.end)
        last = dr.select(last > u, last, u)
        px, py = path.at(last)
        along_x, along_y = _into(Int(dr.floor(px)), low_x, size), _into(Int(dr.floor(py)), low_y, size)
        return (
            last,
            dr.select(sideways, line_x - 1 + ahead_x, along_x),
            dr.select(sideways, along_y, line_y - 1 + ahead_y),
        )

    def skip(u, cx, cy, level, found):
        last, next_x, next_y = leave(cx, cy, level, u)
        lowest = path.slope * dr.select(path.slope > 0, u, last)
        touches = bounds.at(cx, cy, types.UInt(level)) - path.w0 > lowest
        smaller = dr.select(level > 0, level - 1, 0)
        larger = dr.select(level < bounds.depth, level + 1, level)
        return (
            dr.select(touches, u, last),
            dr.select(touches, cx, next_x),
            dr.select(touches, cy, next_y),
            dr.select(touches, smaller, larger),
            touches & (level == 0),
        )

    def look(u, cx, cy, hit):
        width = dr.width(path.x)
        u, cx, cy, _, found = dr.while_loop(
            (u, cx, cy, dr.zeros(Int, width), dr.full(types.Bool, False, width)),
            lambda u, cx, cy, level, found: ~found & (u < path.end),
            skip,
            label="blocks",
        )
        cell = cells.read(types.Float(cx), types.Float(cy), path.w0)
        last, cx, cy = leave(cx, cy, Int(0), u)
        excess = dr.select(cell.edge, _excess_of_texels(path, cell, u, last), _excess(path, cell, u, last))
        return last, cx, cy, found & (excess > 0)

    x, y = Int(path.x), Int(path.y)
    start = (
        dr.zeros(types.Float, dr.width(path.x)),
        dr.select(right, x, x - 1),
        dr.select(down, y, y - 1),
        dr.full(types.Bool, False, dr.width(path.x)),
    )
    *_, hit = dr.while_loop(start, lambda u, cx, cy, hit: active & ~hit & (u < path.end), look, label="cells")
    return hit


def _into(value, low, size):
    return dr.select(value < low, low, dr.select(value < low + size, value, low + size - 1))


def _excess(path: Path, cell, u0, u1):
    """Largest excess of the bilinear surface over the ray between u0 and u1: a quadratic of u."""
    f0, f1 = (dr.fma(-path.slope, u, cell.bilinear_along(path.x, path.y, path.sx, path.sy, u)) for u in (u0, u1))
    bend = cell.coefficients[3] * (path.sx * (u1 - u0)) * (path.sy * (u1 - u0))
    rise = f1 - f0
    inside = (bend < 0) & (abs(rise) < -bend)
    summit = f0 - (rise - bend) * (rise - bend) / (4 * dr.select(inside, bend, -1))
    return dr.select(inside, summit, dr.select(f0 > f1, f0, f1))


def _excess_of_texels(path: Path, cell, u0, u1):
    """The same in a cell that falls apart into texels; the ray's own texel does not block it."""
    bx, by = (cell.x + 0.5 - path.x) * path.rcp_sx, (cell.y + 0.5 - path.y) * path.rcp_sy
    bx, by = (dr.select(b > u0, dr.select(b < u1, b, u1), u0) for b in (bx, by))
    breaks = (u0, dr.select(bx < by, bx, by), dr.select(bx < by, by, bx), u1)
    highest = -dr.inf
    for a, b in pairwise(breaks):
        value, tx, ty = cell.texel(*path.at(0.5 * (a + b)))
        excess = dr.fma(-path.slope, dr.select(path.slope > 0, a, b), value)
        counts = (b > a) & ~((tx == path.x) & (ty == path.y)) & (excess > highest)
        highest = dr.select(counts, excess, highest)
    return highest


def found_behind(path: Path, cells, n_steps, jitter, active, types):
    """Whether the ray is behind the surface at one of ``n_steps`` places, evenly spread over its path and jittered."""
    spacing = path.end * (1 / n_steps)

    def body(step, hit):
        u = (types.Float(step) + jitter) * spacing
        value, tx, ty = cells.at(*path.at(u), path.w0)
        own = (tx == path.x) & (ty == path.y)
        return step + 1, ~own & (dr.fma(-path.slope, u, value) > 0)

    start = (dr.zeros(types.UInt, dr.width(path.x)), dr.full(types.Bool, False, dr.width(path.x)))
    _, hit = dr.while_loop(start, lambda step, hit: active & ~hit & (step < n_steps), body, label="steps")
    return hit
