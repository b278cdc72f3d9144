"""What the taps of the history say together."""

import drjit as dr

__all__ = ["mix", "steadiness"]


def mix(taps, image, grid):
    """Σ β w h over the taps; what is missing to a sum of weights of 1 belongs to the frame at hand.

    Args:
        image: an :class:`Image` of the history. Texels that count nothing are not read.
    """
    total = grid.types.Float(0)
    for tap in taps:
        h = dr.select(tap.weight > 0, grid.gather(image, tap.index), 0)
        total = dr.fma(tap.bilinear * tap.weight, h, total)
    return total


def steadiness(taps, count, grid):
    """Share Σ β w of the history, and the variance of what it says beside one frame's: the mean of 1/n, or 1.

    Args:
        count: :class:`Image` of the number n of frames that texels hold.
    """
    share, variance = grid.types.Float(0), grid.types.Float(0)
    for tap in taps:
        trusted = tap.weight > 0
        weight, n = tap.bilinear * tap.weight, grid.gather(count, tap.index)
        share = share + weight
        variance = dr.fma(weight, dr.select(trusted, 1 / dr.select(trusted, n, 1), 0), variance)
    known = share > 0
    return share, dr.select(known, variance / dr.select(known, share, 1), 1)
