"""Integrals over cones with a given number of nodes."""

from collections.abc import Callable
from typing import Any

import drjit as dr
import numpy as np

from gtao import backend

from .brdf_arcs import arcs
from .brdf_integrands import ggx_terms, terms_of
from .brdf_panels import FIELDS, panels
from .brdf_rings import axis_of, displacement, ring_of

__all__ = ["panel_sums"]


def panel_sums(
    alpha_v: np.ndarray,
    beta: np.ndarray,
    alpha: np.ndarray,
    theta_o: np.ndarray,
    chi: np.ndarray,
    *,
    in_plane: bool,
    n_nodes: int,
    brdf: Callable[[Any, Any], Any] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Integrals over cones within the hemisphere, theory, eq. (158), in parts; arguments (n,), widths above 0.

    Args:
        in_plane: every axis lies in the incidence plane, χ is 0 or π.
        n_nodes: Gauss nodes of every half of a panel in t, and of every half of an arc.
        brdf: as for :func:`gtao.tables.brdf.cone_terms`; None: the two terms of GGX.

    Returns:
        Index (m,) of the cone that a part belongs to, ascending, and the parts (m, C). Which parts a cone has does not
        depend on the number of nodes, nor on the other cones.
    """
    Float = dr.float64_array_t(backend.default_float())
    UInt = dr.uint32_array_t(Float)
    cut = panels(alpha_v, beta, alpha, theta_o, chi, in_plane)
    n_lanes = len(cut.owner) * n_nodes
    n_channels = 2 if brdf is None else 1
    if n_lanes == 0:
        return cut.owner, np.zeros((0, n_channels))
    grade, weight = (dr.opaque(Float(x)) for x in _nodes(n_nodes))
    lane = dr.arange(UInt, n_lanes)
    panel, node = lane // n_nodes, lane % n_nodes
    owner = dr.gather(UInt, UInt(cut.owner.astype(np.uint32)), panel)
    axis = axis_of(*(dr.gather(Float, Float(x), owner) for x in (beta, alpha, theta_o, chi)), in_plane)
    start, from_lobe, length, scale = (dr.gather(Float, Float(getattr(cut, name)), panel) for name in FIELDS)
    off, d_t = _Graded(length, scale)(dr.gather(Float, grade, node), dr.gather(Float, weight, node))
    ring = ring_of(axis, start + off, from_lobe + off)
    pieces = [(arc.start, _Graded(arc.length, arc.scale)) for arc in arcs(ring, in_plane)]
    terms = ggx_terms if brdf is None else terms_of(brdf)
    n = dr.opaque(UInt, n_nodes)
    sums = tuple(dr.zeros(Float, n_lanes) for _ in range(n_channels))
    for first, of in pieces:

        def more(k, *sums):
            return k < n

        def body(k, *sums, first=first, of=of):
            off, d_phi = of(dr.gather(Float, grade, k), dr.gather(Float, weight, k))
            channels = terms(axis, *displacement(ring, first + off))
            return k + 1, *(dr.fma(d_phi, f, total) for f, total in zip(channels, sums, strict=True))

        state = (dr.zeros(UInt, n_lanes), *sums)
        _, *sums = dr.while_loop(state, more, body, labels=("k", *"ab"[:n_channels]))
    rings = [(2 if in_plane else 1) * ring.sin_t * d_t * total for total in sums]
    dr.eval(rings)
    # Sums in a fixed order: the bits do not depend on the number of threads.
    blocks = [dr.block_sum(x, n_nodes, mode="evaluated").numpy() for x in rings]
    return cut.owner, np.stack(blocks, axis=-1)


class _Graded:
    """Nodes that crowd towards the start of a stretch: its offset and measure as scale · sinh of x² times a constant.

    Gauss nodes in x see a pole at any distance, and a square root at the start, as smooth.
    """

    def __init__(self, length: Any, scale: Any) -> None:
        self.half, self.stretch = dr.copysign(0.5 * scale, length), dr.asinh(abs(length) / scale)

    def __call__(self, grade: Any, weight: Any) -> tuple[Any, Any]:
        e = dr.exp(self.stretch * grade)
        return self.half * (e - 1 / e), abs(self.half) * self.stretch * (e + 1 / e) * weight


def _nodes(n: int) -> tuple[np.ndarray, np.ndarray]:
    """x² and the weight 2 x dx of Gauss nodes x in (0, 1)."""
    x, w = np.polynomial.legendre.leggauss(n)
    x, w = 0.5 * (x + 1), 0.5 * w
    return x * x, 2 * x * w
