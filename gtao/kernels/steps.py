"""Where the samples of a search lie: distances in pixels from a step's number and its jitter.

Theory, eq. (63). Engines differ here more than anywhere else, and with few samples it shows.
"""

from functools import cache

import drjit as dr

from .noise import GOLDEN, frac

__all__ = ["LAWS", "MAX_UNROLLED", "block_length", "distance", "jitter"]

# Beyond this many steps per side the step loop becomes symbolic, in blocks of at most this many.
MAX_UNROLLED = 32


@cache
def block_length(n_steps, limit=MAX_UNROLLED):
    """Largest divisor of the step count that is worth unrolling."""
    return max(k for k in range(1, min(n_steps, limit) + 1) if n_steps % k == 0)


def _power(t, exponent):
    if dr.is_array_v(exponent):
        # 0 to any power is 0, but its derivative holds the logarithm of 0.
        positive = t > 0
        return dr.select(positive, dr.select(positive, t, 1) ** exponent, 0)
    if exponent == 1:
        return t
    if exponent == 1.25:
        return t * dr.sqrt(dr.sqrt(t))
    if exponent == 2:
        return t * t
    return t**exponent


def _strata(j, xi, n, p, m, reach):
    return dr.fma(_power((xi + j) * (1 / n), p), reach - m, m)


def _offset(j, xi, n, p, m, reach):
    return dr.fma(_power((xi + j) * (1 / n), p), reach, m)


def _at_least(j, xi, n, p, m, reach):
    d, least = _power((xi + j) * (1 / (n + 1)), p) * reach, m * (1 + j)
    return dr.select(d > least, d, least)


def _whole(j, xi, n, p, m, reach):
    least = m * (n + 1)
    return _power((xi + (1 + j)) * (1 / (n + 1)), p) * dr.select(reach > least, reach, least)


def _beyond(j, xi, n, p, m, reach):
    return _power((xi + (1 + j)) * (1 / n), p) * reach


LAWS = {"strata": _strata, "offset": _offset, "at_least": _at_least, "whole": _whole, "beyond": _beyond}


def distance(law, j, xi, n, exponent, min_step_px, reach):
    """Distance of step ``j`` from its pixel, in pixels.

    Args:
        law: a key of ``LAWS``.
        j: number of the step, from 0.
        xi: jitter in [0, 1).
        n: steps per side.
        exponent: power p of the spacing.
        min_step_px: the least distance m.
        reach: length ℓ of the search; by the laws "offset", "at_least", "whole" and "beyond" samples may exceed it.
    """
    return LAWS[law](j, xi, n, exponent, min_step_px, reach)


def jitter(kind, offset, j, n):
    """Jitter ξ of step ``j`` of a slice with offset ``offset``; "step" goes on along the golden-ratio sequence.

    Step j of slice i has the number i + j n in it: not one after the other, and repeated where slices outnumber steps.
    """
    if kind == "none":
        return type(offset)(0)
    return frac(offset + j * (n * GOLDEN)) if kind == "step" else offset
