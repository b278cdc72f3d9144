"""Synthetic light from afar with an axis of symmetry: as a function, as an environment map, as spherical harmonics."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gtao.errors import ConfigError

from ._checks import as_colour, as_directions, as_order, as_positive
from ._latlong import directions_of
from .basis import basis
from .environment import EnvironmentMap

__all__ = ["ZonalLight", "constant", "disc", "gradient_sky", "von_mises_fisher"]

#: A texel of a map is the average over this many samples along each side.
N_SUBTEXELS = 4


@dataclass(frozen=True, eq=False)
class ZonalLight:
    """Radiance that depends on the angle to one axis only.

    Attributes:
        axis: (3,) unit vector, world frame.
        profile: cosines of the angle to the axis, any shape (…), to radiance (…, 3).
        kernel: order to (order + 1, 3) zonal moments K_l = 2π∫ f P_l dx.
    """

    axis: np.ndarray
    profile: Callable[[np.ndarray], np.ndarray]
    kernel: Callable[[int], np.ndarray]

    def radiance(self, directions: ArrayLike) -> np.ndarray:
        """(…, 3) radiance from (…, 3) directions of any length but 0, world frame.

        Raises:
            ShapeError: the directions are not (…, 3), not finite, or zero.
        """
        return self.profile(np.clip(as_directions("directions", directions) @ self.axis, -1, 1))

    def project(self, order: int = 2) -> np.ndarray:
        """((order + 1)², 3) coefficients K_l Y_lm(axis), world frame; theory, eq. (100).

        Raises:
            ConfigError: the order is not an integer of at least 0.
        """
        order = as_order(order)
        kernel = np.repeat(self.kernel(order), 2 * np.arange(order + 1) + 1, axis=0)
        return kernel * basis(self.axis, order)[:, None]

    def map(self, height: int = 64) -> EnvironmentMap:
        """The light as an environment map of ``height`` x ``2 height`` texels, averages over 16 samples each.

        Raises:
            ConfigError: the height is not an integer of at least 2.
        """
        if as_order(height) < 2:
            raise ConfigError(f"height must be an integer of at least 2, got {height!r}")
        rows = N_SUBTEXELS * height
        theta = math.pi * (np.arange(rows) + 0.5) / rows
        phi = math.pi * (np.arange(2 * rows) + 0.5) / rows
        return EnvironmentMap(self.radiance(directions_of(theta[:, None], phi))).resized(height)


def constant(radiance: Any = 1.0) -> ZonalLight:
    """The same radiance from everywhere.

    Args:
        radiance: one or three numbers, not negative.

    Raises:
        ConfigError: the radiance is something else.
    """
    colour = as_colour("radiance", radiance)

    def kernel(order: int) -> np.ndarray:
        return np.concatenate([4 * math.pi * colour[None], np.zeros((order, 3))])

    return ZonalLight(np.array([0.0, 0.0, 1.0]), lambda x: np.broadcast_to(colour, (*x.shape, 3)), kernel)


def von_mises_fisher(axis: ArrayLike, kappa: float, radiance: Any = 1.0) -> ZonalLight:
    """A smooth lobe, radiance · κ/sinh κ · exp(κ ⟨axis, ω⟩); theory, eq. (101).

    Its moments are those of the modified spherical Bessel functions. Half of its light lies within about 1.2/√κ radians
    of the axis.

    Args:
        axis: (3,) direction of the brightest light, of any length but 0.
        kappa: concentration, positive: 4 is a wide glow, 1000 a small lamp.
        radiance: the mean over the sphere, one or three numbers, not negative.

    Raises:
        ConfigError: the concentration or radiance is out of range.
        ShapeError: the axis is not a finite vector of three numbers, or zero.
    """
    kappa, colour = as_positive("kappa", kappa), as_colour("radiance", radiance)
    # κ/sinh κ without its factor exp(-κ), which the profile carries.
    peak = 2 * kappa / -math.expm1(-2 * kappa)

    def profile(x: np.ndarray) -> np.ndarray:
        return peak * np.exp(kappa * (x[..., None] - 1)) * colour

    def kernel(order: int) -> np.ndarray:
        from scipy.special import ive

        bessel = ive(np.arange(order + 1) + 0.5, kappa)
        return 4 * math.pi * (bessel / bessel[0])[:, None] * colour

    return ZonalLight(_axis(axis), profile, kernel)


def disc(axis: ArrayLike, radius: float, radiance: Any = 1.0) -> ZonalLight:
    """A disc of constant radiance, a sun; theory, eq. (102).

    Args:
        axis: (3,) direction of its centre, of any length but 0.
        radius: angle from the centre to the rim, in radians, in (0, π].
        radiance: of the disc, one or three numbers, not negative; dark elsewhere.

    Raises:
        ConfigError: the radius or radiance is out of range.
        ShapeError: the axis is not a finite vector of three numbers, or zero.
    """
    radius, colour = as_positive("radius", radius), as_colour("radiance", radiance)
    if radius > math.pi:
        raise ConfigError(f"radius must be at most π, got {radius:g}; it is an angle in radians")
    rim = math.cos(radius)

    def kernel(order: int) -> np.ndarray:
        legendre = np.polynomial.legendre.legvander(np.array([rim]), order + 1)[0]
        band = np.arange(1, order + 1)
        higher = 2 * math.pi * (legendre[band - 1] - legendre[band + 1]) / (2 * band + 1)
        return np.concatenate([[4 * math.pi * math.sin(radius / 2) ** 2], higher])[:, None] * colour

    return ZonalLight(_axis(axis), lambda x: (x >= rim)[..., None] * colour, kernel)


def gradient_sky(up: ArrayLike, zenith: Any, horizon: Any, ground: Any = 0.0) -> ZonalLight:
    """A sky that changes linearly in the sine of the elevation, above a ground of one colour.

    Args:
        up: (3,) direction of the zenith, of any length but 0.
        zenith: radiance straight above, one or three numbers, not negative.
        horizon: radiance of the sky at the horizon, likewise.
        ground: radiance of everything below the horizon, likewise.

    Raises:
        ConfigError: a radiance is out of range.
        ShapeError: ``up`` is not a finite vector of three numbers, or zero.
    """
    top, rim, below = (as_colour(n, v) for n, v in (("zenith", zenith), ("horizon", horizon), ("ground", ground)))

    def profile(x: np.ndarray) -> np.ndarray:
        height = x[..., None]
        return np.where(height >= 0, rim + height * (top - rim), below)

    def kernel(order: int) -> np.ndarray:
        nodes, weights = np.polynomial.legendre.leggauss(order // 2 + 2)  # exact for f P_l on each side of the horizon
        x = np.concatenate([(nodes - 1) / 2, (nodes + 1) / 2])
        w = np.concatenate([weights, weights]) / 2
        return 2 * math.pi * (np.polynomial.legendre.legvander(x, order) * w[:, None]).T @ profile(x)

    return ZonalLight(_axis(up), profile, kernel)


def _axis(axis: ArrayLike) -> np.ndarray:
    return as_directions("the axis", np.asarray(axis, dtype=np.float64).reshape(-1)[None])[0]
