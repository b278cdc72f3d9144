"""Horizons, plain or attenuated by distance: everything below the highest sample of a side is blocked."""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from gtao.kernels import arcs, horizon, thickness

from ._arc import blended_length, slice_values
from ._sides import with_side

__all__ = ["Horizon"]


@dataclass(frozen=True)
class Horizon:
    """One horizon cosine per side.

    Attributes:
        weighting: "cosine" or "uniform".
        order: of the moments of the visible directions, 0 to 2.
        bent_normal: "exact", or "average_horizon" for the directions halfway between horizons in place of moments.
        falloff: "none", "linear", "quadratic", "index" (by the number of the step) or "sample" (a hard cut of samples
            at ``reach``).
        toward: cosine at weight 0, "tangent", "nadir" or the "horizon" before the sample.
        from_tangent: whether the search starts from the tangent plane, else from -1.
        thickness: "none", "running" or "depth_cut".
        stretched: whether distances are measured with depth stretched by ``stretch``.
        blended: whether the projected normal's length is moved to 1 by ``blend``.
        arccosine: how angles are found, see :func:`gtao.kernels.arcs.fast_acos`.
        orthographic: whether the projection is parallel.
        scale, offset: weight = scale d + offset (linear) or scale d² + offset (quadratic), clamped to [0, 1]; ``scale``
            is the strength of the falloff by index.
        reach: distance beyond which samples are ignored.
        tau: share of the running thickness.
        depth: limit of the depth cut.
    """

    weighting: str
    order: int
    bent_normal: str
    falloff: str
    toward: str
    from_tangent: bool
    thickness: str
    stretched: bool
    blended: bool
    arccosine: str
    orthographic: bool
    scale: Any
    offset: Any
    reach: Any
    tau: Any
    depth: Any
    stretch: Any
    blend: Any

    @property
    def _clamped(self):
        """Whether horizons may end below the tangent plane, so that they are clamped at the end."""
        return self.thickness == "running" or not self.from_tangent

    @property
    def n_extrema(self):
        """One where the highest sample of a side decides, none where the horizon depends on the order of all."""
        return 0 if self.toward == "horizon" or self.thickness == "running" else 1

    def extrema(self, state, side):
        return (state[side],)

    def begin(self, sl):
        if self.from_tangent:
            return self._tangent(sl)
        lowest = type(sl.nT)(-1)
        return lowest, lowest

    def add(self, state, side, sample, sl):
        best, c = state[side], sample.c
        d2 = sample.d2
        if self.thickness == "running":
            # The background lies below most horizons, and a horizon sinks toward what lies below it.
            far = horizon.background_cosine(sample.X, sample.Y, sl.pixel.V, self.orthographic)
            c = dr.select(d2 == dr.inf, far, c)
        if self.stretched:
            Dx, Dy, Dz = sample.D
            Dz = Dz * self.stretch
            d2 = dr.fma(Dx, Dx, dr.fma(Dy, Dy, Dz * Dz))
        w = 1
        if self.falloff in ("linear", "quadratic"):
            w = horizon.weight(d2, self.scale, self.offset, squared=self.falloff == "quadratic")
        elif self.falloff == "index":
            w = horizon.index_weight(sample.j, self.scale)
        elif self.falloff == "sample":
            c = dr.select(d2 <= self.reach * self.reach, c, -1)
        if self.thickness == "depth_cut":
            c = dr.select(abs(sample.D[2]) < self.depth, c, -1)
        if self.toward == "horizon":
            best = self._raised(best, c, w)
        else:
            if self.falloff in ("linear", "quadratic"):
                c = horizon.attenuate(c, self._tangent(sl)[side] if self.toward == "tangent" else -1, w)
            raised = thickness.running(c, best, self.tau) if self.thickness == "running" else c
            known = c == c if self.thickness == "running" else best < c
            best = dr.select(known, raised, best)
        return with_side(state, side, best)

    def _raised(self, best, c, w):
        """The horizon after a sample that moves it by the share w only: theory, eq. (65)."""
        # A sample that is the shaded point itself has no direction, and c is NaN.
        sunk = dr.select(c == c, dr.fma(self.tau, c - best, best), best) if self.thickness == "running" else best
        return dr.select(c > best, dr.fma(w, c - best, best), sunk)

    def _tangent(self, sl):
        """Cosines of the tangent plane on both sides, with the normal's angle as approximate as the others."""
        if self.arccosine == "exact":
            return sl.start
        sine = dr.sin(arcs.normal_angle(sl.nV, sl.nT, self.arccosine))
        return sine, -sine

    def ends(self, state, sl):
        sides = []
        for c, start, inside in zip(state, self._tangent(sl), sl.inside, strict=True):
            if self._clamped and self.arccosine == "exact":
                c = dr.select(c > start, c, start)
            sides.append((dr.select(inside, c, start), start))
        return tuple(sides)

    def finish(self, state, sl):
        values = slice_values(self, sl, [upper for upper, _ in self.ends(state, sl)], clamped=self._clamped)
        return blended_length(values, sl, self.blend) if self.blended else values
