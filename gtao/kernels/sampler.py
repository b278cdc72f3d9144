"""The depth samples of a slice: where they lie, what the depth buffer says there, and in what order that is asked."""

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr

from . import horizon, pyramid, steps, taps
from .march_types import Pixel, Sample, Scalars, Slice, Switches

__all__ = ["Sampler"]


@dataclass(frozen=True)
class Sampler:
    """Reads the samples of the slices of some pixels from ``field``, see :meth:`gtao.kernels.march.March.of`."""

    field: Any
    pixel: Pixel
    k: Switches
    s: Scalars
    types: Any

    def read(self, sl: Slice, places) -> list[Sample]:
        """The samples at places (side, step) or (side, step, known), their depths gathered one after the other."""
        aimed = [self._aim(sl, *place) for place in places]
        self._in_order()
        seen = [look() for look in aimed]
        self._in_order()
        return [self._sample(*values, *place[1:]) for values, place in zip(seen, places, strict=True)]

    def _aim(self, sl: Slice, side, j, known=True):
        """Function that reads the depth sample of step ``j``, where it is ``known``."""
        k, s, pixel, types, of_side = self.k, self.s, self.pixel, self.types, sl.sides[side]
        xi = steps.jitter(k.step_jitter, sl.offset, j, k.n_steps)
        d = steps.distance(k.step_law, j, xi, k.n_steps, self._exponent, of_side.least, of_side.reach)
        dx, dy = sl.direction if side else (-sl.direction[0], -sl.direction[1])
        px, py = dr.fma(dx, d, pixel.x), dr.fma(dy, d, pixel.y)
        level = None if k.pyramid is None else pyramid.level(dr.detach(d), s.level_scale, k.pyramid, types)
        return taps.aim(self.field, px, py, level, k, types, known)

    def _sample(self, zs, px, py, j, known=True) -> Sample:
        """Depth sample of step ``j``; where ``known`` is false, of a point that is nowhere special."""
        k, s, pixel = self.k, self.s, self.pixel
        P, z = pixel.P, -pixel.P[2]
        if known is not True:
            # Not infinitely far and not the shaded point itself, whose derivatives are not finite.
            zs = dr.select(known, zs, 2 * dr.detach(z))
        X, Y = dr.fma(px, s.ax, s.bx), dr.fma(py, s.ay, s.by)
        if k.orthographic:
            D = (X - P[0], Y - P[1], z - zs)
        else:
            D = (dr.fma(X, zs, -P[0]), dr.fma(Y, zs, -P[1]), z - zs)
        c, d2, dV = horizon.cosine(D, pixel.V)
        if k.meets_itself:
            # What rounding leaves of an offset that is zero points anywhere.
            c = dr.select((px == pixel.x) & (py == pixel.y), math.nan, c)
        return Sample(D, d2, dV, c, j, px, py, X, Y, zs)

    def _in_order(self):
        """Instructions of what follows come after those of what was before.

        Samples would be finished one by one otherwise, and a gather wait for the arithmetic of the sample before it.
        """
        dr.detail.new_scope(dr.backend_v(self.types.Float))

    @property
    def _exponent(self):
        """The exponent of the steps' spacing: baked into the kernel unless it carries a gradient."""
        return self.s.step_exponent if self.k.step_exponent is None else self.k.step_exponent
