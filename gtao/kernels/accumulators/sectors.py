"""Sectors of a slice that occluders of finite thickness close (Therrien et al. 2023)."""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from gtao.kernels import bitmask, fetch, horizon
from gtao.kernels.open_sectors import open_moments
from gtao.kernels.steps import MAX_UNROLLED

from ._sides import with_side

__all__ = ["Sectors"]

# How far one body may shift in depth from a sample to the next, per distance across the eye rays, with no overlap of
# its extents. Solid things that are seen obliquely are deep along the eye ray, so that extents overlap; sheets are not.
LINK_SLOPE, SHEET_SLOPE = 3.0, 9.0


@dataclass(frozen=True)
class Sectors:
    """A mask per side and the jitter of the slice.

    Attributes:
        mapping, n_sectors, rounding: see :mod:`gtao.kernels.bitmask`.
        order: of the moments of the open directions, 0 to 2; 0 with the mapping "angle".
        arccosine: how the mapping "angle" finds angles, see :func:`gtao.kernels.arcs.fast_acos`.
        thickness: how far matter reaches behind a sample along its eye ray: "solid" without end, "constant" for
            ``amount`` scene units, "continuity" for ``amount`` or ``isolated`` by whether the depth of the sample is
            within ``gap`` of the one before it, "along_view" for ``amount`` but parallel to the shaded point's eye ray,
            "linear" for ``amount`` times the distance from the eye, or "measured" as ``layers`` say.
        cut: how a finite radius limits it: "sphere" exactly, "sample" ignores samples beyond it, "none" not at all.
        orthographic: whether eye rays are parallel.
        radius, amount, isolated, gap: see above.
        key: selects the jitter.
        linked: whether bodies of two samples in a row that overlap in depth, or nearly so, are one that also blocks
            what lies between them.
        layers: pairs of flat arrays of depths at which the eye ray of a texel enters and leaves a body, front to back.
        size: width and height of the frame.
        types: namespace of :func:`gtao.backend.types_of`.
    """

    mapping: str
    order: int
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
    key: Any
    linked: bool
    layers: tuple[tuple[Any, Any], ...]
    size: tuple[int, int]
    types: Any

    @property
    def max_unrolled(self):
        """Every layer of a sample has an arc of its own; unrolled 24 times, two layers take seconds to compile."""
        return MAX_UNROLLED if self.thickness != "measured" else 4

    def begin(self, sl):
        if self.arccosine == "exact":
            constants, weight = bitmask.slice_map(self.mapping, sl.nV, sl.nT, sl.start)
        else:
            constants, weight = bitmask.approximate_map(sl.nV, sl.nT, self.arccosine)
        xi = bitmask.jitter(sl.pixel.x, sl.pixel.y, sl.index, self.key)
        empty = tuple(self.types.UInt(0) for _ in range(0, self.n_sectors, 32))
        return constants, weight, xi, tuple((empty, self._own(start, sl.pixel)) for start in sl.start)

    def add(self, state, side, sample, sl):
        constants, weight, xi, sides = state
        masks, _ = sides[side]
        bodies = self._seen(state, side, sample, sl)
        for arc in self.arcs(state, side, sample, sl, bodies):
            front, back = (self._position(constants, sl, side, c) for c in arc)
            closed = bitmask.sectors(front, back, side, xi, self.n_sectors, self.rounding)
            masks = tuple(a | b for a, b in zip(masks, closed, strict=True))
        mine = masks, self._before(sample.z, (sample.X, sample.Y), bodies)
        return constants, weight, xi, with_side(sides, side, mine)

    def arcs(self, state, side, sample, sl, bodies=None):
        """Cosines (front, back) of the arcs that a sample closes, one for each of its layers."""
        _, _, _, sides = state
        _, (_, image, matter) = sides[side]
        bodies = self._seen(state, side, sample, sl) if bodies is None else bodies
        if not self.linked:
            return tuple(body[:2] for body in bodies)
        return tuple(self._joined(body, before, sample, image) for body, before in zip(bodies, matter, strict=True))

    def _seen(self, state, side, sample, sl):
        """What :meth:`_bodies` finds in a sample after those before it."""
        amount = self.amount
        if self.thickness == "continuity":
            _, _, _, sides = state
            _, (z, _, _) = sides[side]
            amount = dr.select(abs(sample.z - z) < self.gap, amount, self.isolated)
        return tuple(self._bodies(sample, sl, amount))

    def _position(self, constants, sl, side, c):
        if self.arccosine == "exact":
            return bitmask.position(self.mapping, constants, sl.start[side], side, c)
        return bitmask.approximate_position(constants, side, c, self.arccosine)

    def closed(self, state, sl):
        """Masks of the sectors that both sides close together."""
        none = self.types.UInt(0)
        words = zip(*(masks for masks, _ in state[3]), strict=True)
        return [dr.select(sl.inside[0], a, none) | dr.select(sl.inside[1], b, none) for a, b in words]

    def finish(self, state, sl):
        constants, weight, _, _ = state
        closed = self.closed(state, sl)
        share = weight * bitmask.visible_share(closed, self.n_sectors, self.types.Float)
        if not self.order:
            return (share,)
        slice_ = sl.nV, sl.nT, sl.start, constants, weight
        return share, *open_moments(self.mapping, self.order, *slice_, closed, self.n_sectors)

    def _own(self, start, pixel):
        """What the shaded point is to the first sample: its own matter begins at the tangent plane."""
        yes, z = self.types.Bool(True), -pixel.P[2]
        first, missing = (start, start, yes, z, z), (start, start, ~yes, z, z)
        return self._before(z, (pixel.X, pixel.Y), (first,) + (missing,) * (max(len(self.layers), 1) - 1))

    def _before(self, z, image, matter):
        """What the next sample needs to know: depth, place in the image, and what :meth:`_bodies` found."""
        return z if self.thickness == "continuity" else (), *((image, matter) if self.linked else ((), ()))

    def _joined(self, body, before, sample, image):
        """The arc of a body together with that of the sample before, if both are parts of one (theory, eq. (86))."""
        (front, back, there, near, far), (front0, back0, there0, near0, far0) = body, before
        gap = dr.select(near > near0, near, near0) - dr.select(far < far0, far, far0)
        dX, dY = sample.X - image[0], sample.Y - image[1]
        slope = dr.select((near == far) & (near0 == far0), SHEET_SLOPE, LINK_SLOPE)
        if not self.orthographic:
            slope = slope * near
        one = there & there0 & ((gap <= 0) | (gap * gap <= slope * slope * dr.fma(dX, dX, dY * dY)))
        return dr.select(one & (front0 > front), front0, front), dr.select(one & (back0 < back), back0, back)

    def _bodies(self, sample, sl, amount):
        """Cosines of the front and the back of what a sample blocks, whether it blocks anything, and the depths.

        NaN and -1 lie below every tangent plane.
        """
        X, Y, z = sample.X, sample.Y, sample.z
        if self.thickness == "measured":
            width, height = self.size
            for k, layer in enumerate(self.layers):
                near, far = (fetch.nearest(b, sample.x, sample.y, width, height, self.types)[0] for b in layer)
                body = self._behind(sample, near - z, sl) if k else (sample.c, sample.d2, sample.dV)
                # The sample is the first body's front, even where it was interpolated.
                back = self._behind(sample, far - (z if k else near), sl)[0]
                yield *self._within(body, sample, sl, back), near, far
            return
        if self.thickness == "solid":
            depth = dr.inf
        elif self.thickness == "linear":
            depth = amount * z
        else:
            depth = amount if self.orthographic else amount * dr.rsqrt(dr.fma(X, X, dr.fma(Y, Y, 1)))
        if self.thickness == "along_view":
            away = tuple(dr.fma(-amount, v, d) for d, v in zip(sample.D, sl.pixel.V, strict=True))
            back = horizon.cosine(away, sl.pixel.V)[0]
        else:
            back = -1 if self.thickness == "solid" else self._behind(sample, depth, sl)[0]
        yield *self._within((sample.c, sample.d2, sample.dV), sample, sl, back), z, z + depth

    def _behind(self, sample, depth, sl):
        """:func:`gtao.kernels.horizon.cosine` of the point behind a sample, ``depth`` deeper on its eye ray."""
        Dx, Dy, Dz = sample.D
        if not self.orthographic:
            Dx, Dy = dr.fma(sample.X, depth, Dx), dr.fma(sample.Y, depth, Dy)
        return horizon.cosine((Dx, Dy, Dz - depth), sl.pixel.V)

    def _within(self, body, sample, sl, back):
        """The arc from the front of a body to its back, as far as it lies within the radius (theory, eq. (85))."""
        pixel, (front, d2, dV) = sl.pixel, body
        if self.cut == "none":
            return front, back, dr.isfinite(d2)
        if self.cut == "sample":
            there = d2 <= self.radius * self.radius
            return dr.select(there, front, -1), dr.select(there, back, -1), there
        apart2 = horizon.apart_squared(*sample.offset(pixel), pixel.apart, sample.X, sample.Y, self.orthographic)
        cut = horizon.cut_at_sphere(front, d2, dV, apart2, pixel.p, self.radius, self.orthographic)
        upper, lower, blocks = cut
        if self.thickness != "solid":
            lower = dr.select(back > lower, back, lower)
        return upper, dr.select(lower < upper, lower, upper), blocks & (lower <= upper)
