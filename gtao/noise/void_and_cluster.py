"""Dither masks by void and cluster (Ulichney 1993) on a torus."""

import numpy as np

from gtao.errors import ConfigError

__all__ = ["blue_noise_mask", "void_and_cluster"]

#: Standard deviation of the Gaussian in pixels, Ulichney's: a larger one lets lower frequencies pass, a smaller one
#: favours the checkerboard.
SIGMA = 1.5

#: Energies are sums of integers, which do not depend on the order of additions or the last digit of an exponential.
_ONE = 2**40

#: Share of ones in the first pattern.
_MINORITY = 0.1


def void_and_cluster(size: int, seed: int = 0, sigma: float = SIGMA) -> np.ndarray:
    """Ranks of the pixels of a square tile: those below any threshold form a pattern without voids and clusters.

    The density of a set of pixels is the sum of Gaussians about them, with distances on the torus. A random tenth of
    the pixels is evened out, by moving the pixel where that set is densest to where it is thinnest, until it would move
    back. Taking its pixels away, the densest first, gives them their ranks downward; filling the thinnest places gives
    all others theirs upward. The original turns to the densest places of the empty pixels in its upper half: those are
    the thinnest of the full ones, as the two densities add up to a constant.

    Args:
        size: pixels along each side, 2 to 256.
        seed: of the first pattern.
        sigma: standard deviation of the Gaussian in pixels, above 0.

    Returns:
        (size, size) integers, 0 to size² - 1, each once.

    Raises:
        ConfigError: the size or sigma is out of range.
    """
    if not 2 <= size <= 256:
        raise ConfigError(f"size must be 2 to 256 pixels, got {size}")
    if not 0 < sigma < np.inf:
        raise ConfigError(f"sigma must be a positive number of pixels, got {sigma}")
    bump, n = _Bump(size, sigma), size * size
    order = np.random.default_rng(seed).permutation(n)
    first = _evened(order[: max(1, round(_MINORITY * n))], bump)
    ranks = np.empty(n, dtype=np.int64)

    full, density = first.copy(), bump.sum(first)
    for rank in reversed(range(first.sum())):
        at = _densest(density, full)
        full[at], ranks[at] = False, rank
        density -= bump.about(at)

    full, density = first.copy(), bump.sum(first)
    for rank in range(first.sum(), n):
        at = _thinnest(density, full)
        full[at], ranks[at] = True, rank
        density += bump.about(at)
    return ranks.reshape(size, size)


def blue_noise_mask(size: int = 64, seed: int = 1993, sigma: float = SIGMA) -> np.ndarray:
    """Two masks in one, (size, size, 2) of 16-bit integers in units of 2⁻¹⁶: the middles of size² equal parts of 1.

    With its defaults this is the mask in the package, bit for bit.

    Raises:
        ConfigError: the size or sigma is out of range, or the size no power of two.
    """
    if size & (size - 1):
        raise ConfigError(f"the size of a mask must be a power of two, got {size}")
    ranks = np.stack([void_and_cluster(size, seed + channel, sigma) for channel in range(2)], axis=-1)
    return ((2 * ranks + 1) * 2**15 // size**2).astype("<u2")


class _Bump:
    """A Gaussian about each pixel of a torus."""

    def __init__(self, size: int, sigma: float) -> None:
        apart = np.minimum(np.arange(size), size - np.arange(size)) ** 2
        values = np.rint(_ONE * np.exp(-np.add.outer(apart, apart) / (2 * sigma**2))).astype(np.int64)
        # Twice the period, so that the Gaussian about any pixel is a window of it.
        self._size, self._twice = size, np.tile(values, (2, 2))

    def about(self, at: int) -> np.ndarray:
        """The flat Gaussian about a flat index."""
        n = self._size
        y, x = divmod(at, n)
        return self._twice[n - y : 2 * n - y, n - x : 2 * n - x].ravel()

    def sum(self, full: np.ndarray) -> np.ndarray:
        return sum(self.about(at) for at in np.flatnonzero(full))


def _densest(density, full) -> int:
    return int(np.argmax(np.where(full, density, -1)))


def _thinnest(density, full) -> int:
    return int(np.argmin(np.where(full, np.iinfo(np.int64).max, density)))


def _evened(indices, bump) -> np.ndarray:
    """The first pattern without clusters and voids."""
    full = np.zeros(bump._size**2, dtype=bool)
    full[indices] = True
    density = bump.sum(full)
    while True:
        cluster = _densest(density, full)
        full[cluster] = False
        density = density - bump.about(cluster)
        void = _thinnest(density, full)
        full[void] = True
        density = density + bump.about(void)
        if void == cluster:
            return full
