"""Sectors of a slice that occluders of finite thickness close (Therrien et al. 2023)."""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from gtao.kernels import bitmask, fetch, horizon

__all__ = ["Sectors"]


@dataclass(frozen=True)
class Sectors:
    """A mask per side and the jitter of the slice.

    Attributes:
        mapping, n_sectors, rounding: see :mod:`gtao.kernels.bitmask`.
        arccosine: how the mapping "angle" finds angles, see :func:`gtao.kernels.arcs.fast_acos`.
        thickness: how far matter reaches behind a sample along its eye ray: "solid" without end, "constant" for
            ``amount`` scene units, "continuity" for ``amount`` or ``isolated`` by whether the depth of the sample is
            within ``gap`` of the one before it, "along_view" for ``amount`` but parallel to the shaded point's eye ray,
            "linear" for ``amount`` times the distance from the eye, or "measured" as ``layers`` say.
        cut: how a finite radius limits it: "sphere" exactly, "sample" ignores samples beyond it, "none" not at all.
        orthographic: whether eye rays are parallel.
        radius, amount, isolated, gap: see above.
        ax, ay: of :class:`gtao.kernels.march.Scalars`.
        key: selects the jitter.
        layers: pairs of flat arrays of depths at which the eye ray of a texel enters and leaves a body, front to back.
        size: width and height of the frame.
        types: namespace of :func:`gtao.backend.types_of`.
    """

    mapping: str
    n_sectors: int
    rounding: str
    arccosine: str
    thickness: str
    cut: str
    orthographic: bool
    radius: Any
    amount: Any
    isolated: Any
    gap: Any
    ax: Any
    ay: Any
    key: Any
    layers: tuple[tuple[Any, Any], ...]
    size: tuple[int, int]
    types: Any

    def begin(self, sl):
        if self.arccosine == "exact":
            constants, weight = bitmask.slice_map(self.mapping, sl.nV, sl.nT, sl.start)
        else:
            constants, weight = bitmask.approximate_map(sl.nV, sl.nT, self.arccosine)
        xi = bitmask.jitter(sl.pixel.x, sl.pixel.y, sl.index, self.key)
        empty = tuple(self.types.UInt(0) for _ in range(0, self.n_sectors, 32))
        before = -sl.pixel.P[2]
        return constants, weight, xi, (empty, empty), (before, before) if self.thickness == "continuity" else ()

    def add(self, state, side, sample, sl):
        constants, weight, xi, masks, before = state
        mine, amount = masks[side], self.amount
        if self.thickness == "continuity":
            amount = dr.select(abs(sample.z - before[side]) < self.gap, amount, self.isolated)
            before = _with(before, side, sample.z)
        for arc in self._arcs(sample, sl, amount):
            front, back = (self._position(constants, sl, side, c) for c in arc)
            closed = bitmask.sectors(front, back, side, xi, self.n_sectors, self.rounding)
            mine = tuple(a | b for a, b in zip(mine, closed, strict=True))
        return constants, weight, xi, _with(masks, side, mine), before

    def _position(self, constants, sl, side, c):
        if self.arccosine == "exact":
            return bitmask.position(self.mapping, constants, sl.start[side], side, c)
        return bitmask.approximate_position(constants, side, c, self.arccosine)

    def finish(self, state, sl):
        _, weight, _, masks, _ = state
        none = self.types.UInt(0)
        sides = zip(*masks, strict=True)
        closed = [dr.select(sl.inside[0], a, none) | dr.select(sl.inside[1], b, none) for a, b in sides]
        return weight * bitmask.visible_share(closed, self.n_sectors, self.types.Float)

    def _arcs(self, sample, sl, amount):
        """Cosines of the front and the back of what a sample blocks; NaN and -1 lie below every tangent plane."""
        X, Y, z = sample.X, sample.Y, sample.z
        if self.thickness == "measured":
            width, height = self.size
            for k, layer in enumerate(self.layers):
                front, back = (fetch.nearest(b, sample.x, sample.y, width, height, self.types)[0] for b in layer)
                body = self._behind(sample, front - z, sl) if k else (sample.c, sample.d2, sample.dV)
                yield self._within(body, sample, sl, self._behind(sample, back - z, sl)[0])
            return
        if self.thickness == "solid":
            back = -1
        elif self.thickness == "along_view":
            away = tuple(dr.fma(-amount, v, d) for d, v in zip(sample.D, sl.pixel.V, strict=True))
            back = horizon.cosine(away, sl.pixel.V)[0]
        elif self.thickness == "linear":
            back = self._behind(sample, amount * z, sl)[0]
        else:
            depth = amount if self.orthographic else amount * dr.rsqrt(dr.fma(X, X, dr.fma(Y, Y, 1)))
            back = self._behind(sample, depth, sl)[0]
        yield self._within((sample.c, sample.d2, sample.dV), sample, sl, back)

    def _behind(self, sample, depth, sl):
        """:func:`gtao.kernels.horizon.cosine` of the point behind a sample, ``depth`` deeper on its eye ray."""
        Dx, Dy, Dz = sample.D
        if not self.orthographic:
            Dx, Dy = dr.fma(sample.X, depth, Dx), dr.fma(sample.Y, depth, Dy)
        return horizon.cosine((Dx, Dy, Dz - depth), sl.pixel.V)

    def _within(self, body, sample, sl, back):
        """The arc from the front of a body to its back, as far as it lies within the radius."""
        pixel, (front, d2, dV) = sl.pixel, body
        if self.cut == "sample":
            near = d2 <= self.radius * self.radius
            return dr.select(near, front, -1), dr.select(near, back, -1)
        if self.cut == "none":
            return front, back
        dX, dY = (sample.x - pixel.x) * self.ax, (sample.y - pixel.y) * self.ay
        apart2 = horizon.apart_squared(dX, dY, pixel.X, pixel.Y, pixel.rcp_a2, sample.X, sample.Y, self.orthographic)
        upper, lower = horizon.cut_at_sphere(front, d2, dV, apart2, pixel.p, self.radius, self.orthographic)
        if self.thickness != "solid":
            lower = dr.select(back > lower, back, lower)
        return upper, dr.select(lower < upper, lower, upper)


def _with(pair, side, value):
    """The pair with one of its two sides replaced."""
    return (value, pair[1]) if side == 0 else (pair[0], value)
