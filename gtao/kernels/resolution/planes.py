"""How much each texel of a small frame counts for a pixel of the larger one: by their tangent planes."""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from .cells import Texel
from .weights import fourth_power

__all__ = ["Surface", "plane_aware"]

# Total weight of the 2×2 texels up to which a wider footprint is looked at: a sixteenth is that of one texel of the
# pixel's surface in the far corner of its cell, at half resolution.
LITTLE = 1 / 16
# What the texel found there counts, before its distance: about what one of the 2×2 does.
WIDER = 0.25
# Texels per axis of the wider footprint.
WIDE = 4


@dataclass(frozen=True)
class Surface:
    """A frame: flat depth, inf on the background, unit normals, three numbers per pixel, and how it is seen.

    ``view`` is a :class:`gtao.kernels.filters.View`.
    """

    view_z: Any
    normal: Any
    view: Any

    def read(self, index, x, y, types):
        """Point, normal and depth at pixel (x, y), floats, and whether there is a surface."""
        z = dr.gather(types.Float, self.view_z, index)
        there = dr.isfinite(z)
        z = dr.select(there, z, 1)
        normal = tuple(dr.gather(types.Float, self.normal, 3 * index + axis) for axis in range(3))
        return self.view.position(x, y, z), normal, z, there


@dataclass(frozen=True)
class Surroundings:
    """How far the texels of a small frame are from the surface at the pixels of a larger one."""

    point: Any
    normal: Any
    z: Any
    small: Surface
    scale: Any  # reciprocals of the tolerances of distance, per pixel width, and of turn
    turn: Any
    types: Any

    @classmethod
    def of(cls, cells, own: Surface, small: Surface, tolerance, angle):
        """For arguments see :func:`plane_aware`."""
        index = dr.arange(cells.types.UInt, dr.width(cells.x))
        point, normal, z, _ = own.read(index, cells.x, cells.y, cells.types)
        scale, turn = 1 / (tolerance * small.view.pixel), 1 / (1 - dr.cos(angle))
        return cls(point, normal, z, small, scale, turn, cells.types)

    def apart(self, texel: Texel):
        """(d/τ)⁴ + e² of distance and turn, and whether the texel is a surface."""
        point, normal, z, there = self.small.read(texel.index, texel.x, texel.y, self.types)
        D = tuple(a - b for a, b in zip(point, self.point, strict=True))
        off, back = abs(_dot(self.normal, D)), abs(_dot(normal, D))
        far = dr.select(off > back, off, back)
        width = self.scale if self.small.view.orthographic else self.scale / (0.5 * (z + self.z))
        turn = (1 - _dot(self.normal, normal)) * self.turn
        return dr.fma(turn, turn, fourth_power(far * width)), there

    def nearest(self, cells, active):
        """Of the 4×4 texels around every active pixel the one that is least apart."""
        n = WIDE * WIDE

        def texel(k):
            return cells.texel(cells.types.Float(k % WIDE) - 1, cells.types.Float(k // WIDE) - 1)

        def body(k, least, best):
            q, there = self.apart(texel(k))
            better = there & (q < least)
            return k + 1, dr.select(better, q, least), dr.select(better, k, best)

        # The 2×2 are in the middle; a packet of pixels without an active one leaves at once.
        start = dr.select(active, self.types.UInt(0), n)
        state = (start, dr.full(self.types.Float, dr.inf, dr.width(start)), start * 0 + (WIDE + 1))
        _, _, best = dr.while_loop(state, lambda k, least, best: k < n, body)
        return texel(best)


def plane_aware(cells, own: Surface, small: Surface, tolerance, angle):
    """Texels and their weights by distance from the tangent planes and turn; theory, eqs. (184) to (186).

    Args:
        cells: :class:`Cells`.
        tolerance: distance, in pixels of the small frame, that halves a weight.
        angle: between two normals, that halves a weight.
    """
    texels = cells.nearest()
    around = Surroundings.of(cells, own, small, tolerance, angle)
    weights, total = [], cells.types.Float(0)
    for t in texels:
        q, there = around.apart(t)
        weights.append(dr.select(there, t.share / (1 + q), 0))
        total += weights[-1]
    # Which texel of the wider footprint is the nearest has no derivative.
    with dr.suspend_grad():
        little = total < LITTLE
        best = around.nearest(cells, little)
    q, there = around.apart(best)
    missing = 1 - total * (1 / LITTLE)
    weights.append(dr.select(there & little, WIDER * missing / (1 + q), 0))
    return [*texels, best], weights


def _dot(a, b):
    return dr.fma(a[0], b[0], dr.fma(a[1], b[1], a[2] * b[2]))
