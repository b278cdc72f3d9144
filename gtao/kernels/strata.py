"""Strata of the directions about a normal: equal shares of the weighted hemisphere, in azimuth and elevation.

In the frame of the normal a direction is (out cos φ, out sin φ, up). With cosine weighting out² is distributed evenly
over [0, 1], with uniform weighting 1 - up is.
"""

import math
from dataclasses import dataclass

import drjit as dr

from .open_directions import Sums

__all__ = ["Strata"]


@dataclass(frozen=True)
class Strata:
    """A grid of ``n_azimuths`` by ``n_elevations`` strata."""

    n_azimuths: int
    n_elevations: int
    cosine: bool

    def direction(self, azimuth, elevation, u, v):
        """The direction at (u, v) in [0, 1)² of a stratum, in the frame of the normal."""
        share = (elevation + u) * (1 / self.n_elevations)
        sine, cosine = dr.sincos((azimuth + v) * (2 * math.pi / self.n_azimuths))
        up, out = self._elevation(share)
        return cosine * out, sine * out, up

    def mean(self, azimuth, elevation):
        """Means of the products of a direction's components (:class:`gtao.kernels.open_directions.Sums`), exactly."""
        low, high = elevation * (1 / self.n_elevations), (elevation + 1) * (1 / self.n_elevations)
        up, out, up_up, up_out = (
            (b - a) * self.n_elevations for a, b in zip(self._integrals(low), self._integrals(high), strict=True)
        )
        half = math.pi / self.n_azimuths
        sine, cosine = dr.sincos((azimuth + 0.5) * (2 * half))
        once = math.sin(half) / half
        twice = 0.5 * math.sin(2 * half) / half * (1 - up_up)
        return Sums(
            x=once * out * cosine,
            y=once * out * sine,
            z=up,
            xy=twice * sine * cosine,
            yz=once * up_out * sine,
            zz=up_up,
            xz=once * up_out * cosine,
            xx_yy=twice * dr.fma(cosine, cosine, -sine * sine),
        )

    def _elevation(self, share):
        if self.cosine:
            return dr.sqrt(1 - share), dr.sqrt(share)
        return 1 - share, dr.sqrt(share * (2 - share))

    def _integrals(self, share):
        """Integrals of up, out, up² and up out over the shares from 0 on."""
        share = dr.select(share < 1, share, 1)
        up, out = self._elevation(share)
        if self.cosine:
            angle = dr.atan2(out, up)
            return (
                (-2 / 3) * up * up * up,
                (2 / 3) * out * share,
                share * (1 - 0.5 * share),
                0.25 * dr.fma(up * out, 2 * share - 1, angle),
            )
        return (
            -0.5 * up * up,
            0.5 * (dr.atan2(out, up) - up * out),
            (-1 / 3) * up * up * up,
            (1 / 3) * out * out * out,
        )
