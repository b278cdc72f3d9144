"""Horizons as smooth maxima of the samples of a side, so that every sample above the tangent plane has a gradient."""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from ._sides import with_side
from .horizon import Horizon
from .sphere import SphereCut

__all__ = ["SoftHorizon", "SoftSphereCut"]


class _Soft:
    """The mean of a side's cosines with Boltzmann's weights in place of the highest (theory, eq. (91)).

    A sample enters with the cosine that the horizon would have with it alone, which is never below the tangent plane;
    the tangent plane itself is one of the terms. Sums are kept relative to the highest cosine so far, so that no
    exponential overflows; which one it is has no derivative, because it cancels.
    """

    temperature: Any
    n_extrema = 0

    def begin(self, sl):
        zero, one = type(sl.nT)(0), type(sl.nT)(1)
        return super().begin(sl), ((zero, one, zero),) * 2

    def add(self, state, side, sample, sl):
        inner, sums = state
        none = super().begin(sl)
        alone = super().add(none, side, sample, sl)
        rise = self.extrema(alone, side)[0] - self.extrema(none, side)[0]
        sums = with_side(sums, side, self._with(sums[side], rise))
        return super().add(inner, side, sample, sl), sums

    def _with(self, sums, rise):
        """Highest rise above the tangent plane, sum of weights and sum of weighted rises, with one more."""
        highest, weights, weighted = sums
        rcp = 1 / self.temperature
        top = dr.detach(dr.select(rise > highest, rise, highest))
        old, new = dr.exp((highest - top) * rcp), dr.exp((rise - top) * rcp)
        return top, dr.fma(weights, old, new), dr.fma(weighted, old, rise * new)

    def ends(self, state, sl):
        inner, sums = state
        none = super().begin(sl)
        for side, (_, weights, weighted) in enumerate(sums):
            start, *others = self.extrema(none, side)
            upper = start + weighted / weights
            mine = (upper, *self.extrema(inner, side)[1:]) if others else upper
            inner = with_side(inner, side, mine)
        return super().ends(inner, sl)


@dataclass(frozen=True)
class SoftHorizon(_Soft, Horizon):
    """:class:`gtao.kernels.accumulators.Horizon` with smooth maxima; ``temperature`` in units of cosines."""

    temperature: Any


@dataclass(frozen=True)
class SoftSphereCut(_Soft, SphereCut):
    """:class:`gtao.kernels.accumulators.SphereCut` with smooth upper ends.

    Lower ends stay minima: they do not depend on the depth of samples (theory, eq. (27)), so that there is no gradient
    to spread.
    """

    temperature: Any

    def _seen(self, state, start, inside):
        # Unlike the highest upper end, a smooth one may lie below the lowest lower one; then nothing is blocked.
        upper, lower = state
        upper = dr.select(inside, upper, start)
        open_below = inside & (upper > start) & (lower > start) & (lower < 1)
        return upper, dr.select(open_below, dr.select(lower < upper, lower, upper), start)
