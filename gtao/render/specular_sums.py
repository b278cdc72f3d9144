"""From sums over rays to means of pairs with their covariances, batch by batch."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .chunks import Progress
from .hemisphere import RayKind, batches, image, ray_sums
from .specular_result import Pair
from .walk import Origins

__all__ = ["Reflection", "controlled", "pair_images"]


@dataclass(frozen=True)
class Reflection:
    """How rays are drawn and what comes of their sums.

    Attributes:
        rays: kinds of rays of each sample; the components that they add if nothing blocks them, they add always too.
        n_pairs: of estimates that are looked at together.
        pairs: makes (n_batches, n_pairs, 2, n) pairs of batch means (n_batches, 2, k, n) at some of the lanes, the
            second axis without rays that something blocks and with them.
        results: makes attributes of :class:`Specular` of a :class:`Pair` of images (H, W, n_pairs).
    """

    rays: list[RayKind]
    n_pairs: int
    pairs: Callable[[np.ndarray, slice], np.ndarray]
    results: Callable[[Pair], Mapping[str, Any]]


def pair_images(
    scene: Any,
    start: Origins,
    shape: tuple[int, int],
    reflection: Reflection,
    max_distance: float,
    spp: int,
    n_batches: int,
    seed: int,
    progress: Progress | None = None,
) -> Pair:
    """Means over independent batches with their covariances, (H, W, n_pairs); 0 on the background."""

    def estimate(part: Origins, key: int, n_samples: int) -> np.ndarray:
        return ray_sums(scene, part, key, n_samples, max_distance, reflection.rays) / n_samples

    mean = np.zeros((reflection.n_pairs, 2, len(start)))
    covariance = np.zeros((reflection.n_pairs, 3, len(start)))
    gathered: list[np.ndarray] = []
    for batch, lanes, values in batches(start, spp, n_batches, seed, estimate, progress):
        gathered.append(values.reshape(2, -1, values.shape[-1]))
        if batch == n_batches - 1:
            found = reflection.pairs(np.stack(gathered), lanes)
            gathered.clear()
            mean[..., lanes] = found.mean(0)
            a, b = np.moveaxis(found - found.mean(0), -2, 0)
            squares = np.stack([(a * a).sum(0), (b * b).sum(0), (a * b).sum(0)], -2)
            covariance[..., lanes] = squares / (n_batches * (n_batches - 1))
    return Pair(image(mean, start, shape), image(covariance, start, shape))


def controlled(visible: np.ndarray, every: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """Estimates of what is visible, rid of the noise that they share with what is known (theory, eq. (155)).

    Args:
        visible: (n_batches, …) means over rays of what they count for if nothing blocks them.
        every: (n_batches, …) the same whether or not something does.
        whole: (…) the expectation of ``every``.
    """
    others, all_others = visible.sum(0) - visible, every.sum(0) - every
    share = np.divide(others, all_others, out=np.zeros_like(others), where=all_others > 0)
    return visible + share * (whole - every)
