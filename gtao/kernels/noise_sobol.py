"""The first two dimensions of Sobol's sequence, scrambled as Owen (1995) does it, in 32-bit integers.

Numbers are kept with their digits reversed, the first digit after the point in the lowest bit: number n of the van der
Corput sequence is then n itself, and a scramble may flip a bit according to the bits below it (theory, eq. (189)).
"""

import drjit as dr

__all__ = ["owen", "second_dimension"]

# Even factors of Laine and Karras 2011: a bit of x · factor depends on lower bits of x alone.
_FACTORS = (0x6C50B47C, 0xB82F1E52, 0xC7AFE638, 0x8D22F6E6)


def second_dimension(n):
    """Number ``n`` of Sobol's second dimension, digits reversed: digit i is the parity of C(j, i) n_j over all bits j.

    C(j, i) is odd where the bits of i are among those of j (Lucas), so that each bit of the positions i and j takes one
    step: positions without it take in those with it.
    """
    for shift, without in ((1, 0x55555555), (2, 0x33333333), (4, 0x0F0F0F0F), (8, 0x00FF00FF), (16, 0x0000FFFF)):
        n = n ^ ((n >> shift) & without)
    return n


def owen(reversed_digits, key):
    """A number of 32 bits with the same digits in their right order, each flipped or not as those before it say.

    Args:
        reversed_digits: digits, the first one in the lowest bit.
        key: which of the 2³² scrambles.
    """
    v = reversed_digits + key
    for factor in _FACTORS:
        v = v ^ (v * factor)
    return dr.brev(v)
