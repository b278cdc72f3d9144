"""A march that also finds which samples win: packed numbers of steps, word after word, of slice after slice."""

import drjit as dr

from . import directions
from .march import added
from .winners import Packing, Tracked

__all__ = ["search", "search_straight", "stored"]


def search(march, accumulator):
    """:meth:`gtao.kernels.march.March.mean`, and the words of the winners in one array."""
    packing = Packing(march.k.n_steps, accumulator.n_extrema)
    tracked = Tracked(accumulator, packing, march.types.UInt)
    Word = packing.word_type(march.types.UInt)
    winners = dr.empty(Word, march.n * march.k.n_slices * packing.n_words)

    def body(i, totals, c, q, off):
        summands, words = march.tracked(tracked, i, c, q, off)
        for place, word in zip(_places(march, packing, i), words, strict=True):
            dr.scatter(winners, Word(word), place)
        return i + 1, added(totals, summands), *march.next_azimuth(c, q, off)

    return march.closed(march.loop(accumulator, body)), winners


def search_straight(march, accumulator):
    """The same in straight code, and the words of each slice."""
    packing = Packing(march.k.n_steps, accumulator.n_extrema)
    tracked = Tracked(accumulator, packing, march.types.UInt)
    azimuth, totals, winners = march.first_azimuth(), (0,) * directions.n_sums(accumulator.order), []
    for i in range(march.k.n_slices):
        summands, words = march.tracked(tracked, i, *azimuth)
        totals, azimuth = added(totals, summands), march.next_azimuth(*azimuth)
        winners.append(words)
    return march.closed(totals), winners


def stored(march, winners, i, accumulator):
    """The words of slice ``i`` in the second result of :func:`search`."""
    packing = Packing(march.k.n_steps, accumulator.n_extrema)
    return [march.types.UInt(dr.gather(type(winners), winners, place)) for place in _places(march, packing, i)]


def _places(march, packing, i):
    """Where the words of slice ``i`` are."""
    lane = dr.arange(march.types.UInt, march.n)
    return [(i * packing.n_words + word) * march.n + lane for word in range(packing.n_words)]
