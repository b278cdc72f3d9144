"""How tuned values would vary with other scenes: a bootstrap over scenes, linearised about the optimum."""

from collections.abc import Callable

import numpy as np

from gtao.evaluate import bootstrap_counts

__all__ = ["MIN_SCENES", "scene_draws"]

#: Fewer scenes cannot tell how much scenes differ.
MIN_SCENES = 3

#: Half width of the differences, in coordinates: wide enough for samples that jump from texel to texel to average out.
STEP = 0.05

#: Smallest curvature, as a share of the largest: along a direction that the data say nothing about, draws would go
#: anywhere.
LEAST_CURVATURE = 1e-3


def scene_draws(
    losses: Callable[[np.ndarray], np.ndarray],
    optimum: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
    n_draws: int,
    seed: int,
) -> np.ndarray:
    """Optima of bootstrap samples of scenes, to first order (theory, eq. (97)).

    With the gradients g_s of the scenes' losses and the Hessian H of their sum, a sample that holds scene s n_s times
    has its optimum at u - H⁻¹ Σ_s (n_s - 1) g_s: one Newton step instead of a tuning for every draw.

    Args:
        losses: coordinates -> loss of every scene, (scenes,), adding up to what was minimised.
        optimum: (parameters,).
        bounds: lower and upper ends, (parameters,) each. Coordinates that lie on one stay there, draws end there.
        n_draws: bootstrap samples.
        seed: of them.

    Returns:
        Coordinates, (draws, parameters).
    """
    lower, upper = bounds
    free = np.flatnonzero((optimum > lower) & (optimum < upper))
    draws = np.tile(optimum, (n_draws, 1))
    if free.size == 0:
        return draws
    gradients, hessian = _derivatives(losses, optimum, bounds, free)
    values, vectors = np.linalg.eigh(hessian)
    curvature = np.maximum(values, LEAST_CURVATURE * max(values.max(), np.finfo(float).tiny))
    counts = bootstrap_counts(len(gradients), n_draws, seed)
    steps = (((counts - 1) @ gradients) @ vectors / curvature) @ vectors.T
    draws[:, free] = np.clip(optimum[free] - steps, lower[free], upper[free])
    return draws


def _derivatives(
    losses: Callable[[np.ndarray], np.ndarray],
    optimum: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
    free: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Gradients of the scenes, (scenes, free), and the Hessian of their sum by central differences."""
    n = free.size
    # Near a bound the differences are taken a little off the optimum.
    half = np.minimum(STEP, 0.5 * (bounds[1] - bounds[0]))
    centre = np.clip(optimum, bounds[0] + half, bounds[1] - half)
    h = half[free]
    offsets = np.zeros((n, optimum.size))
    offsets[np.arange(n), free] = h
    middle = losses(centre)
    up = np.array([losses(centre + d) for d in offsets])
    down = np.array([losses(centre - d) for d in offsets])
    gradients = ((up - down) / (2 * h[:, None])).T
    hessian = np.diag((up + down - 2 * middle).sum(axis=1) / h**2)
    for i in range(n):
        for j in range(i):
            both = losses(centre + offsets[i] + offsets[j]) + losses(centre - offsets[i] - offsets[j])
            mixed = (both - up[i] - up[j] - down[i] - down[j] + 2 * middle).sum() / (2 * h[i] * h[j])
            hessian[i, j] = hessian[j, i] = mixed
    return gradients, hessian
