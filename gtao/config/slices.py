"""What all methods share that march slices through the depth buffer."""

import math
from dataclasses import dataclass
from typing import Any, Literal

from gtao.errors import ConfigError

from ._checks import (
    check_choice,
    check_count,
    check_flag,
    check_instance,
    check_number,
    check_positive,
    is_array,
    plain,
)
from .codec import to_dict
from .pyramid import DepthPyramid

__all__ = [
    "Arccosine",
    "Border",
    "Fetch",
    "Noise",
    "SliceMeasure",
    "SliceMethod",
    "StepJitter",
    "StepLaw",
    "Zenith",
    "with_slice_arguments",
]

SliceMeasure = Literal["view", "screen", "screen_unnormalised"]
Fetch = Literal["nearest", "linear", "bilinear", "floor", "nearest_of_four"]
StepLaw = Literal["strata", "offset", "at_least", "whole", "beyond"]
StepJitter = Literal["slice", "step", "pixel", "none"]
Border = Literal["shorten", "replicate", "clamp"]
Arccosine = Literal["exact", "two_term", "bit_trick"]
Noise = Literal[
    "none",
    "spatial_4x4",
    "spatial_4x4_unbracketed",
    "spatial_4x4_fine",
    "spatial_4x4_spread",
    "interleaved_gradient",
    "interleaved_gradient_cycled",
    "interleaved_gradient_golden",
    "hilbert_r2",
    "blue_noise",
    "sobol",
    "white",
]
Zenith = Literal["view", "optical_axis"]

#: Listed azimuths are chosen from one after the other, which is fit for short lists.
MOST_LISTED = 32


@dataclass(frozen=True, kw_only=True)
class SliceMethod:
    """Options of the march, common to :class:`gtao.GTAO`, :class:`gtao.HBAO` and :class:`gtao.VisibilityBitmask`.

    Args:
        radius: reach of an occluder in scene units; ``inf`` for no limit. Without ``falloff`` the cut is sharp and
            exact: matter counts as far as it lies within the radius, everything behind a depth sample being solid.
        radius_multiplier: the search reaches this many radii, which compensates a falloff.
        n_steps: depth samples per side of a slice, 1 to 4096.
        slice_measure: "view" spaces slices evenly about the view vector and is exact everywhere in the frame;
            "screen" spaces them evenly in the image, as published, and is biased off the optical axis;
            "screen_unnormalised" also projects the normal along an axis that is no unit vector, as the published
            listing has it (theory, eq. (64)).
        slice_angles: azimuths of the slices in half turns, one for each, instead of even ones.
        zenith: axis that horizons are measured from: the "view" vector of the pixel, which every slice contains, or
            the "optical_axis", which slices contain at the image centre only.
        fetch: "nearest" reads one texel; "linear" interpolates 1/z between four and is exact on planes; "bilinear"
            does so across silhouettes too; "floor" truncates coordinates, half a texel off; "nearest_of_four" takes
            the texel next to the eye of the four around the point, for the shaded point as well.
        snap_to_texel: with the nearest fetch, move a sample to the centre of its texel. The sample then lies on the
            surface but beside the slice; without, it lies in the slice but on a flat step of the depth buffer.
        step_exponent: sample distances grow like tᵖ with this p; 1 is uniform, more favours near occluders. The default
            has the lowest error of GTAO's default numbers of slices and steps (``fits/steps/2026-11``).
        step_law: where samples lie on a search of ℓ pixels, from j + ξ with the step's number j and its jitter ξ, for
            n = n_steps, m = min_step_px, and p = step_exponent (theory, eq. (63)): "strata" between m and ℓ,
            m + ((j + ξ)/n)ᵖ (ℓ - m); "offset" strata of all of ℓ moved outward, m + ((j + ξ)/n)ᵖ ℓ; "at_least"
            max(((j + ξ)/(n + 1))ᵖ ℓ, m (1 + j)); "whole" steps, ((j + 1 + ξ)/(n + 1))ᵖ max(ℓ, m (n + 1)); "beyond",
            ((j + 1 + ξ)/n)ᵖ ℓ, whose last samples may lie outside of the radius.
        step_jitter: ξ is one number per "slice", advanced by the golden ratio from slice to slice; one per "step",
            advanced from step to step as well; one for the whole "pixel"; or with "none" 0 everywhere.
        min_step_px: distance of the nearest possible sample in pixels.
        max_radius_px: longest search in pixels, as published (the radius scales with distance up to this limit).
        max_radius_share: longest search as a share of the square root of the frame's number of pixels, but 16 pixels
            at least.
        border: where a search would leave the frame, "shorten" it; "replicate" the depth of the nearest texel beyond
            the border; or "clamp" sample positions to two texels inside.
        noise: per-pixel rotation of slices and offset of steps: "none", "spatial_4x4" (the papers', 16 directions and
            4 offsets per 4×4 pixels, 48 and 4 over 24 frames), the same formula as printed, which has 4 directions
            ("spatial_4x4_unbracketed"), the same in space with the 96 directions and 16 offsets over 24 frames that
            the slides count, of which a single pixel sees a sixteenth ("spatial_4x4_fine") or all around, in frames
            of either parity too ("spatial_4x4_spread"), "interleaved_gradient" (which moves from frame to frame), the
            same with the papers' rotations and offsets per frame ("interleaved_gradient_cycled") or with steps of the
            golden ratio ("interleaved_gradient_golden"), "hilbert_r2" (a low-discrepancy sequence along a Hilbert
            curve), "blue_noise" (a mask by void and cluster, with steps of the golden ratio from frame to frame),
            "sobol" (the frame's number of a scrambled Sobol sequence in every pixel), or "white"; compared in the
            docs, "Noise over space and time".
        seed: selects one of the sequences of the "white" and "sobol" noise, and where the "blue_noise" mask begins.
        pyramid: coarser depth for far samples, with the fetches "nearest", "floor" and "bilinear".
        depth_bias: share of its depth by which the shaded point is pulled to the viewer, against self-occlusion.
    """

    radius: float = math.inf
    radius_multiplier: float = 1.0
    n_steps: int = 8
    slice_measure: SliceMeasure = "view"
    slice_angles: tuple[float, ...] | None = None
    zenith: Zenith = "view"
    fetch: Fetch = "nearest"
    snap_to_texel: bool = True
    step_exponent: float = 1.25
    step_law: StepLaw = "strata"
    step_jitter: StepJitter = "slice"
    min_step_px: float = 1.0
    max_radius_px: float | None = None
    max_radius_share: float | None = None
    border: Border = "shorten"
    noise: Noise = "spatial_4x4"
    seed: int = 0
    pyramid: DepthPyramid | None = None
    depth_bias: float = 0.0

    def __post_init__(self) -> None:
        check_positive("radius", self.radius, infinite=True)
        check_positive("radius_multiplier", self.radius_multiplier)
        check_count("n_steps", self.n_steps, 1, 4096)
        check_choice("slice_measure", self.slice_measure, SliceMeasure)
        self._check_angles()
        check_choice("zenith", self.zenith, Zenith)
        check_choice("fetch", self.fetch, Fetch)
        check_flag("snap_to_texel", self.snap_to_texel)
        check_positive("step_exponent", self.step_exponent)
        check_choice("step_law", self.step_law, StepLaw)
        check_choice("step_jitter", self.step_jitter, StepJitter)
        # Strata start there, and at less than half a pixel a sample would be the shaded point itself.
        lowest = 0.5 if self.step_law == "strata" else 0.0
        if not lowest <= check_number("min_step_px", self.min_step_px) <= 64:
            raise ConfigError(f"min_step_px must lie in [{lowest:g}, 64], got {plain(self.min_step_px)}")
        if self.max_radius_px is not None:
            check_positive("max_radius_px", self.max_radius_px, infinite=True)
            least, longest = plain(self.min_step_px), plain(self.max_radius_px)
            if longest < least:
                raise ConfigError(f"max_radius_px must be at least {least:g}, got {longest}")
        if self.max_radius_share is not None:
            check_positive("max_radius_share", self.max_radius_share)
        check_choice("border", self.border, Border)
        endless = math.isinf(plain(self.radius)) and self.max_radius_px is None and self.max_radius_share is None
        if self.border != "shorten" and endless:
            raise ConfigError(f"border {self.border!r} needs a finite radius, max_radius_px or max_radius_share")
        check_choice("noise", self.noise, Noise)
        check_count("seed", self.seed, 0, 2**32 - 1)
        self._check_pyramid()
        if not 0 <= check_number("depth_bias", self.depth_bias) <= 0.1:
            raise ConfigError(f"depth_bias must lie in [0, 0.1], got {plain(self.depth_bias)}")

    @property
    def search_radius(self) -> float:
        """How far the search reaches in scene units."""
        return self.radius * self.radius_multiplier

    def _check_falloff(self, falloff: Any) -> None:
        end, farthest = plain(getattr(falloff, "end", 0.0)), max(plain(self.radius), plain(self.search_radius))
        if end > farthest * (1 + 1e-6):
            raise ConfigError(f"falloff end {end} lies beyond the radius {farthest}")

    def _check_pyramid(self) -> None:
        check_instance("pyramid", self.pyramid, DepthPyramid)
        if self.pyramid is None:
            return
        if self.fetch not in ("nearest", "floor", "bilinear"):
            raise ConfigError(f"a pyramid is read with fetch 'nearest', 'floor' or 'bilinear', got {self.fetch!r}")
        if self.pyramid.filter == "weighted" and math.isinf(plain(self.radius)):
            raise ConfigError("a weighted pyramid needs a finite radius, or another filter")

    def _check_angles(self) -> None:
        if self.slice_angles is None:
            return
        if not isinstance(self.slice_angles, tuple | list):
            raise ConfigError(f"slice_angles must be None or a tuple of numbers, got {self.slice_angles!r}")
        if any(map(is_array, self.slice_angles)):
            raise ConfigError("slice_angles are a part of the kernel and carry no gradients; give Python numbers")
        # Read from a record they are a list, which would not be hashable.
        object.__setattr__(self, "slice_angles", tuple(check_number("slice_angles", a) for a in self.slice_angles))
        n_slices = self.n_slices  # type: ignore[attr-defined]  # every subclass has it
        if len(self.slice_angles) != n_slices or n_slices > MOST_LISTED:
            raise ConfigError(
                f"slice_angles must give an angle for each of n_slices = {n_slices} slices, {MOST_LISTED} at most,"
                f" got {len(self.slice_angles)}"
            )

    def to_dict(self) -> dict[str, Any]:
        """Plain values that :func:`gtao.method_from_dict` turns back into the same configuration."""
        return to_dict(self)


def with_slice_arguments(cls: type) -> type:
    """Append the arguments of :class:`SliceMethod` to the docstring of a class that inherits them."""
    if cls.__doc__ and SliceMethod.__doc__:
        cls.__doc__ = f"{cls.__doc__.rstrip()}\n\n    Other Parameters:{SliceMethod.__doc__.split('Args:')[1]}"
    return cls
