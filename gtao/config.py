"""Strategy objects: frozen, keyword-only, validated when they are made.

Static parameters (counts, switches) specialise the kernel; ``radius``, the falloff, ``max_radius_px`` and ``seed``
reach it as values and change without recompiling.
"""

import math
import numbers
from dataclasses import asdict, dataclass
from typing import Any, Literal, get_args

from .errors import ConfigError

__all__ = ["GTAO", "LinearFalloff", "method_from_dict"]

Weighting = Literal["cosine", "uniform"]
SliceMeasure = Literal["view", "screen"]
Fetch = Literal["nearest", "linear"]
Noise = Literal["none", "spatial_4x4", "interleaved_gradient", "white"]


def _choice(name: str, value: Any, allowed: Any) -> None:
    choices = get_args(allowed)
    if value not in choices:
        raise ConfigError(f"{name} must be one of {', '.join(map(repr, choices))}, got {value!r}")


def _count(name: str, value: Any, low: int, high: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise ConfigError(f"{name} must be an integer from {low} to {high}, got {value!r}")


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise ConfigError(f"{name} must be a number, got {value!r}")
    return float(value)


def _positive(name: str, value: Any, *, infinite: bool = False) -> None:
    number = _number(name, value)
    if not number > 0 or (math.isinf(number) and not infinite):
        bound = "positive" if infinite else "positive and finite"
        raise ConfigError(f"{name} must be {bound}, got {value!r}")


@dataclass(frozen=True, kw_only=True)
class LinearFalloff:
    """Attenuation of far occluders, linear in world distance.

    The weight of a sample at distance d is clamp((end - d) / (end - start), 0, 1); it moves the sample's horizon
    cosine toward the tangent plane of its side (theory, eq. (29)).

    Args:
        start: distance in scene units up to which a sample counts in full.
        end: distance from which it no longer counts.
    """

    start: float
    end: float

    def __post_init__(self) -> None:
        _positive("falloff end", self.end)
        if not 0 <= _number("falloff start", self.start) < self.end:
            raise ConfigError(f"falloff needs 0 <= start < end, got start={self.start}, end={self.end}")


@dataclass(frozen=True, kw_only=True)
class GTAO:
    """Ground-truth ambient occlusion (Jimenez et al. 2016): horizons of vertical slices, integrated in closed form.

    The defaults estimate the integral as it is defined; what the papers or engines do otherwise is an option.

    Args:
        radius: reach of an occluder in scene units; ``inf`` for no limit. Without ``falloff`` the cut is sharp and
            exact: matter counts as far as it lies within the radius, everything behind a depth sample being solid.
        n_slices: slices per pixel, 1 to 1024.
        n_steps: depth samples per side of a slice, 1 to 4096.
        weighting: "cosine" (diffuse visibility; theory, eq. (1)) or "uniform" (share of the open solid angle of the
            hemisphere; eq. (2)).
        slice_measure: "view" spaces slices evenly about the view vector and is exact everywhere in the frame;
            "screen" spaces them evenly in the image, as published, and is biased off the optical axis.
        fetch: "nearest" reads one texel; "linear" interpolates 1/z between four and is exact on planes.
        snap_to_texel: with the nearest fetch, move a sample to the centre of its texel. The sample then lies on the
            surface but beside the slice; without, it lies in the slice but on a flat step of the depth buffer.
        step_exponent: sample distances grow like tᵖ with this p; 1 is uniform, 2 favours near occluders.
        falloff: optional attenuation in place of the sharp cut; its ``end`` must not exceed ``radius``.
        max_radius_px: longest search in pixels, as published (the radius scales with distance up to this limit).
        noise: per-pixel rotation of slices and offset of steps: "none", "spatial_4x4" (the papers', 16 directions and
            4 offsets per 4×4 pixels), "interleaved_gradient", or "white".
        seed: selects the sequence of the "white" noise.

    Raises:
        ConfigError: a parameter is out of range; the message says which and what came.
    """

    radius: float = math.inf
    n_slices: int = 4
    n_steps: int = 8
    weighting: Weighting = "cosine"
    slice_measure: SliceMeasure = "view"
    fetch: Fetch = "nearest"
    snap_to_texel: bool = True
    step_exponent: float = 2.0
    falloff: LinearFalloff | None = None
    max_radius_px: float | None = None
    noise: Noise = "spatial_4x4"
    seed: int = 0

    def __post_init__(self) -> None:
        _positive("radius", self.radius, infinite=True)
        _count("n_slices", self.n_slices, 1, 1024)
        _count("n_steps", self.n_steps, 1, 4096)
        _choice("weighting", self.weighting, Weighting)
        _choice("slice_measure", self.slice_measure, SliceMeasure)
        _choice("fetch", self.fetch, Fetch)
        _choice("noise", self.noise, Noise)
        _positive("step_exponent", self.step_exponent)
        if not isinstance(self.snap_to_texel, bool):
            raise ConfigError(f"snap_to_texel must be True or False, got {self.snap_to_texel!r}")
        if self.falloff is not None:
            if not isinstance(self.falloff, LinearFalloff):
                raise ConfigError(f"falloff must be a LinearFalloff or None, got {self.falloff!r}")
            if self.falloff.end > self.radius:
                raise ConfigError(f"falloff end {self.falloff.end} lies beyond the radius {self.radius}")
        if self.max_radius_px is not None:
            _positive("max_radius_px", self.max_radius_px, infinite=True)
            if self.max_radius_px < 1:
                raise ConfigError(f"max_radius_px must be at least 1, got {self.max_radius_px}")
        _count("seed", self.seed, 0, 2**32 - 1)

    @classmethod
    def as_published(cls, radius: float = 200.0, **changes: Any) -> "GTAO":
        """One slice, slices even in the image, linear steps and falloff over the last quarter of the radius.

        The slides' radius is 200 inches; give your own in scene units.
        """
        options: dict[str, Any] = {
            "radius": radius,
            "n_slices": 1,
            "n_steps": 8,
            "slice_measure": "screen",
            "step_exponent": 1.0,
            "falloff": LinearFalloff(start=0.75 * radius, end=radius),
        }
        return cls(**(options | changes))

    def to_dict(self) -> dict[str, Any]:
        """Plain values that :func:`method_from_dict` turns back into the same configuration."""
        return {"type": "GTAO", **asdict(self)}


def method_from_dict(data: dict[str, Any]) -> GTAO:
    """The configuration that :meth:`GTAO.to_dict` described.

    Raises:
        ConfigError: the type is unknown, a name does not exist or a value is out of range.
    """
    if not isinstance(data, dict):
        raise ConfigError(f"a method is described by an object of names and values, got {type(data).__name__}")
    data = dict(data)
    kind = data.pop("type", "GTAO")
    if kind != "GTAO":
        raise ConfigError(f"unknown method {kind!r}; choose GTAO")
    try:
        if isinstance(data.get("falloff"), dict):
            data["falloff"] = LinearFalloff(**data["falloff"])
        return GTAO(**data)
    except TypeError as error:
        raise ConfigError(f"bad GTAO options: {error}") from None
