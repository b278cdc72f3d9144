"""Where the levels lie in the buffer: such that the address of a texel is a polynomial in the scale of its level."""

from dataclasses import dataclass
from functools import cached_property

__all__ = ["Table"]


@dataclass(frozen=True)
class Table:
    """Layout of the levels; a static part of kernels.

    Level k has rows of ``stride``/2ᵏ texels, the last of which may be unused, and begins at ``base``/4ᵏ - ``shift``:
    the coarsest level comes first. With s = 2⁻ᵏ and whole numbers x and y, the texel over pixel (x, y) is therefore
    number ⌊s (stride ⌊s y⌋ + base s + x) - shift⌋ of the buffer, for which no table is looked up (theory, eq. (90)).

    Args:
        width, height: sides of level 0 in texels.
        n_levels: levels that there are; see :meth:`of`.
    """

    width: int
    height: int
    n_levels: int

    @classmethod
    def of(cls, width, height, n_levels):
        """``n_levels`` levels, or as many as it takes to come to a single texel, after which they repeat."""
        return cls(width, height, min(n_levels, (max(width, height) - 1).bit_length() + 1))

    @cached_property
    def widths(self):
        return tuple(((self.width - 1) >> k) + 1 for k in range(self.n_levels))

    @cached_property
    def heights(self):
        return tuple(((self.height - 1) >> k) + 1 for k in range(self.n_levels))

    @cached_property
    def stride(self):
        """Texels from row to row of level 0: the width, rounded up to be divisible by the powers of two."""
        return _round_up(self.width, 1 << (self.n_levels - 1))

    @cached_property
    def base(self):
        """Such that no level reaches into the one below it."""
        sizes = [self.stride * (height << k) for k, height in enumerate(self.heights)]
        return _round_up(-(-max(sizes[1:], default=0) // 3), 4 ** (self.n_levels - 1))

    @cached_property
    def shift(self):
        """What would be empty in front of the coarsest level; a multiple of 4, so that aligned rows stay aligned."""
        return self.base >> 2 * (self.n_levels - 1) & ~3

    @cached_property
    def offsets(self):
        """Number of the first texel of each level."""
        return tuple((self.base >> 2 * k) - self.shift for k in range(self.n_levels))

    @property
    def size(self):
        """Length of the buffer."""
        return self.offsets[0] + self.stride * self.height

    @property
    def last(self):
        """Number of the last texel."""
        return self.size - 1 - (self.stride - self.width)


def _round_up(value, multiple):
    return -(-value // multiple) * multiple
