"""Horizons, plain or attenuated by distance: everything below the highest sample of a side is blocked."""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from gtao.kernels import horizon, thickness

from ._arc import blended_length, open_arc

__all__ = ["Horizon"]


@dataclass(frozen=True)
class Horizon:
    """One horizon cosine per side.

    Attributes:
        weighting: "cosine" or "uniform".
        falloff: "none", "linear", "quadratic" or "sample" (a hard cut of samples at ``reach``).
        toward: cosine at weight 0, "tangent" or "nadir".
        thickness: "none", "running" or "depth_cut".
        stretched: whether distances are measured with depth stretched by ``stretch``.
        blended: whether the projected normal's length is moved to 1 by ``blend``.
        scale, offset: weight = scale d + offset (linear) or scale d² + offset (quadratic), clamped to [0, 1].
        reach: distance beyond which samples are ignored.
        tau: share of the running thickness.
        depth: limit of the depth cut.
    """

    weighting: str
    falloff: str
    toward: str
    thickness: str
    stretched: bool
    blended: bool
    scale: Any
    offset: Any
    reach: Any
    tau: Any
    depth: Any
    stretch: Any
    blend: Any

    def begin(self, sl):
        if self.thickness == "running":
            # A horizon that may sink starts from the bottom; it is clamped to the hemisphere at the end.
            lowest = type(sl.nT)(-1)
            return lowest, lowest
        return sl.start

    def add(self, state, side, sample, sl):
        best, c = state[side], sample.c
        d2 = sample.d2
        if self.stretched:
            Dx, Dy, Dz = sample.D
            Dz = Dz * self.stretch
            d2 = dr.fma(Dx, Dx, dr.fma(Dy, Dy, Dz * Dz))
        if self.falloff in ("linear", "quadratic"):
            low = sl.start[side] if self.toward == "tangent" else -1
            w = horizon.weight(d2, self.scale, self.offset, squared=self.falloff == "quadratic")
            c = horizon.attenuate(c, low, w)
        elif self.falloff == "sample":
            c = dr.select(d2 <= self.reach * self.reach, c, -1)
        if self.thickness == "depth_cut":
            c = dr.select(abs(sample.D[2]) < self.depth, c, -1)
        if self.thickness == "running":
            best = dr.select(c == c, thickness.running(c, best, self.tau), best)
        else:
            best = dr.select(c > best, c, best)
        return (best, state[1]) if side == 0 else (state[0], best)

    def finish(self, state, sl):
        seen = []
        for c, start, inside in zip(state, sl.start, sl.inside, strict=True):
            if self.thickness == "running":
                inside = inside & (c > start)
            seen.append(dr.select(inside, c, start))
        value = open_arc(self.weighting, sl.nV, sl.nT, *seen)
        return blended_length(value, sl, self.blend) if self.blended else value
