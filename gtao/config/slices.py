"""What all methods share that march slices through the depth buffer."""

import math
from dataclasses import dataclass
from typing import Any, Literal

from gtao.errors import ConfigError

from ._checks import check_choice, check_count, check_flag, check_number, check_positive
from .codec import to_dict

__all__ = ["Fetch", "Noise", "SliceMeasure", "SliceMethod", "Zenith", "with_slice_arguments"]

SliceMeasure = Literal["view", "screen"]
Fetch = Literal["nearest", "linear"]
Noise = Literal["none", "spatial_4x4", "interleaved_gradient", "white"]
Zenith = Literal["view", "optical_axis"]


@dataclass(frozen=True, kw_only=True)
class SliceMethod:
    """Options of the march, common to :class:`gtao.GTAO`, :class:`gtao.HBAO` and :class:`gtao.VisibilityBitmask`.

    Args:
        radius: reach of an occluder in scene units; ``inf`` for no limit. Without ``falloff`` the cut is sharp and
            exact: matter counts as far as it lies within the radius, everything behind a depth sample being solid.
        radius_multiplier: the search reaches this many radii, which compensates a falloff.
        n_steps: depth samples per side of a slice, 1 to 4096.
        slice_measure: "view" spaces slices evenly about the view vector and is exact everywhere in the frame;
            "screen" spaces them evenly in the image, as published, and is biased off the optical axis.
        zenith: axis that horizons are measured from: the "view" vector of the pixel, which every slice contains, or
            the "optical_axis", which slices contain at the image centre only.
        fetch: "nearest" reads one texel; "linear" interpolates 1/z between four and is exact on planes.
        snap_to_texel: with the nearest fetch, move a sample to the centre of its texel. The sample then lies on the
            surface but beside the slice; without, it lies in the slice but on a flat step of the depth buffer.
        step_exponent: sample distances grow like tᵖ with this p; 1 is uniform, 2 favours near occluders.
        min_step_px: distance of the nearest possible sample in pixels.
        max_radius_px: longest search in pixels, as published (the radius scales with distance up to this limit).
        noise: per-pixel rotation of slices and offset of steps: "none", "spatial_4x4" (the papers', 16 directions and
            4 offsets per 4×4 pixels), "interleaved_gradient", or "white".
        seed: selects the sequence of the "white" noise.
        depth_bias: share of its depth by which the shaded point is pulled to the viewer, against self-occlusion.
    """

    radius: float = math.inf
    radius_multiplier: float = 1.0
    n_steps: int = 8
    slice_measure: SliceMeasure = "view"
    zenith: Zenith = "view"
    fetch: Fetch = "nearest"
    snap_to_texel: bool = True
    step_exponent: float = 2.0
    min_step_px: float = 1.0
    max_radius_px: float | None = None
    noise: Noise = "spatial_4x4"
    seed: int = 0
    depth_bias: float = 0.0

    def __post_init__(self) -> None:
        check_positive("radius", self.radius, infinite=True)
        check_positive("radius_multiplier", self.radius_multiplier)
        check_count("n_steps", self.n_steps, 1, 4096)
        check_choice("slice_measure", self.slice_measure, SliceMeasure)
        check_choice("zenith", self.zenith, Zenith)
        check_choice("fetch", self.fetch, Fetch)
        check_flag("snap_to_texel", self.snap_to_texel)
        check_positive("step_exponent", self.step_exponent)
        if not 0.5 <= check_number("min_step_px", self.min_step_px) <= 64:
            raise ConfigError(f"min_step_px must lie in [0.5, 64], got {self.min_step_px}")
        if self.max_radius_px is not None:
            check_positive("max_radius_px", self.max_radius_px, infinite=True)
            if self.max_radius_px < self.min_step_px:
                raise ConfigError(f"max_radius_px must be at least {self.min_step_px:g}, got {self.max_radius_px}")
        check_choice("noise", self.noise, Noise)
        check_count("seed", self.seed, 0, 2**32 - 1)
        if not 0 <= check_number("depth_bias", self.depth_bias) <= 0.1:
            raise ConfigError(f"depth_bias must lie in [0, 0.1], got {self.depth_bias}")

    @property
    def search_radius(self) -> float:
        """How far the search reaches in scene units."""
        return self.radius * self.radius_multiplier

    def _check_falloff(self, falloff: Any) -> None:
        end = getattr(falloff, "end", 0.0)
        if end > self.search_radius * (1 + 1e-6):
            raise ConfigError(f"falloff end {end} lies beyond the search radius {self.search_radius}")

    def to_dict(self) -> dict[str, Any]:
        """Plain values that :func:`gtao.method_from_dict` turns back into the same configuration."""
        return to_dict(self)


def with_slice_arguments(cls: type) -> type:
    """Append the arguments of :class:`SliceMethod` to the docstring of a class that inherits them."""
    if cls.__doc__ and SliceMethod.__doc__:
        cls.__doc__ += SliceMethod.__doc__.split("Args:")[1]
    return cls
