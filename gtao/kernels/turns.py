"""Cosine and sine of the first azimuth: a part of a half turn, so that no argument has to be brought into range."""

import math

import drjit as dr

from .chebyshev import evaluate, interpolated

__all__ = ["half_turn"]

# cos(π y) and sin(π y)/y from y² for |y| <= 1/2, with errors of 5e-8 and 7e-9.
_COS = interpolated(lambda u: math.cos(math.pi * math.sqrt(u)), 0.0, 0.25, 5)
_SIN = interpolated(lambda u: math.sin(math.pi * math.sqrt(u)) / math.sqrt(u), 0.0, 0.25, 5)


def half_turn(x):
    """cos(π x) and sin(π x) for x in [0, 1]; polynomials in single precision, Dr.Jit's own in double."""
    if dr.type_v(x) is not dr.VarType.Float32:
        sine, cosine = dr.sincos(math.pi * x)
        return cosine, sine
    y = x - 0.5
    u = y * y
    return -y * evaluate(_SIN, u), evaluate(_COS, u)
