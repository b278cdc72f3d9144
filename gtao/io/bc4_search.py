"""The best end points of a BC4 block, among all 65536 pairs of bytes.

A search by bounds: a square of pairs (lower end, upper end) is judged by its centre. No level of the palette moves by
more than ``reach`` inside the square, so no texel comes nearer than its distance at the centre less ``reach``. Squares
that cannot beat the best pair so far are dropped, the others are cut into nine. Their sides are powers of three, so
that the centres are pairs of integers themselves.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

__all__ = ["best_ends"]

#: Side of the first squares.
_SIDE = 27
#: Blocks at a time: what their squares need fits into a processor's cache.
_CHUNK = 64
_TOP = 255.0


@dataclass
class _Squares:
    """Squares of one mode, in the order of their blocks.

    Attributes:
        n_steps: 7: levels from end to end, two of them the ends; 5: so too, and 0 and 1 besides.
        n: number of squares of each block.
        low, high: (M,) centres, in 255ths.
    """

    n_steps: int
    n: np.ndarray
    low: np.ndarray
    high: np.ndarray

    def kept(self, keep: np.ndarray) -> "_Squares":
        owner = np.repeat(np.arange(self.n.size), self.n)
        n = np.bincount(owner[keep], minlength=self.n.size)
        return _Squares(self.n_steps, n, self.low[keep], self.high[keep])

    def each(self, of_block: np.ndarray) -> np.ndarray:
        """A value of the blocks, for each of their squares."""
        return np.repeat(of_block, self.n, axis=-1)

    def plausible(self, reach: int, widest: np.ndarray) -> np.ndarray:
        """Squares with a pair of bytes, the lower first, whose levels are not too far apart."""
        inside = (self.low + reach >= 0) & (self.high - reach <= _TOP)
        inside &= (self.high + reach >= 0) & (self.low - reach <= _TOP)
        span = self.high - self.low
        return inside & (span + 2 * reach >= 0) & (span - 2 * reach <= self.n_steps * self.each(widest))

    def cut(self, side: int) -> "_Squares":
        steps = np.float32((-side, 0, side))
        low = (self.low[:, None] + np.repeat(steps, 3)).ravel()
        high = (self.high[:, None] + np.tile(steps, 3)).ravel()
        return _Squares(self.n_steps, self.n * 9, low, high)

    def errors(self, texels: np.ndarray, reach: int) -> tuple[np.ndarray, np.ndarray]:
        """Squared error of the block at the centre, and a lower bound of it anywhere in the square."""
        step = (self.high - self.low) * np.float32(1 / self.n_steps)
        per_step = np.divide(np.float32(1), step, out=np.zeros_like(step), where=step != 0)
        values = self.each(texels)
        away = values - self.low
        level = away * per_step
        np.rint(level, out=level)
        np.clip(level, 0, self.n_steps, out=level)
        level *= step
        away -= level
        np.abs(away, out=away)
        bound = np.maximum(away - reach, 0) if reach else away
        if self.n_steps == 5:
            np.minimum(values, _TOP - values, out=values)  # 0 and 1 stay where they are
            bound = np.minimum(bound, values)
            np.minimum(away, values, out=away)
        at_centre = np.einsum("ij,ij->j", away, away)
        return at_centre, np.einsum("ij,ij->j", bound, bound) if reach else at_centre


@dataclass
class _Best:
    """The best pair of each block so far, as the two bytes that a block begins with."""

    error: np.ndarray
    first: np.ndarray
    second: np.ndarray

    def improve(self, squares: _Squares, errors: np.ndarray) -> None:
        low, high = squares.low, squares.high
        allowed = (low >= 0) & (high >= low) & (high <= _TOP)
        errors = np.where(allowed, errors, np.inf)
        block = np.flatnonzero(squares.n)
        starts = (np.cumsum(squares.n) - squares.n)[block]
        least = np.minimum.reduceat(errors, starts)
        candidates = np.flatnonzero(errors == np.repeat(least, squares.n[block]))
        winner = candidates[np.searchsorted(candidates, starts)]
        better = least < self.error[block]
        block, winner = block[better], winner[better]
        self.error[block] = least[better]
        # Seven steps are coded by the greater byte first. Two equal ones mean the other palette, which has that level.
        ends = (high, low) if squares.n_steps == 7 else (low, high)
        self.first[block], self.second[block] = ends[0][winner], ends[1][winner]


def _first_squares(n_blocks: int) -> Iterator[_Squares]:
    centres = np.arange(-(-256 // _SIDE), dtype=np.float32) * _SIDE + _SIDE // 4
    low, high = (axis.ravel() for axis in np.meshgrid(centres, centres, indexing="ij"))
    upper = high >= low
    low, high = low[upper], high[upper]
    for n_steps in (7, 5):
        yield _Squares(n_steps, np.full(n_blocks, low.size), np.tile(low, n_blocks), np.tile(high, n_blocks))


def _search(texels: np.ndarray) -> _Best:
    n = texels.shape[1]
    best = _Best(np.full(n, np.inf, np.float32), np.zeros(n, np.float32), np.zeros(n, np.float32))
    # Were two levels used that lie farther apart than this, every texel would be off by more than half of it less the
    # range, while one level alone comes within half the range and 1/10; and two neighbouring bytes have any level.
    widest = 3 * np.ptp(texels, axis=0) + np.float32(0.25)
    modes, side = list(_first_squares(n)), _SIDE
    while True:
        reach = side // 2
        modes = [s for s in (s.kept(s.plausible(reach, widest)) for s in modes) if s.low.size]
        bounds = []
        for squares in modes:
            errors, bound = squares.errors(texels, reach)
            best.improve(squares, errors)
            bounds.append(bound)
        if side == 1:
            return best
        side //= 3
        modes = [s.kept(bound < s.each(best.error)).cut(side) for s, bound in zip(modes, bounds, strict=True)]


def best_ends(texels: np.ndarray) -> np.ndarray:
    """The two bytes of each block that leave the least squared error.

    Args:
        texels: (N, 16) numbers in [0, 1].

    Returns:
        (N, 2) uint8, in the order that tells the decoder which of the two palettes is meant.
    """
    scaled = np.ascontiguousarray(texels.T * _TOP, dtype=np.float32)
    ends = np.empty((texels.shape[0], 2), np.uint8)
    for start in range(0, ends.shape[0], _CHUNK):
        best = _search(scaled[:, start : start + _CHUNK])
        ends[start : start + _CHUNK] = np.stack([best.first, best.second], axis=-1)
    return ends
