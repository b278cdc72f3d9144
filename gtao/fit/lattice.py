"""Sums over pixels per level of visibility: all that a squared error needs of the data, whatever the function."""

from dataclasses import dataclass

import numpy as np

from .scene import SceneSamples

__all__ = ["MAX_LEVELS", "Lattice", "lattices"]

#: Finest lattice of V. Up to so many paths per pixel it is exact; a regressor, or V from more paths, is
#: rounded to it.
MAX_LEVELS = 4096


@dataclass(frozen=True, eq=False)
class Lattice:
    """Sums over pixels per level of V, with the sign and factor that they have in the corrected sum.

    Attributes:
        factor: Factor of this lattice in the sum over lattices.
        levels: Values of V, (L,).
        weight: Sum of pixel weights, (clusters, L).
        target: Sum of weight times V', (clusters, L, albedos).
    """

    factor: float
    levels: np.ndarray
    weight: np.ndarray
    target: np.ndarray


def lattices(
    scene: SceneSamples, x: np.ndarray, y: np.ndarray, V: np.ndarray, weight: np.ndarray, label: np.ndarray
) -> tuple[Lattice, ...]:
    B = len(x)
    total = y.sum(axis=0)
    every = [(V, total / B)]
    if scene.regressor is not None:
        return (_lattice(1.0, MAX_LEVELS, every, weight, label),)
    paths = scene.paths_per_batch
    left_out = [((B * V - x[b]) / (B - 1), (total - y[b]) / (B - 1)) for b in range(B)]
    return (
        _lattice(float(B), min(B * paths, MAX_LEVELS), every, weight, label),
        _lattice(-(B - 1) / B, min((B - 1) * paths, MAX_LEVELS), left_out, weight, label),
    )


def _lattice(
    factor: float,
    n_levels: int,
    pairs: list[tuple[np.ndarray, np.ndarray]],
    weight: np.ndarray,
    label: np.ndarray,
) -> Lattice:
    C, R = int(label.max()) + 1, pairs[0][1].shape[0]
    size = C * (n_levels + 1)
    weights, targets = np.zeros(size), np.zeros((R, size))
    for V, target in pairs:
        index = label * (n_levels + 1) + np.rint(V * n_levels).astype(np.int64)
        weights += np.bincount(index, weight, size)
        for r in range(R):
            targets[r] += np.bincount(index, weight * target[r], size)
    shape = (C, n_levels + 1)
    return Lattice(
        factor,
        np.arange(n_levels + 1) / n_levels,
        weights.reshape(shape),
        np.moveaxis(targets.reshape(R, *shape), 0, -1),
    )
