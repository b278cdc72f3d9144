"""How much a new frame counts beside the history."""

import drjit as dr

from .ramps import saturate

__all__ = ["blend", "deviation", "effective_count"]

# Deviations are noisier than values, and must not follow what happens at once.
DEVIATION_FRAMES = 16


def blend(variance, speed, rate, moving_rate, moving_speed):
    """Weight of the new frame; theory, eq. (180).

    Args:
        variance: of the history beside one frame's, 1/n for the mean of n.
        speed: in pixels per frame.
        rate, moving_rate: lower limits at rest, and from ``moving_speed`` on.
    """
    mean = variance / (1 + variance)
    limit = dr.fma(saturate(speed / moving_speed), moving_rate - rate, rate)
    return dr.select(mean > limit, mean, limit)


def effective_count(share, variance):
    """Number of frames whose plain mean would have the variance of the result; theory, eq. (181).

    Args:
        share: of the new frame in it.
        variance: of the rest beside one frame's.
    """
    rest = 1 - share
    return 1 / dr.fma(share, share, rest * rest * variance)


def deviation(before, history, current):
    """Exponential mean of how far a pixel's frames were from its history, before the clamp."""
    return dr.fma(1 / DEVIATION_FRAMES, abs(current - history) - before, before)
