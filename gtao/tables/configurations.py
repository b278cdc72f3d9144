"""Random places to try tables at."""

from collections.abc import Mapping

import numpy as np

from gtao.errors import ConfigError

__all__ = ["configurations"]


def configurations(kind: str, n: int, seed: int, *, uniform: str, tilt: float) -> Mapping[str, np.ndarray]:
    """(n,) numbers for every argument that a kind of table may have; see :func:`gtao.tables.errors`.

    Raises:
        ConfigError: an option is out of range.
    """
    if n < 1:
        raise ConfigError(f"n must be at least 1, got {n}")
    if not 0 < tilt <= 0.5 * np.pi:
        raise ConfigError(f"tilt must be in (0, π/2], got {tilt}")
    rng = np.random.default_rng(seed)
    alpha_v = np.arcsin(np.sqrt(rng.random(n)))
    if uniform == "alpha":
        alpha = rng.uniform(0.03, 1, n)
    elif uniform == "roughness":
        alpha = rng.uniform(0.1, 1, n) ** 2
    else:
        raise ConfigError(f"uniform must be 'alpha' or 'roughness', got {uniform!r}")
    if kind in ("brdf-4d", "brdf-5d"):
        beta, theta_o, chi = _directions(rng, n, tilt)
    else:
        beta, theta_o, chi = rng.uniform(0, 0.5 * np.pi, n), np.arccos(rng.random(n)), np.zeros(n)
    return {"alpha_v": alpha_v, "beta": beta, "alpha": alpha, "theta_o": theta_o, "chi": chi}


def _directions(rng: np.random.Generator, n: int, tilt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(β, θ_o, χ) of reflected directions and axes, even over the hemisphere and over what ``tilt`` leaves of it."""
    cos_o, cos_b = rng.random(n), 1 - rng.random(n) * (1 - np.cos(tilt))
    phi = rng.uniform(-np.pi, np.pi, n)
    sin_o, sin_b = np.sqrt(1 - cos_o**2), np.sqrt(1 - cos_b**2)
    # Both in the frame with n = z; the reflected direction has the azimuth 0.
    along = sin_b * np.cos(phi) * sin_o + cos_b * cos_o
    normal = cos_b * sin_o - sin_b * np.cos(phi) * cos_o
    across = sin_b * np.sin(phi)
    return np.arctan2(np.hypot(normal, across), along), np.arccos(cos_o), np.arctan2(across, normal)
