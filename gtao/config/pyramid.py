"""Depth at lower resolutions for far samples."""

from dataclasses import dataclass
from typing import Literal

from gtao.errors import ConfigError

from ._checks import check_choice, check_count, check_number

__all__ = ["DepthPyramid"]

Filter = Literal["weighted", "min", "max", "average", "harmonic", "rotated_grid"]


@dataclass(frozen=True, kw_only=True)
class DepthPyramid:
    """Samples far from their pixel read a coarser depth buffer, which is faster and stands for more of the scene.

    A sample at a distance of d pixels reads level log2(d) - level_offset, to the nearest one there is; level k has one
    texel for 2ᵏ × 2ᵏ pixels. The defaults are XeGTAO's.

    Args:
        filter: what a texel makes of the four below it. "weighted": the mean of those not much nearer than the
            farthest, by the ramp of the method's falloff (of the last 61.5 % of the radius without one) shrunk to
            three quarters: thin things disappear, and a texel that contains background is background. "min", "max":
            the nearest or farthest. "average": the mean of the surfaces. "harmonic": the mean in 1/z, background
            included. "rotated_grid": one of the four, another one in odd rows and columns.
        n_levels: 1 (the depth buffer alone) to 12.
        level_offset: logarithm of the distance up to which level 0 is read, but for rounding; from -16, where every
            sample reads the last level, to 16.
    """

    filter: Filter = "weighted"
    n_levels: int = 5
    level_offset: float = 3.3

    def __post_init__(self) -> None:
        check_choice("pyramid filter", self.filter, Filter)
        check_count("pyramid n_levels", self.n_levels, 1, 12)
        if not -16 <= check_number("pyramid level_offset", self.level_offset) <= 16:
            raise ConfigError(f"pyramid level_offset must lie in [-16, 16], got {self.level_offset}")
