"""Latitude-longitude grids: directions, solid angles, and exact integrals of interpolated grids.

The value between texel centres is bilinear in polar angle and azimuth, periodic in azimuth, constant from the first
and last row's centres to the poles. The local polar axis is +y.
"""

import math

import numpy as np

from .basis import polar_factors

__all__ = ["angles_of", "directions_of", "hat_moments", "overlaps", "polar_hats", "texel_solid_angles"]

#: Nodes between two rows at least: exact to 1e-15 where harmonics vary little over a texel; more where they oscillate.
N_NODES = 12

#: Turns (z, x, y), the axes that the azimuth and the pole +y suggest, into the local frame: phi counts from -z to +x.
#: A direction (sin φ sin θ, cos θ, -cos φ sin θ) is POLAR_TO_LOCAL @ (cos φ sin θ, sin φ sin θ, cos θ).
POLAR_TO_LOCAL = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])


def directions_of(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """(…, 3) local directions of polar angle and azimuth, broadcast; theory, eq. (103)."""
    s = np.sin(theta)
    return np.stack(np.broadcast_arrays(np.sin(phi) * s, np.cos(theta), -np.cos(phi) * s), axis=-1)


def angles_of(directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Polar angle in [0, π] and azimuth in [0, 2π) of (…, 3) unit vectors of the local frame."""
    x, y, z = directions[..., 0], directions[..., 1], directions[..., 2]
    return np.arctan2(np.hypot(x, z), y), np.arctan2(x, -z) % (2 * math.pi)


def texel_solid_angles(height: int, width: int) -> np.ndarray:
    """(H,) solid angle of a texel of each row; theory, eq. (104)."""
    centre = math.pi * (np.arange(height) + 0.5) / height
    return 2 * math.pi / width * 2 * np.sin(centre) * math.sin(math.pi / (2 * height))


def polar_hats(height: int, order: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes of the polar angle for the rows' hats times harmonics up to ``order``, (H, K): angle, hat value, weight."""
    step = math.pi / height
    x, w = np.polynomial.legendre.leggauss(N_NODES + math.ceil(order * step))
    x, w = (x + 1) / 2, w / 2
    centre = step * (np.arange(height) + 0.5)[:, None]
    down, up = np.full((height, 1), step), np.full((height, 1), step)
    up[0] = down[-1] = step / 2  # the pole is half a texel away
    theta = np.concatenate([centre - up * x, centre + down * x], axis=1)
    rising, falling = np.repeat(1 - x[None], height, axis=0), np.repeat(1 - x[None], height, axis=0)
    rising[0] = falling[-1] = 1
    return theta, np.concatenate([rising, falling], axis=1), np.concatenate([up * w, down * w], axis=1)


def hat_moments(height: int, width: int, order: int) -> tuple[dict[tuple[int, int], np.ndarray], np.ndarray]:
    """Integrals of the interpolating hats against the harmonics about the local pole; theory, eq. (105).

    Returns:
        ({(l, m): (H,) integral of the hat in θ against the polar factor, (1 - z²)^(m/2) and sin θ},
        (order + 1,) ratio of the hat's integral against cos m(φ - φ_j) to that of 1, times 2π/W).
    """
    theta, hat, weight = polar_hats(height, order)
    s = np.sin(theta)
    q = polar_factors(np.cos(theta), order)
    polar = {(band, m): (factor * s ** (m + 1) * hat * weight).sum(axis=1) for (band, m), factor in q.items()}
    azimuth = 2 * math.pi / width * np.sinc(np.arange(order + 1) / width) ** 2
    return polar, azimuth


def overlaps(old: np.ndarray, new: np.ndarray) -> np.ndarray:
    """(len(new) - 1, len(old) - 1) share of each new interval that each old one fills, of increasing edges."""
    low = np.maximum(new[:-1, None], old[None, :-1])
    high = np.minimum(new[1:, None], old[None, 1:])
    return np.maximum(high - low, 0) / np.diff(new)[:, None]
