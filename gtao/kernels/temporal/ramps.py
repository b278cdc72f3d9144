"""Values kept within bounds."""

import drjit as dr

__all__ = ["saturate"]


def saturate(x):
    """x within [0, 1]."""
    return dr.select(x > 0, dr.select(x < 1, x, 1), 0)
