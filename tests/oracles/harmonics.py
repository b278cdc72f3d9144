"""Real spherical harmonics from SciPy's complex ones, float64 NumPy."""

import numpy as np
from scipy.special import sph_harm_y


def basis(directions, order: int = 2) -> np.ndarray:
    """Y_lm of unit directions (..., 3) as (..., (order + 1)²): (0, 0), (1, -1), (1, 0), (1, 1), (2, -2) and so on.

    Without the Condon-Shortley phase, which SciPy's have: Y_1 is √(3/4π) (y, z, x).
    """
    directions = np.asarray(directions, dtype=np.float64)
    x, y, z = np.moveaxis(directions, -1, 0)
    theta, phi = np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)
    columns = []
    for degree in range(order + 1):
        for m in range(-degree, degree + 1):
            value = sph_harm_y(degree, abs(m), theta, phi) * (-1.0) ** m
            columns.append(np.sqrt(2) * value.imag if m < 0 else value.real * (np.sqrt(2) if m else 1))
    return np.stack(columns, axis=-1)


def of_moments(first, second, weighting: str = "cosine") -> np.ndarray:
    """∫ V Y_lm (…, 9), with the factor ⟨N, ω⟩ (cosine), from the moments of V: (…, 3) and (…, 3, 3), which have it too.

    Args:
        weighting: the moments are divided by π ("cosine") or by 2π ("uniform").
    """
    # Y_lm is linear in 1, ω and ω ωᵀ: its coefficients follow from its values anywhere.
    d = np.random.default_rng(0).normal(size=(64, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    terms = np.concatenate([d, np.einsum("ni,nj->nij", d, d).reshape(-1, 9)], axis=1)
    coefficients = np.linalg.lstsq(terms, basis(d), rcond=None)[0]
    moments = np.concatenate([first, np.reshape(second, (*np.shape(first)[:-1], 9))], axis=-1)
    return (np.pi if weighting == "cosine" else 2 * np.pi) * moments @ coefficients
