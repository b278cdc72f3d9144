"""Which samples decide a slice, and a march that keeps their numbers.

A horizon is the maximum of its samples, so its derivative is that of the sample that attains it (Danskin's theorem;
theory, eq. (88)): the adjoint of a march looks at one sample per horizon, however many were searched.
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr

__all__ = ["Packing", "Tracked"]


@dataclass(frozen=True)
class Packing:
    """Step numbers of the winners of a slice in words of 8 bits, or 32 beyond 255 steps; ``n_steps`` stands for "none".

    Attributes:
        n_steps: steps per side.
        n_extrema: winners per side.
    """

    n_steps: int
    n_extrema: int

    @property
    def n_words(self) -> int:
        """Words per slice."""
        return -(-2 * self.n_extrema // self._per_word)

    @property
    def _bits(self) -> int:
        return self.n_steps.bit_length()

    @property
    def _word_bits(self) -> int:
        return 8 if self._bits <= 8 else 32

    @property
    def _per_word(self) -> int:
        return self._word_bits // self._bits

    def word_type(self, UInt):
        """Array type of the words, from that of 32-bit integers."""
        return dr.uint8_array_t(UInt) if self._word_bits == 8 else UInt

    def _places(self):
        """Word and shift of each number."""
        return [(k // self._per_word, k % self._per_word * self._bits) for k in range(2 * self.n_extrema)]

    def pack(self, numbers):
        words = [0] * self.n_words
        for number, (word, shift) in zip(numbers, self._places(), strict=True):
            words[word] = words[word] | (number << shift)
        return tuple(words)

    def unpack(self, words):
        mask = (1 << self._bits) - 1
        return tuple((words[word] >> shift) & mask for word, shift in self._places())


@dataclass(frozen=True)
class Tracked:
    """An accumulator whose slice value comes with the packed numbers of the winning steps.

    Attributes:
        inner: an accumulator with ``n_extrema`` and ``extrema(state, side)``, the values of a side that only its
            winning samples decide.
        packing: how numbers are packed.
        UInt: type of a number.
    """

    inner: Any
    packing: Packing
    UInt: Any

    @property
    def order(self):
        return self.inner.order

    def begin(self, sl):
        none = self.UInt(self.packing.n_steps)
        return self.inner.begin(sl), (none,) * (2 * self.packing.n_extrema)

    def add(self, state, side, sample, sl):
        inner, winners = state
        after = self.inner.add(inner, side, sample, sl)
        number, first, winners = self.UInt(sample.j), side * self.packing.n_extrema, list(winners)
        pairs = zip(self.inner.extrema(inner, side), self.inner.extrema(after, side), strict=True)
        for k, (old, new) in enumerate(pairs, start=first):
            winners[k] = dr.select(new != old, number, winners[k])
        return after, tuple(winners)

    def finish(self, state, sl):
        inner, winners = state
        return self.inner.finish(inner, sl), self.packing.pack(winners)
