"""The directions that a slice method of few samples takes for open, pixel by pixel, float64 NumPy: no integral.

Uniform steps from the pixel to the radius or the border, texels at their centres; slices at azimuths π(i + ½)/n. A
direction of a slice is blocked if it lies between the uppermost and the lowest end of what samples of its side block.
"""

from dataclasses import dataclass

import numpy as np

from . import slice_march, slice_oracle, soft_horizons
from .fields import Field


@dataclass(frozen=True)
class Slices:
    """The slices of one pixel."""

    normal: np.ndarray
    V: np.ndarray
    T: np.ndarray
    """(n, 3) tangents."""
    blocked: np.ndarray
    """(n, 2, 2) first and last blocked angle from V on the sides of -T and +T; first > last where none is."""

    @staticmethod
    def of(field: Field, row: int, column: int, *, n_slices: int, n_steps: int, radius=np.inf) -> "Slices":
        P, N = slice_march.point(field, row, column), field.normal_v[row, column]
        V = slice_march.view_dir(field, row, column)
        phi = np.pi * (np.arange(n_slices) + 0.5) / n_slices
        T = slice_oracle.tangent(V, phi)
        blocked = [
            [_blocked(field, row, column, P, V, N, side * t, angle, n_steps, radius) for side, angle in sides]
            for t, sides in ((t, ((-1, p + np.pi), (1, p))) for t, p in zip(T, phi, strict=True))
        ]
        return Slices(N, V, T, np.array(blocked))

    def is_open(self, index, theta):
        """Whether nothing is in the way at the signed angles ``theta`` in the slices ``index``."""
        first, last = self.blocked[index, (theta > 0).astype(int)].T
        return (np.abs(theta) < first) | (np.abs(theta) > last)

    def irradiance(self, radiance, rng, weighting: str = "cosine", *, n_angles: int = 1024, n_replicates: int = 32):
        """Monte Carlo estimate of ∫ V L ⟨N, ω⟩₊ dω (or without the cosine) over these slices, and its standard error.

        A slice stands for its share of azimuth, with dω = |sin θ| dθ dφ: angles are drawn at random within even parts
        of [-π, π], in every slice and several times over.

        Args:
            radiance: unit directions (n, 3) -> (n, k) radiances of k lights.
        """
        shape = (n_replicates, len(self.T), n_angles)
        index = np.broadcast_to(np.arange(len(self.T))[:, None], shape).ravel()
        theta = np.pi * (2 * (np.arange(n_angles) + rng.random(shape)) / n_angles - 1).ravel()
        omega = np.cos(theta)[:, None] * self.V + np.sin(theta)[:, None] * self.T[index]
        up = omega @ self.normal
        weight = np.where(up > 0, up if weighting == "cosine" else 1.0, 0.0) * np.abs(np.sin(theta))
        values = (2 * np.pi * np.pi * weight * self.is_open(index, theta))[:, None] * radiance(omega)
        means = values.reshape(n_replicates, shape[1] * n_angles, -1).mean(axis=1)
        return means.mean(axis=0), means.std(axis=0, ddof=1) / np.sqrt(n_replicates)


def _blocked(field, row, column, P, V, N, outward, angle, n_steps, radius):
    """First and last blocked angle between V and ``outward``."""
    texels, _ = slice_march.texels(field, row, column, angle, radius=radius, n_steps=n_steps)
    # Where the tangent plane cuts this side.
    border = np.arctan2(N @ outward, N @ V) + np.pi / 2
    low = np.cos(border)
    arcs = [soft_horizons.blocked_arc(field, texel, P, V, radius, None, low) for texel in texels]
    upper = max([low, *(c for c, _ in arcs)])
    counts = np.cos(border - soft_horizons.RELIEF)
    lower = min([end for c, end in arcs if c > counts], default=-1.0)
    return np.arccos([upper, min(lower, upper)])
