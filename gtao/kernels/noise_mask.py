"""Masks of noise: two numbers for each of 64×64 pixels, repeated over the frame."""

import drjit as dr

__all__ = ["SIZE", "constant_table", "word_at"]

SIZE = 64


def constant_table(words, UInt):
    """An array of 32-bit integers that is a part of its kernel, one launch, so that it may be made where nothing can be
    uploaded (``dr.freeze``).

    Args:
        words: as many Python integers as a power of two.
        UInt: type of the array.
    """
    n = len(words)
    index = dr.arange(UInt, n)

    def tree(first, length):
        if length == 1:
            return UInt(words[first])
        half = length // 2
        return dr.select((index & half) == 0, tree(first, half), tree(first + half, half))

    return tree(0, n)


def word_at(mask, x, y, seed):
    """Word of the mask at a pixel; the seed's upper bits say where in the mask the frame begins."""
    x, y = x + (seed >> 26), y + ((seed >> 20) & (SIZE - 1))
    return dr.gather(type(x), mask, (y & (SIZE - 1)) * SIZE + (x & (SIZE - 1)))
