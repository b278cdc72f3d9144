"""BC4 by its definition: every palette that two bytes can mean, and a decoder that goes bit by bit."""

import numpy as np


def palette(first: int, second: int) -> list[float]:
    """The eight levels in [0, 1] of a block that begins with these bytes (Direct3D, unsigned normalised)."""
    a, b = first / 255, second / 255
    if first > second:
        return [a, b] + [((7 - i) * a + i * b) / 7 for i in range(1, 7)]
    return [a, b] + [((5 - i) * a + i * b) / 5 for i in range(1, 5)] + [0.0, 1.0]


PALETTES = np.array([palette(i, j) for i in range(256) for j in range(256)])


def least_error(block: np.ndarray) -> float:
    """Least sum of squares over all 65536 pairs of bytes and all codes, of 16 numbers in [0, 1]."""
    total = np.zeros(len(PALETTES))
    for value in block.ravel():
        total += np.abs(PALETTES - value).min(axis=1) ** 2
    return float(total.min())


def decode(block: bytes) -> np.ndarray:
    """(4, 4) numbers of the eight bytes of a block."""
    levels = palette(block[0], block[1])
    codes = int.from_bytes(block[2:], "little")
    return np.array([[levels[codes >> 3 * (4 * y + x) & 7] for x in range(4)] for y in range(4)])


def decode_bytes(block: bytes) -> np.ndarray:
    """(4, 4) integers as decoders in integers give them, which drop what is left of the division."""
    first, second = block[:2]
    if first > second:
        levels = [first, second] + [((7 - i) * first + i * second) // 7 for i in range(1, 7)]
    else:
        levels = [first, second] + [((5 - i) * first + i * second) // 5 for i in range(1, 5)] + [0, 255]
    codes = int.from_bytes(block[2:], "little")
    return np.array([[levels[codes >> 3 * (4 * y + x) & 7] for x in range(4)] for y in range(4)])
