"""Directions of a half-slice as nodes of a quadrature, one bit each: 1 is blocked.

A half-slice is what the view vector V spans with one tangent T ⊥ V: ω(θ) = cos θ V + sin θ T, θ in [0, π].
"""

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr

from .noise import frac

__all__ = ["PER_WORD", "Nodes"]

PER_WORD = 32
ALL = 0xFFFFFFFF


@dataclass(frozen=True)
class Nodes:
    """Evenly spaced angles between ``low`` and ``high``, the part of a half-slice in the normal's hemisphere."""

    nV: Any
    nT: Any
    low: Any
    high: Any
    offset: Any  # of the nodes, in units of their spacing
    rate: Any  # nodes per radian, 0 where none of the half-slice is in the hemisphere
    n_words: int

    @classmethod
    def of(cls, nV, nT, offset, n_words):
        """For a normal with n_V = ⟨N, V⟩ and n_T = ⟨N, T⟩, of any length and any sign.

        ⟨N, ω⟩ = n_V cos θ + n_T sin θ changes its sign once on [0, π] at most.

        Args:
            offset: any number; the same for all half-slices of a pixel would leave the nodes' errors alike.
            n_words: words of 32 nodes each.
        """
        facing = nV >= 0
        border = dr.atan2(abs(nV), dr.select(facing, -nT, nT))
        low, high = dr.select(facing, 0, border), dr.select(facing, border, math.pi)
        rate = dr.select(high > low, PER_WORD * n_words / (high - low), 0)
        return cls(nV, nT, low, high, frac(offset), rate, n_words)

    def between(self, first, last, types):
        """The nodes from angle ``first`` to angle ``last`` as words of bits; none if ``first`` is beyond ``last``."""
        Int, UInt = types.Int, types.UInt
        n_nodes = PER_WORD * self.n_words
        first, last = (dr.fma(angle - self.low, self.rate, -self.offset) for angle in (first, last))
        first, last = (dr.select(i > -1, dr.select(i < n_nodes, i, n_nodes), -1) for i in (first, last))
        first, last = Int(dr.ceil(first)), Int(dr.floor(last))
        words = []
        for word in range(self.n_words):
            a, b = first - word * PER_WORD, last - word * PER_WORD
            some = (a <= b) & (a < PER_WORD) & (b >= 0)
            a, b = dr.select(some & (a > 0), a, 0), dr.select(some & (b < PER_WORD - 1), b, PER_WORD - 1)
            bits = (UInt(ALL) << UInt(a)) & (UInt(ALL) >> UInt(PER_WORD - 1 - b))
            words.append(dr.select(some, bits, 0))
        return words

    def weigh(self, blocked, cosine, types, moments=1) -> tuple[Any, ...]:
        """Weight of the nodes that are open, and of all.

        A node weighs its spacing times |sin θ|, and with ``cosine`` times ⟨N, ω⟩: the rectangle rule.

        Args:
            moments: how many of the factors 1, sin θ, cos θ, sin² θ and sin θ cos θ to sum with the weights of open
                nodes.

        Returns:
            These sums, one after the other, and the weight of all nodes.
        """
        Float, UInt = types.Float, types.UInt
        spacing = dr.select(self.rate > 0, 1 / self.rate, 0)
        sums = tuple(dr.zeros(Float, dr.width(self.low)) for _ in range(moments + 1))
        for number, word in enumerate(blocked):

            def body(bit, *sums, word=word, first=PER_WORD * number):
                node = Float(bit) + self.offset + first
                s, c = dr.sincos(dr.fma(node, spacing, self.low))
                w = s * dr.fma(self.nV, c, self.nT * s) if cosine else s
                w = dr.select(w > 0, w * spacing, 0)
                seen = dr.select(((word >> bit) & 1) == 0, w, 0)
                terms = (seen, seen * s, seen * c, seen * s * s, seen * s * c)[:moments]
                return bit + 1, *(a + b for a, b in zip(sums, (*terms, w), strict=True))

            _, *sums = dr.while_loop((UInt(0), *sums), lambda bit, *_: bit < PER_WORD, body, label="nodes")
        return tuple(sums)
