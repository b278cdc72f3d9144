"""Where the taps of a filter lie along an axis."""

__all__ = ["footprint"]


def footprint(size, odd_frame=False):
    """``(offset, weight)`` along one axis of a footprint that repeats a period of noise exactly.

    An odd size is symmetric and spans a period of size - 1: its two ends, which are the same texel of the period,
    count half each. An even size is a box, which cannot be: it lies half a pixel toward positive coordinates on even
    frames and half a pixel toward negative ones on odd frames, so that two frames together are symmetric.
    """
    half = size // 2
    if size % 2 == 0:
        return [(d - odd_frame, 1.0) for d in range(1 - half, half + 1)]
    return [(d, 0.5 if abs(d) == half > 0 else 1.0) for d in range(-half, half + 1)]
