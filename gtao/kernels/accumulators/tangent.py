"""What every direction blocks between its tangent and its horizon, attenuated by distance (theory, eq. (79))."""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from gtao.kernels import hbao

from ._sides import with_side

__all__ = ["TangentToHorizon"]


@dataclass(frozen=True)
class TangentToHorizon:
    """Each side keeps the sine of its horizon and what it blocks, or the attenuation at the horizon.

    Attributes:
        attenuation: "sample" attenuates each rise of the horizon, "horizon" the whole of a direction, "none" nothing.
        limited: whether samples beyond the radius are ignored.
        radius2, rcp_radius: its square and its reciprocal.
    """

    attenuation: str
    limited: bool
    radius2: Any
    rcp_radius: Any

    order = 0

    @property
    def n_extrema(self):
        """One where the horizon alone decides, none where every rise of it counts by its own distance."""
        return 0 if self.attenuation == "sample" else 1

    def extrema(self, state, side):
        return state[side][:1]

    def begin(self, sl):
        zero = type(sl.nT)(0)
        return tuple((t, zero) for t in sl.start)

    def add(self, state, side, sample, sl):
        c = dr.select(sample.d2 <= self.radius2, sample.c, -1) if self.limited else sample.c
        w = 1 if self.attenuation == "none" else hbao.attenuation(sample.d2, self.rcp_radius)
        grow = hbao.by_horizon if self.attenuation == "horizon" else hbao.by_sample
        mine = grow(c, w, *state[side])
        return with_side(state, side, mine)

    def ends(self, state, sl):
        sides = zip(state, sl.start, sl.inside, strict=True)
        return tuple((dr.select(inside, h, t), t) for (h, _), t, inside in sides)

    def finish(self, state, sl):
        total = 0
        for (h, blocked), t, inside in zip(state, sl.start, sl.inside, strict=True):
            if self.attenuation == "horizon":
                blocked = (h - t) * blocked
            total = total + dr.select(inside, blocked, 0)
        return (dr.fma(total, -0.5, 1),)
