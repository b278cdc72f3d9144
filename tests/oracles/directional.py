"""Points under random horizons and lobes of light, in float64 NumPy: what reaches them, by quadrature."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from oracles import harmonics
from oracles.slice_oracle import harmonic_horizon, unit

N_AZIMUTHS, N_RINGS = 360, 24
"""Errors of 1e-5 where horizons meet the tangent plane, which is a kink in azimuth; rings are exact to rounding."""


@dataclass(frozen=True)
class Point:
    """A point that sees directions up to a horizon about +z and above its tangent plane.

    Attributes:
        normal: unit, z > 0.
        horizon: angle from +z as a function of azimuth.
        directions: (K, 3) visible directions.
        weights: (K,) of the integral over them, with the cosine to the normal.
    """

    normal: np.ndarray
    horizon: Callable[[np.ndarray], np.ndarray]
    directions: np.ndarray
    weights: np.ndarray

    @property
    def visibility(self) -> float:
        return self.weights.sum() / np.pi

    @property
    def mean_direction(self) -> np.ndarray:
        return self.weights @ self.directions / np.pi

    def projected(self, order: int) -> np.ndarray:
        """((order + 1)²,) harmonics of visibility times cosine."""
        return self.weights @ harmonics.basis(self.directions, order)

    def irradiance(self, radiance: Callable[[np.ndarray], np.ndarray]) -> float:
        """Of light that is a function of (K, 3) directions."""
        return self.weights @ radiance(self.directions)


def random_point(rng: np.random.Generator) -> Point:
    """A surface tilted by up to 50° under a horizon 23° to 74° from the zenith, with waves of one to three periods."""
    tilt, azimuth = rng.uniform(0, np.radians(50)), rng.uniform(0, 2 * np.pi)
    normal = np.array([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
    waves = [(rng.uniform(-0.3, 0.3), k, rng.uniform(0, 2 * np.pi)) for k in (1, 2, 3)]
    around = harmonic_horizon(rng.uniform(0.4, 1.3), waves)

    def horizon(phi):
        return np.clip(around(phi), 0, np.pi)

    phi = 2 * np.pi * (np.arange(N_AZIMUTHS) + 0.5) / N_AZIMUTHS
    cosine, sine = np.cos(phi), np.sin(phi)
    # N_z cos θ + N_T sin θ = 0 on the tangent plane.
    last = np.minimum(horizon(phi), np.arctan2(normal[2], -(normal[0] * cosine + normal[1] * sine)))[:, None]
    x, w = np.polynomial.legendre.leggauss(N_RINGS)
    theta = last * (x + 1) / 2
    s = np.sin(theta)
    d = np.stack([s * cosine[:, None], s * sine[:, None], np.cos(theta)], axis=-1).reshape(-1, 3)
    weights = (last / 2 * w * s).ravel() * 2 * np.pi / N_AZIMUTHS
    return Point(normal, horizon, d, weights * (d @ normal))


@dataclass(frozen=True)
class Lobe:
    """Light with a mean of 1 over the sphere around an axis, in proportion to exp(κ ⟨a, ω⟩)."""

    axis: np.ndarray
    kappa: float

    def __call__(self, directions: np.ndarray) -> np.ndarray:
        return self.profile(directions @ self.axis)

    def profile(self, x: np.ndarray) -> np.ndarray:
        # κ exp(κ x) / sinh κ without what would overflow.
        return 2 * self.kappa * np.exp(self.kappa * (x - 1)) / (1 - np.exp(-2 * self.kappa))

    def projected(self, order: int) -> np.ndarray:
        """((order + 1)²,) coefficients."""
        x, w = np.polynomial.legendre.leggauss(200)
        legendre = np.polynomial.legendre.legvander(x, order)
        kernel = 2 * np.pi * (w * self.profile(x)) @ legendre
        return np.repeat(kernel, 2 * np.arange(order + 1) + 1) * harmonics.basis(self.axis, order)


def random_lobe(rng: np.random.Generator, kappa: float) -> Lobe:
    return Lobe(unit(rng.standard_normal(3)), kappa)
