"""Path counts with known truth: no renderer, no noise but what is asked for."""

from types import SimpleNamespace

import numpy as np

#: Paths of one batch of :func:`exact`: shares are right to its inverse.
MANY = 2**24


def sphere(V, n_bounces):
    """T_k of points in an integrating sphere: every bounce sees the same open share V of it, T_k = V (1 - V)^(k-1)."""
    return V * (1 - V) ** np.arange(n_bounces)[:, None]


def spread(seed, n_pixels=1024, n_bounces=8, a=1.0, b=1.0):
    """A scene without a law: V is beta-distributed, and later escapes happen at another rate in every pixel."""
    generator = np.random.default_rng(seed)
    V = generator.beta(a, b, n_pixels)
    rate = np.clip(0.85 * V + 0.08 + 0.12 * generator.standard_normal(n_pixels), 0.05, 0.95)
    later = (1 - V) * rate * (1 - rate) ** np.arange(n_bounces - 1)[:, None]
    return np.concatenate([V[None], later])


def four_parameter(V, k):
    """T_1, T_2, T_3 that make V'_3 exactly the four-parameter form; the form's k must keep them probabilities."""
    k0, k1, k2, k3 = k
    return np.array([V, V * (1 - V) * (k0 + k1 * V), V * (1 - V) * (k2 + k3 * V)])


def transport(T, spp, batches, seed, width=None):
    """Multinomial counts of T (K, N), as a path tracer with an independent sampler would make them."""
    generator = np.random.default_rng(seed)
    p = np.concatenate([T, np.maximum(1 - T.sum(axis=0), 0)[None]]).T
    counts = generator.multinomial(spp // batches, p / p.sum(axis=1, keepdims=True), size=(batches, T.shape[1]))
    return _pack(np.moveaxis(counts, 2, 1), spp, width)


def exact(T, batches=8, width=None, paths=MANY):
    """Counts without noise: every batch holds the rounded expectation."""
    # Sums are rounded, not shares: they cannot exceed the number of paths.
    sums = np.rint(np.minimum(np.cumsum(T, axis=0), 1) * paths).astype(np.int64)
    counts = np.diff(sums, axis=0, prepend=0, append=paths)
    return _pack(np.repeat(counts[None], batches, axis=0), paths * batches, width)


def _pack(counts, spp, width):
    n = counts.shape[2]
    return SimpleNamespace(
        escaped=counts[:, :-1],
        remaining=counts[:, -1],
        spp=spp,
        n_batches=len(counts),
        pixel=np.arange(n),
        width=width or max(1, int(np.sqrt(n))),
        edge=np.arange(n) % 3 == 0,
    )
