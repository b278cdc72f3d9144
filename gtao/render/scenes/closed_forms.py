"""Visibility of the analytic scenes in closed form (theory, eq. (40)), in float64.

World frame: z is up and points away from the ground. All forms are for the surfaces that a sensor of the scene can
see. e denotes the elevation of an occluder's rim above the horizontal.
"""

import numpy as np

from gtao.errors import ConfigError

WALL_THICKNESS = 1.0
#: Distance within which a point counts as lying on a plane: above the rounding of a float32 hit point a few units
#: away, far below a pixel.
BAND = 1e-5


def uniform_transport(visibility: float, n_bounces: int) -> np.ndarray:
    """Transport inside a scene whose visibility is one constant A everywhere: T_k = A (1 - A)^(k-1) (theory, eq. (39)).

    A path leaves such a scene with probability A at each of its vertices, whatever happened before.

    Args:
        visibility: A, in [0, 1].
        n_bounces: number K of terms.

    Returns:
        (K,) float64: T_1 … T_K.

    Raises:
        ConfigError: A outside [0, 1] or K < 1.
    """
    if not 0 <= visibility <= 1 or n_bounces < 1:
        raise ConfigError(f"need 0 <= visibility <= 1 and n_bounces >= 1, got {visibility!r}, {n_bounces!r}")
    return visibility * (1 - visibility) ** np.arange(n_bounces)


def constant(value: float, position: np.ndarray) -> np.ndarray:
    """The same ``value`` at every position (n, 3)."""
    return np.full(len(position), float(value))


def _by_height(z: np.ndarray, k: float, at_wall: np.ndarray, floor, side) -> np.ndarray:
    """``side`` on the wall between floor and rim; elsewhere ``floor`` or, on the top, 1."""
    on_side = at_wall & (z > BAND) & (z < k - BAND)
    return np.where(on_side, side, np.where(z < 0.5 * k, floor, 1.0))


def _rim_cosine(distance: np.ndarray, height: float) -> np.ndarray:
    """cos e with tan e = height / distance."""
    return distance / np.hypot(distance, height)


def wall(position: np.ndarray, d: float, k: float) -> np.ndarray:
    """Ground z = 0 before and behind an endless wall of height k between x = d and x = d + WALL_THICKNESS.

    Ground: (1 + cos e) / 2, tan e = k / distance to the wall. Face of the wall: the ground fills the half below its
    horizon, 1/2. Top of the wall: 1.
    """
    x, _, z = np.asarray(position, float).T
    distance = np.where(x > d + WALL_THICKNESS, x - d - WALL_THICKNESS, d - x)
    ground = 0.5 * (1 + _rim_cosine(np.abs(distance), k))
    return _by_height(z, k, np.abs(x - d) < BAND, ground, 0.5)


def trench(position: np.ndarray, d1: float, d2: float, k: float) -> np.ndarray:
    """Endless trench: floor z = 0 between the walls x = -d1 and x = d2, both of height k.

    Floor: (cos e1 + cos e2) / 2. Wall at height z: the sky begins at elevation e of the opposite rim,
    (1 - sin e) / 2 with tan e = (k - z) / (d1 + d2). Tops: 1.
    """
    x, _, z = np.asarray(position, float).T
    floor = 0.5 * (_rim_cosine(np.abs(d1 + x), k) + _rim_cosine(np.abs(d2 - x), k))
    side = 0.5 * (1 - (k - z) / np.hypot(k - z, d1 + d2))
    at_wall = np.minimum(np.abs(x + d1), np.abs(x - d2)) < BAND
    return _by_height(z, k, at_wall, floor, side)


def pit(position: np.ndarray, radius: float, k: float) -> np.ndarray:
    """Cylindrical pit about the z axis: floor z = 0, depth k.

    Floor at distance r from the axis, the form factor to the opening, a parallel disc:
    (1 - (r² + k² - R²) / sqrt((r² + k² + R²)² - 4 r² R²)) / 2; at the centre R² / (R² + k²).
    Wall at depth h below the rim, with H = h / (2R): (H² + 1/2) / sqrt(H² + 1) - H. Top: 1.
    """
    x, y, z = np.asarray(position, float).T
    r2, k2, R2 = x * x + y * y, k * k, radius * radius
    floor = 0.5 * (1 - (r2 + k2 - R2) / np.sqrt((r2 + k2 + R2) ** 2 - 4 * r2 * R2))
    H = (k - z) / (2 * radius)
    side = (H * H + 0.5) / np.sqrt(H * H + 1) - H
    # The polygon that stands for the circle has radii within 5e-5 of it.
    at_wall = np.abs(np.sqrt(r2) - radius) < 1e-4 * radius
    return _by_height(z, k, at_wall, floor, side)


def bowl(position: np.ndarray, opening: float) -> np.ndarray:
    """Unit sphere about the origin without the cap of area share ``opening`` around +z: ``opening`` inside.

    Cosine-weighted directions from any point of a sphere are spread uniformly over its area. The flat brim: 1.
    """
    x, y, z = np.asarray(position, float).T
    rim = 1 - 2 * opening
    # Within BAND of the brim's plane the sphere's own radius² differs from the rim's by less than 2 BAND.
    on_brim = (np.abs(z - rim) < BAND) & (x * x + y * y > 1 - rim * rim + 4 * BAND)
    return np.where(on_brim, 1.0, opening)
