"""How much of an environment map its first bands hold."""

import math

import numpy as np

from ._checks import as_order
from ._latlong import polar_hats
from .environment import EnvironmentMap

__all__ = ["energy", "fit_quality"]


def energy(environment: EnvironmentMap) -> np.ndarray:
    """(3,) squared radiance over the sphere, ∫ L² dω, of the interpolated map."""
    height, width = environment.shape
    image = environment.radiance.astype(np.float64)
    neighbour = np.roll(image, -1, axis=1)

    def along_rows(a: np.ndarray, b: np.ndarray, a_next: np.ndarray, b_next: np.ndarray) -> np.ndarray:
        """Integrals over the azimuth of products of rows that are linear between texels: (rows, 3)."""
        return 2 * math.pi / width * (2 / 3 * a * b + (a * b_next + a_next * b) / 6).sum(axis=1)

    theta, hat, weight = polar_hats(height)
    weight = weight * np.sin(theta)
    own = (hat**2 * weight).sum(axis=1)
    half = hat.shape[1] // 2
    # Between two rows their hats add up to 1.
    shared = (hat * (1 - hat) * weight)[:-1, half:].sum(axis=1)
    squares = along_rows(image, image, neighbour, neighbour)
    products = along_rows(image[:-1], image[1:], neighbour[:-1], neighbour[1:])
    return own @ squares + 2 * shared @ products


def fit_quality(environment: EnvironmentMap, order: int) -> np.ndarray:
    """The share of the energy that the bands up to each order keep; theory, eq. (106).

    One minus it is the squared relative error of the best fit of that order.

    Args:
        environment: the light.
        order: highest band.

    Returns:
        (order + 1,) increasing, in [0, 1]; all 1 for a map without light.

    Raises:
        ConfigError: the order is not an integer of at least 0.
    """
    order = as_order(order)
    total = energy(environment).sum()
    if total == 0:
        return np.ones(order + 1)
    squares = (environment.project(order) ** 2).sum(axis=1)
    bands = np.arange(order + 1)
    return np.cumsum(np.add.reduceat(squares, bands**2)) / total
