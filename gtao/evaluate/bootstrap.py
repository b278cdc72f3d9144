"""How far do results of scenes or image blocks scatter? The cluster bootstrap.

References:
    T. Hesterberg, "What teachers should know about the bootstrap", The American Statistician 2015 (the
    expanded percentile interval).
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from gtao.errors import ConfigError

__all__ = ["block_labels", "bootstrap_counts", "bootstrap_interval", "bootstrap_standard_error"]


def bootstrap_counts(n_clusters: int, n_draws: int, seed: int = 0, *, strata: ArrayLike | None = None) -> np.ndarray:
    """How often each cluster is drawn in each bootstrap sample.

    Whatever is a sum over clusters (normal equations, squared errors) is resampled by one product with these
    counts.

    Args:
        n_clusters: Number of clusters that are resampled as wholes (scenes, or blocks of pixels).
        n_draws: Number of bootstrap samples.
        seed: Seed of the generator.
        strata: Group of each cluster, (n_clusters,): clusters are drawn within their group. One group if left
            out.

    Returns:
        Counts of shape (n_draws, n_clusters); each row sums to n_clusters.

    Raises:
        ConfigError: Fewer than 2 clusters (in any group) or fewer than 1 draw.
    """
    groups = np.zeros(n_clusters, int) if strata is None else np.asarray(strata)
    if n_draws < 1:
        raise ConfigError(f"the bootstrap needs at least 1 draw, got {n_draws}")
    if groups.shape != (n_clusters,):
        raise ConfigError(f"strata must name a group for each of {n_clusters} clusters, got shape {groups.shape}")
    generator = np.random.default_rng(seed)
    counts = np.zeros((n_draws, n_clusters))
    for group in np.unique(groups):
        members = np.flatnonzero(groups == group)
        if members.size < 2:
            raise ConfigError(f"the bootstrap needs at least 2 clusters in a group, got {members.size}")
        share = np.full(members.size, 1.0 / members.size)
        counts[:, members] = generator.multinomial(members.size, share, size=n_draws)
    return counts


def bootstrap_standard_error(draws: np.ndarray, n_clusters: int) -> np.ndarray:
    """Standard error from bootstrap draws (n_draws, …), with the small-sample factor sqrt(n/(n-1)) for n
    clusters (theory, eq. (48)).
    """
    return np.sqrt(n_clusters / (n_clusters - 1)) * np.std(draws, axis=0, ddof=1)


def bootstrap_interval(draws: np.ndarray, n_clusters: int, level: float = 0.95) -> tuple[np.ndarray, np.ndarray]:
    """Expanded percentile interval (Hesterberg 2015) from bootstrap draws.

    The plain percentile interval is too narrow for few clusters, like a normal interval without Student's
    factor; this one takes wider percentiles, so that it would be right for a mean of normal values.

    Args:
        draws: Bootstrap draws, (n_draws, …).
        n_clusters: Number of clusters n that were resampled, at least 2.
        level: Coverage, in (0, 1).

    Returns:
        Lower and upper end, each of shape (…).

    Raises:
        ConfigError: Level or number of clusters outside its range.
    """
    if not 0 < level < 1:
        raise ConfigError(f"level must lie in (0, 1), got {level}")
    if n_clusters < 2:
        raise ConfigError(f"an interval needs at least 2 clusters, got {n_clusters}")
    quantile = stats.t.ppf((1 - level) / 2, n_clusters - 1)
    tail = stats.norm.cdf(np.sqrt(n_clusters / (n_clusters - 1)) * quantile)
    low, high = np.quantile(draws, [tail, 1 - tail], axis=0)
    return low, high


def block_labels(pixel: ArrayLike, width: int, block: int) -> np.ndarray:
    """Number of the square image block in which each pixel lies: neighbours are not independent, blocks
    nearly are.

    Args:
        pixel: Flat indices y * width + x, (N,).
        width: Image width in pixels.
        block: Side of a block in pixels.

    Returns:
        Labels 0 … n-1 of the blocks that occur, (N,).
    """
    flat = np.asarray(pixel).astype(np.int64)
    y, x = np.divmod(flat, width)
    across = -(-width // block)
    return np.unique((y // block) * across + x // block, return_inverse=True)[1]
