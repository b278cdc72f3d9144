"""The point of a pixel, the vector to the viewer and the normal as closed forms need it."""

import drjit as dr

from . import horizon
from .march_types import Pixel, Scalars, Switches
from .roots import rsqrt

__all__ = ["edge_on", "shaded_point"]


def shaded_point(x, y, z, normal, k: Switches, s: Scalars, Float):
    """The shaded point; its normal, facing the zenith; and, if slices do not contain the zenith, facing the eye."""
    X, Y = dr.fma(x, s.ax, s.bx), dr.fma(y, s.ay, s.by)
    a2 = dr.fma(X, X, dr.fma(Y, Y, 1))
    rcp_a = rsqrt(a2)
    axis = (Float(0), Float(0), Float(1))
    if k.orthographic:
        P, p, V = (X, Y, -z), None, axis
    else:
        # Made of X and Y alone, V has no derivative by depth that the adjoint would have to find to be zero.
        P, p, V = (X * z, Y * z, -z), z * (a2 * rcp_a), (-X * rcp_a, -Y * rcp_a, rcp_a)
    n, nV = edge_on(normal, V)
    facing = None
    if k.zenith == "optical_axis" and not k.orthographic:
        facing, V = n, axis
        n, nV = edge_on(n, V)
    apart = horizon.apart_form(s.ax, s.ay, X, Y, rcp_a * rcp_a, k.orthographic)
    return Pixel(x, y, X, Y, apart, P, p, V, nV), n, facing


def edge_on(n, V):
    """The unit normal, turned until it is seen edge-on if it faces away from V, and ⟨N, V⟩.

    Closed forms need n_V > 0.
    """
    nV = dr.fma(n[0], V[0], dr.fma(n[1], V[1], n[2] * V[2]))
    facing = 1e-3
    bend = dr.select(nV < facing, facing - nV, 0)
    # |N + b V|² of unit vectors.
    scale = rsqrt(dr.fma(bend, dr.fma(2, nV, bend), 1))
    return tuple(dr.fma(bend, v, c) * scale for c, v in zip(n, V, strict=True)), (nV + bend) * scale
