"""The surface that a depth buffer stands for, cell by cell, as both brute-force references see it.

It is written in w = 1/z (perspective) or w = -z (parallel projection): nearer is larger, and w is affine in the image
along every straight line of space (theory, eq. (30)). "Behind the surface" is "smaller w".

The cell (x, y) has the texel centres (x, y) and (x+1, y+1) as corners. Inside, w is bilinear, unless the cell straddles
a depth edge (eq. (31)): then each texel owns the quarter beside its centre, at its own depth. The half pixel around the
outermost centres continues their cells. With the nearest fetch all cells fall apart like this.
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr

__all__ = ["Cell", "DepthCells", "View", "basis"]


@dataclass(frozen=True)
class View:
    """What both references need of camera and method, values of width one and opaque to the compiler."""

    ax: Any  # image-plane coordinate of texel column i: ax i + bx
    bx: Any
    ay: Any
    by: Any
    fx: Any
    fy: Any
    radius: Any
    key: Any


@dataclass(frozen=True)
class Cell:
    """One cell: w less the shaded point's, in the corner texels and as a + b ξ + c η + d ξη from corner (x, y)."""

    x: Any
    y: Any
    corners: tuple[Any, Any, Any, Any]  # 00, 10, 01, 11
    edge: Any

    @property
    def coefficients(self):
        f00, f10, f01, f11 = self.corners
        return f00, f10 - f00, f01 - f00, (f11 - f10) - (f01 - f00)

    def bilinear(self, xi, eta):
        """The smooth surface at the offset (ξ, η) from the first corner."""
        a, b, c, d = self.coefficients
        return dr.fma(eta, dr.fma(d, xi, c), dr.fma(b, xi, a))

    def bilinear_along(self, x, y, dx, dy, t):
        """The smooth surface at (x + dx t, y + dy t), which keeps the digits of a small t."""
        return self.bilinear(dr.fma(dx, t, x - self.x), dr.fma(dy, t, y - self.y))

    def texel(self, x, y):
        """The depth of the texel under (x, y), and that texel's coordinates."""
        right, low = x - self.x > 0.5, y - self.y > 0.5
        f00, f10, f01, f11 = self.corners
        value = dr.select(low, dr.select(right, f11, f01), dr.select(right, f10, f00))
        return value, dr.select(right, self.x + 1, self.x), dr.select(low, self.y + 1, self.y)


@dataclass(frozen=True)
class DepthCells:
    """Reads the cells of ``field``, which is what :func:`gtao.kernels.fetch.affine_field` made."""

    field: Any
    width: int
    height: int
    orthographic: bool
    nearest: bool
    types: Any

    @classmethod
    def of(cls, field, width, height, orthographic, nearest, types):
        """With ``nearest`` the depth edges of the field do not matter: every cell is one."""
        return cls(-abs(field) if nearest else field, width, height, orthographic, nearest, types)

    def w(self, view_z):
        return -view_z if self.orthographic else 1 / view_z

    def read(self, x, y, w0):
        """The cell whose first corner is (x, y), or beyond the outermost centres the cell that continues there.

        Args:
            x, y: integers given as floats, anywhere.
            w0: w of the shaded point, from which the corners are counted: the difference keeps its digits.
        """
        T = self.types
        x, y = _within(x, self.width - 2), _within(y, self.height - 2)
        index = T.UInt(y) * self.width + T.UInt(x)
        # A single row or column has no cells; its texels stand for both corners.
        right, down = min(1, self.width - 1), self.width * min(1, self.height - 1)
        raw = [dr.gather(T.Float, self.field, index + step) for step in (0, right, down, right + down)]
        edge = dr.copysign(T.Float(1), raw[0]) < 0
        corners = [-abs(f) if self.orthographic else abs(f) for f in raw]
        return Cell(x, y, tuple(f - w0 for f in corners), edge)

    def at(self, x, y, w0):
        """The surface at (x, y), counted from ``w0``, and the point whose depth it is: a texel's centre or (x, y)."""
        T = self.types
        if self.nearest:
            tx, ty = _within(dr.round(x), self.width - 1), _within(dr.round(y), self.height - 1)
            f = abs(dr.gather(T.Float, self.field, T.UInt(ty) * self.width + T.UInt(tx)))
            return (-f if self.orthographic else f) - w0, tx, ty
        cell = self.read(dr.floor(x), dr.floor(y), w0)
        value, tx, ty = cell.texel(x, y)
        return (
            dr.select(cell.edge, value, cell.bilinear(x - cell.x, y - cell.y)),
            dr.select(cell.edge, tx, x),
            dr.select(cell.edge, ty, y),
        )

    def bounds(self):
        """Largest w of the surface in the cell of every texel, flat; the outermost cells reach beyond the centres."""
        T = self.types
        index = dr.arange(T.UInt, self.width * self.height)
        row = index // self.width
        cell = self.read(T.Float(index - row * self.width), T.Float(row), 0)
        top = cell.corners[0]
        for corner in cell.corners[1:]:
            top = dr.select(corner > top, corner, top)
        # Bilinear w is largest in a corner of its domain.
        left, right = _ends(cell.x, self.width - 2)
        up, down = _ends(cell.y, self.height - 2)
        for x in (left, right):
            for y in (up, down):
                value = cell.bilinear(x - cell.x, y - cell.y)
                top = dr.select(~cell.edge & (value > top), value, top)
        return top


def _ends(first, last):
    """Where the cells that begin at ``first`` begin and end, the outermost ones half a pixel further out."""
    return dr.select(first > 0, first, -0.5), dr.select(first < last, first + 1, first + 1.5)


def _within(x, last):
    last = max(last, 0)
    return dr.select(x < 0, 0, dr.select(x > last, last, x))


def basis(n):
    """Two unit vectors that complete the unit vector ``n`` to a right-handed frame (Duff et al. 2017)."""
    sign = dr.copysign(type(n[2])(1), n[2])
    a = -1 / (sign + n[2])
    b = n[0] * n[1] * a
    return (dr.fma(sign * n[0], n[0] * a, 1), sign * b, -sign * n[0]), (b, dr.fma(n[1], n[1] * a, sign), -n[1])
