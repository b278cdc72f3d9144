"""Void and cluster as Ulichney (1993) states it, slowly: three phases, densities summed anew at every step."""

import numpy as np


def density(pattern, sigma):
    """Sum of Gaussians about the ones of a square pattern at every pixel, each about its nearest periodic image."""
    n = len(pattern)
    total = np.zeros((n, n))
    for row, column in zip(*np.nonzero(pattern), strict=True):
        for y in range(n):
            for x in range(n):
                dy, dx = (abs(a - b) for a, b in ((y, row), (x, column)))
                distance2 = min(dy, n - dy) ** 2 + min(dx, n - dx) ** 2
                total[y, x] += np.exp(-distance2 / (2 * sigma**2))
    return total


def densest(pattern, of, sigma):
    """Of the pixels that are ``of``, the one with the most of them about it: the tightest cluster."""
    return extreme(np.where(pattern == of, density(pattern == of, sigma), -np.inf))


def thinnest(pattern, sigma):
    """Of the zeros the one with the fewest ones about it: the largest void."""
    return extreme(np.where(pattern, -np.inf, -density(pattern, sigma)))


def extreme(values):
    """The first place within rounding of the greatest value: equal distances add up to equal sums in any order."""
    flat = values.ravel()
    return np.unravel_index(np.flatnonzero(flat > flat.max() - 1e-9)[0], values.shape)


def ranks(first, sigma):
    """Ranks of all pixels from a first pattern with fewer ones than zeros."""
    prototype = first.copy()
    while True:
        cluster = densest(prototype, True, sigma)
        prototype[cluster] = False
        void = thinnest(prototype, sigma)
        prototype[void] = True
        if void == cluster:
            break
    n, n_first = first.size, int(first.sum())
    result = np.empty(first.shape, dtype=int)
    pattern = prototype.copy()
    for rank in reversed(range(n_first)):
        cluster = densest(pattern, True, sigma)
        pattern[cluster], result[cluster] = False, rank
    pattern = prototype.copy()
    for rank in range(n_first, n // 2):
        void = thinnest(pattern, sigma)
        pattern[void], result[void] = True, rank
    for rank in range(n // 2, n):
        cluster = densest(pattern, False, sigma)
        pattern[cluster], result[cluster] = True, rank
    return result
