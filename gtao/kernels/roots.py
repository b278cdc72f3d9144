"""The reciprocal square root, by each backend's fastest way."""

import drjit as dr

__all__ = ["rsqrt"]


def rsqrt(x):
    """1/√x."""
    if dr.backend_v(x) is dr.JitBackend.CUDA:
        return dr.rsqrt(x)
    # On the CPU an estimate, its Newton step and the test for special values take seven instructions of units that are
    # in demand; root and quotient run on the divider beside them.
    return dr.rcp(dr.sqrt(x))
