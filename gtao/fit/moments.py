"""Sums over pixels that a fit needs, free of the bias that noise in the regressor would bring.

V is itself an estimate and shares its paths with V'. Putting the noisy V into powers and products is biased:
E[V̂²] is V² plus a variance, E[V̂'V̂] is V'V plus a covariance, and least squares then bends the curve. The
batches of paths are independent, whatever sampler made them, which allows two corrections:

- Powers and products come from *different* batches. Averaged over all choices of batches this is an
  elementary symmetric polynomial of the batch means, and unbiased exactly: E[e_p(V̂_1 … V̂_B) / (B choose p)]
  = V^p (theory, eq. (46)). V'V^p takes V' from one batch and V^p from the others. This serves everything that is
  polynomial in V (:class:`Moments`).
- Any other function of V goes through the jackknife: B times the value from all batches, minus (B - 1) times the
  mean of the values that leave one batch out, has no bias of order 1/paths (theory, eq. (47)). V̂ is a count, so
  that sums over pixels can be kept per level of V̂ and serve every function (:class:`Lattice`).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import sparse
from scipy.special import comb

from gtao.errors import FitError

from .lattice import Lattice, lattices
from .samples import Samples
from .scene import SceneSamples

__all__ = ["MIN_BATCHES", "Moments", "cluster_moments"]

#: Sixth powers of V (the squared cubic) need as many different batches.
MIN_BATCHES = 6

#: "uniform" weighting: bins of V that get equal weight, and how much a sparse bin may be raised at most.
UNIFORM_BINS = 20
UNIFORM_GAIN = 20.0


@dataclass(frozen=True, eq=False)
class Moments:
    """Weighted means over the pixels of each cluster; the weights of a scene's pixels sum to 1.

    Attributes:
        albedos: (R,).
        bounces: Bounces that V' stands for.
        n_batches: Batches that went in.
        scene: Index of the scene of each cluster, (C,).
        powers: Mean of V^p, p = 0…6, (C, 7).
        cross: Mean of V'V^p, p = 0…3, (C, R, 4).
        square: Mean of V'², (C, R).
        naive_powers: As ``powers``, from the noisy means.
        naive_cross: As ``cross``, from the noisy means.
        lattices: Their sum serves any function of V; the first alone is the naive one, with factor 1.
    """

    albedos: np.ndarray
    bounces: float
    n_batches: int
    scene: np.ndarray
    powers: np.ndarray
    cross: np.ndarray
    square: np.ndarray
    naive_powers: np.ndarray
    naive_cross: np.ndarray
    lattices: tuple[Lattice, ...]


def cluster_moments(
    samples: Samples,
    bounces: float,
    albedos: np.ndarray,
    *,
    uniform: bool = False,
    labels: list[np.ndarray] | None = None,
) -> Moments:
    """Moments of all scenes, or of clusters of pixels within them.

    Args:
        samples: The samples.
        bounces: Surface bounces, counting the visible point; ``inf`` for all.
        albedos: Albedos (R,).
        uniform: Whether pixels are weighted so that each bin of V has the same weight within its scene. The
            weights come from batches that the moments do not use, or the noise of the two would conspire.
        labels: Cluster of each pixel, 0…n-1, one array (N,) per scene; one cluster per scene if left out.

    Returns:
        The moments.

    Raises:
        FitError: Too few batches.
    """
    key = (bounces, tuple(albedos), uniform)
    if labels is None and key in samples.cache:
        return samples.cache[key]
    parts, scene_of = [], []
    for index, scene in enumerate(samples.scenes):
        label = np.zeros(scene.n_pixels, int) if labels is None else labels[index]
        parts.append(_scene_moments(scene, bounces, albedos, uniform, label))
        scene_of += [index] * (int(label.max()) + 1)
    moments = _stack(parts, np.array(scene_of))
    if labels is None:
        samples.cache[key] = moments
    return moments


def _scene_moments(
    scene: SceneSamples, bounces: float, albedos: np.ndarray, uniform: bool, label: np.ndarray
) -> Moments:
    B = scene.n_batches
    needed = (2 if scene.regressor is not None else MIN_BATCHES) + (1 if uniform else 0)
    if needed > B:
        raise FitError(
            f"scene {scene.name!r} has {B} batches of paths, this fit needs at least {needed} to tell signal "
            f"from noise; trace with n_batches=8"
        )
    y = scene.batch_targets(bounces, albedos)
    x = scene.escaped[:, 0] / scene.paths_per_batch
    if not uniform:
        plain = np.full(scene.n_pixels, 1.0 / scene.n_pixels)
        return _fold(scene, x, y, plain, albedos, bounces, label)
    if scene.regressor is not None:
        return _fold(scene, x, y, _flat_weights(scene.regressor), albedos, bounces, label)
    held = max(1, min(B // 4, B - MIN_BATCHES))
    folds = [np.arange(first, first + held) for first in range(0, B - held + 1, held)]
    parts = []
    for fold in folds:
        rest = np.setdiff1d(np.arange(B), fold)
        weight = _flat_weights(x[fold].mean(axis=0))
        parts.append(_fold(scene, x[rest], y[rest], weight, albedos, bounces, label))
    return _mean(parts)


def _flat_weights(V: np.ndarray) -> np.ndarray:
    """Pixel weights, summing to 1, that give each bin of V the same total unless it is too sparse to be
    raised.
    """
    bins = np.minimum((V * UNIFORM_BINS).astype(int), UNIFORM_BINS - 1)
    count = np.bincount(bins, minlength=UNIFORM_BINS)
    gain = np.minimum(V.size / UNIFORM_BINS / np.maximum(count, 1), UNIFORM_GAIN)
    return gain[bins] / gain[bins].sum()


def _fold(
    scene: SceneSamples,
    x: np.ndarray,
    y: np.ndarray,
    weight: np.ndarray,
    albedos: np.ndarray,
    bounces: float,
    label: np.ndarray,
) -> Moments:
    """Moments from batch means x (B, N) of V and y (B, R, N) of V' with given pixel weights."""
    B, R, N = y.shape
    mean = y.mean(axis=0)
    V = x.mean(axis=0) if scene.regressor is None else scene.regressor
    naive_powers = V ** np.arange(7)[:, None]
    naive_cross = mean[:, None] * naive_powers[:4]
    if scene.regressor is None:
        powers, cross = _symmetric_moments(x, y)
    else:
        powers, cross = naive_powers, naive_cross
    square = (y.sum(axis=0) ** 2 - (y**2).sum(axis=0)) / (B * (B - 1))
    C = int(label.max()) + 1
    collect = sparse.csr_array((weight, (label, np.arange(N))), shape=(C, N))
    means = collect @ np.concatenate([powers, cross.reshape(-1, N), square, naive_powers, naive_cross.reshape(-1, N)]).T
    split = np.cumsum([7, 4 * R, R, 7])
    p, c, s, np_, nc = np.split(means, split, axis=1)
    return Moments(
        albedos, bounces, B, np.zeros(C, int), p, c.reshape(C, R, 4), s, np_, nc.reshape(C, R, 4),
        lattices(scene, x, y, V, weight, label),
    )  # fmt: skip


def _symmetric_moments(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unbiased V^p, (7, N), and V'V^p, (R, 4, N), of each pixel from different batches."""
    B, R, N = y.shape
    e = np.zeros((7, N))
    e[0] = 1.0
    for batch in x:
        for p in range(6, 0, -1):
            e[p] += batch * e[p - 1]
    cross = np.zeros((R, 4, N))
    for batch, target in zip(x, y, strict=True):
        others = np.ones((4, N))  # e_p of the other batches: e_p = others_p + batch · others_{p-1}
        for p in range(1, 4):
            others[p] = e[p] - batch * others[p - 1]
        cross += target[:, None] * (others / comb(B - 1, np.arange(4))[:, None])
    return e / comb(B, np.arange(7))[:, None], cross / B


def _combine(parts: list[Moments], how: Callable[..., np.ndarray]) -> dict[str, Any]:
    """Apply a function to the lists of equal arrays of several moments."""
    names = ("powers", "cross", "square", "naive_powers", "naive_cross")
    arrays = {name: how([getattr(part, name) for part in parts]) for name in names}
    arrays["lattices"] = tuple(
        Lattice(same[0].factor, same[0].levels, how([x.weight for x in same]), how([x.target for x in same]))
        for same in zip(*(part.lattices for part in parts), strict=True)
    )
    return arrays


def _mean(parts: list[Moments]) -> Moments:
    return replace(parts[0], **_combine(parts, lambda arrays: np.mean(arrays, axis=0)))


def _stack(parts: list[Moments], scene_of: np.ndarray) -> Moments:
    return replace(parts[0], scene=scene_of, **_combine(parts, np.concatenate))
