"""HBAO, the baseline that GTAO grew out of."""

import math
from dataclasses import dataclass
from typing import Any, Literal

from gtao.errors import ConfigError

from ._checks import check_choice, check_count, plain
from .slices import SliceMethod, Zenith, with_slice_arguments

__all__ = ["HBAO", "Attenuation"]

Attenuation = Literal["sample", "horizon", "none"]


@with_slice_arguments
@dataclass(frozen=True, kw_only=True)
class HBAO(SliceMethod):
    """Image-space horizon-based ambient occlusion (Bavoil, Sainz and Dimitrov 2008).

    Openness of the hemisphere, uniform in solid angle: A = 1 - 1/(2π) ∫ (sin h - sin t) W dθ with the tangent angle t,
    the horizon h and the linear attenuation W = max(0, 1 - r/R). Samples beyond the radius R are ignored. Without
    attenuation it is GTAO with uniform weighting.

    Args:
        n_directions: directions per pixel, an even number from 2 to 2048: they come in opposite pairs.
        attenuation: W of every "sample" that raises the horizon, for the arc by which it does (NVIDIA's
            implementation); W of the sample that defines the "horizon", for the whole arc (the sketch); or "none".
    """

    n_directions: int = 8
    attenuation: Attenuation = "sample"
    slice_measure: Any = "screen"
    zenith: Zenith = "optical_axis"
    step_exponent: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        check_count("n_directions", self.n_directions, 2, 2048)
        if self.n_directions % 2:
            raise ConfigError(f"n_directions must be even, opposite directions share a slice, got {self.n_directions}")
        check_choice("attenuation", self.attenuation, Attenuation)
        if self.attenuation != "none" and math.isinf(plain(self.radius)):
            raise ConfigError("attenuation needs a finite radius; give a radius or attenuation='none'")

    @property
    def n_slices(self) -> int:
        """Slices per pixel, of two directions each."""
        return self.n_directions // 2
