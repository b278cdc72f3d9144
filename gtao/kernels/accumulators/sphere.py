"""Horizons with an exact cut: matter counts as far as it lies within the radius of the shaded point."""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from gtao.kernels import horizon, slices

from ._arc import blended_length, slice_values
from ._sides import with_side

__all__ = ["SphereCut"]

# Samples that rise less than this above the tangent plane, in radians, do not close the gap below a far occluder:
# rounding and the steps of a depth buffer put samples of a flat surface there. An arc of this height at the tangent
# plane holds RELIEF² / 2 of the cosine-weighted hemisphere.
RELIEF = 0.05


@dataclass(frozen=True)
class SphereCut:
    """Each side keeps the highest upper and the lowest lower end of the arcs blocked within the sphere.

    The solid behind a sample blocks an arc that ends where its eye ray leaves the sphere; between the lowest such end
    and the tangent plane the slice is open again (theory, eq. (28)).
    """

    weighting: str
    order: int
    bent_normal: str
    orthographic: bool
    blended: bool
    arccosine: str
    radius: Any
    blend: Any

    n_extrema = 2  # the upper and the lower end

    def extrema(self, state, side):
        return state[side]

    def begin(self, sl):
        one = type(sl.nT)(1)
        return tuple((start, one) for start in sl.start)

    def add(self, state, side, sample, sl):
        pixel, (upper, lower) = sl.pixel, state[side]
        counts = slices.clamped_start(sl.nV, sl.nT, RELIEF)[side]
        apart2 = horizon.apart_squared(*sample.offset(pixel), pixel.apart, sample.X, sample.Y, self.orthographic)
        seen = sample.c, sample.d2, sample.dV
        c, end, _ = horizon.cut_at_sphere(*seen, apart2, pixel.p, self.radius, self.orthographic)
        rises = (lower > end) & (counts < c)
        mine = dr.select(upper < c, c, upper), dr.select(rises, end, lower)
        return with_side(state, side, mine)

    def ends(self, state, sl):
        return tuple(self._seen(*of_side) for of_side in zip(state, sl.start, sl.inside, strict=True))

    def finish(self, state, sl):
        upper, lower = zip(*self.ends(state, sl), strict=True)
        values = slice_values(self, sl, upper, lower, sl.start)
        return blended_length(values, sl, self.blend) if self.blended else values

    def _seen(self, state, start, inside):
        """Upper and lower end of a side's blocked arc, both within the hemisphere."""
        upper, lower = state
        upper = dr.select(inside, upper, start)
        open_below = (lower > start) & (upper > lower)
        return upper, dr.select(open_below, lower, start)
