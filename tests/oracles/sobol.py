"""The first two dimensions of Sobol's sequence from direction numbers."""

import numpy as np

DIGITS = 32


def points(n):
    """(n, 2) numbers in [0, 1), in the order of the digits, not of Gray's code.

    Number k is the exclusive or of direction numbers v_j / 2^j over its set bits j, from 1: the first dimension has
    v_j = 1; the second, of the primitive polynomial x + 1 and v_1 = 1, has v_j = 2 v_(j-1) ^ v_(j-1).
    """
    first = [1] * DIGITS
    second = [1]
    for _ in range(DIGITS - 1):
        second.append((2 * second[-1]) ^ second[-1])
    result = np.zeros((n, 2))
    for k in range(n):
        for dimension, numbers in enumerate((first, second)):
            word = 0
            for j in range(DIGITS):
                if k >> j & 1:
                    word ^= numbers[j] << (DIGITS - 1 - j)
            result[k, dimension] = word / 2**DIGITS
    return result
