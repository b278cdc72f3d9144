"""Dense slices through a depth buffer, each direction of a slice open or blocked by itself.

The image of a half-slice (:mod:`gtao.kernels.direction_nodes`) is a line that starts at the pixel; it is followed
through every cell of the depth buffer. The solid behind the surface blocks an interval of angles at every place of the
line (:mod:`gtao.kernels.blocked_angles`). What is left of the weight of all directions after the last cell is visible.
Nothing is assumed about how blocked angles hang together, and nothing is integrated in closed form.
"""

import math
from dataclasses import dataclass

import drjit as dr

from . import noise
from .blocked_angles import Line, swept
from .depth_cells import basis
from .direction_nodes import Nodes
from .open_directions import Sums

__all__ = ["Switches", "visibility"]

# Length in pixels below which a piece of a cell is passed over, and where the line begins.
SLIVER = 1 / 1024


@dataclass(frozen=True)
class Switches:
    """What specialises the kernel."""

    n_slices: int
    n_words: int  # of 32 nodes per half-slice
    longest_px: float  # of a piece of a line that is looked at at once
    weighting: str
    unlimited: bool  # the radius is infinite
    directions: bool  # sum the open directions too


def visibility(view_z, cells, normal, k: Switches, view, types):
    """Share of the weighted hemisphere that is open, 1 on the background.

    With ``k.directions`` the second result is :meth:`gtao.kernels.open_directions.Sums.in_view` of the same nodes and
    weights, 0 on the background; else it is empty.

    Args:
        view_z: flat depth, inf on the background.
        cells: :class:`gtao.kernels.depth_cells.DepthCells` of the same depth.
        normal: three flat arrays, unit normals in the view frame.
        view: :class:`gtao.kernels.depth_cells.View`.
        types: namespace of :func:`gtao.backend.types_of`.
    """
    Float, UInt = types.Float, types.UInt
    index = dr.arange(UInt, cells.width * cells.height)
    yi = index // cells.width
    xi = index - yi * cells.width
    x, y = Float(xi), Float(yi)
    surface = dr.isfinite(view_z)
    z = dr.select(surface, view_z, 1)
    w0 = cells.w(z)
    X, Y = dr.fma(x, view.ax, view.bx), dr.fma(y, view.ay, view.by)
    if cells.orthographic:
        V, lean = (Float(0), Float(0), Float(1)), Float(1)
    else:
        lean = dr.sqrt(dr.fma(X, X, dr.fma(Y, Y, 1)))
        V = (-X / lean, -Y / lean, 1 / lean)
    point = (x, y, X, Y, z, lean)
    nV = dr.fma(normal[0], V[0], dr.fma(normal[1], V[1], normal[2] * V[2]))
    b1, b2 = basis(V)
    rotation, jitter = noise.pattern("white", xi, yi, view, Float)

    cosine = k.weighting == "cosine"
    n_moments = 5 if k.directions else 1

    def body(i, offset, open_weight, weight, *directions):
        q, c = dr.sincos((Float(i) + rotation) * (math.pi / k.n_slices))
        T = tuple(dr.fma(c, a, q * b) for a, b in zip(b1, b2, strict=True))
        nT = dr.fma(normal[0], T[0], dr.fma(normal[1], T[1], normal[2] * T[2]))
        nodes = Nodes.of(nV, nT, offset, k.n_words)
        line = Line.of(T, V, point, cells, view, k.unlimited)
        blocked = _blocked(line, nodes, cells, w0, surface, k, types)
        seen, *moments, whole = nodes.weigh(blocked, cosine, types, n_moments)
        if k.directions:
            directions = (a + b for a, b in zip(directions, _sums(c, q, seen, *moments), strict=True))
        return i + 1, noise.frac(offset + noise.GOLDEN), open_weight + seen, weight + whole, *directions

    width = dr.width(x)
    zero = dr.zeros(Float, width)
    directions = Sums.zero(Float, width) if k.directions else ()
    _, _, open_weight, weight, *directions = dr.while_loop(
        (UInt(0), jitter, zero, zero, *directions), lambda i, *_: i < 2 * k.n_slices, body, label="half-slices"
    )
    share = open_weight / weight
    visible = dr.select(surface, share, 1)
    if not k.directions:
        return visible, ()
    means = Sums(*(total / weight for total in directions))
    return visible, tuple(dr.select(surface, mean, 0) for mean in means.in_view(share, (b1, b2, V)))


def _sums(c, q, seen, s1, c1, ss, sc):
    """Sums of a half-slice with the tangent c b1 + q b2, in the frame (b1, b2, V), from its moments in the plane."""
    return Sums(
        x=s1 * c, y=s1 * q, z=c1, xy=ss * (c * q), yz=sc * q, zz=seen - ss, xz=sc * c, xx_yy=ss * dr.fma(c, c, -q * q)
    )


def _blocked(line: Line, nodes: Nodes, cells, w0, active, k, types):
    """The blocked nodes of a half-slice, as words of bits."""
    Float = types.Float
    ahead_x, ahead_y = dr.select(line.dx > 0, Float(1), 0), dr.select(line.dy > 0, Float(1), 0)
    rcp_dx, rcp_dy = 1 / line.dx, 1 / line.dy

    def body(t, enter, leave, *blocked):
        # A little ahead, beyond what is rounded, the line is inside a cell and not on the border of two.
        ahead = dr.fma(t, 1 + 8 * dr.epsilon(Float), SLIVER)
        px, py = line.at(ahead)
        cell = cells.read(dr.floor(px), dr.floor(py), w0)
        grid = dr.select(cell.edge, Float(0.5), 1)
        stop = (dr.fma(dr.floor(px / grid) + ahead_x, grid, -line.x)) * rcp_dx
        for other in (
            (dr.fma(dr.floor(py / grid) + ahead_y, grid, -line.y)) * rcp_dy,
            t + k.longest_px,
            line.next_within_sphere(t),
            line.end,
        ):
            stop = dr.select(stop < other, stop, other)
        stop = dr.select(stop > ahead, stop, ahead)

        texel, tx, ty = cell.texel(px, py)
        own = cell.edge & (tx == line.x) & (ty == line.y)
        near = dr.select(cell.edge, texel, cell.bilinear_along(*line.course, t))
        far = dr.select(cell.edge, texel, cell.bilinear_along(*line.course, stop))
        enter1, leave1 = (Float(angle) for angle in line.sphere(stop))
        first, last = swept((line.surface(t, near), enter, leave), (line.surface(stop, far), enter1, leave1))
        bits = nodes.between(first, dr.select(own, -dr.inf, last), types)
        return stop, enter1, leave1, *(b | new for b, new in zip(blocked, bits, strict=True))

    start = dr.full(Float, SLIVER, dr.width(line.x))
    words = (dr.zeros(types.UInt, dr.width(line.x)) for _ in range(k.n_words))
    state = dr.while_loop(
        (start, *(Float(angle) for angle in line.sphere(start)), *words),
        lambda t, *_: active & (t < line.end),
        body,
        label="cells",
    )
    return state[3:]
