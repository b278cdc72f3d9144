"""What game engines and libraries compute, as pipelines: each of their deviations is one named option of ours.

Facts and constants come from the sources named at each function; the page *Departures* tabulates every deviation
beside what the papers have. What is left out of all of them: normals made from depth (the frame's are used), 8- and
16-bit storage, half resolution with its upsampling, and accumulation over frames. Where an engine's lengths are
defaults in metres they scale with the radius, in the ratio of their defaults.
"""

from typing import Any, Literal

from gtao.errors import ConfigError

from ._checks import check_positive, plain
from .bitmask import VisibilityBitmask
from .falloff import IndexFalloff, LinearFalloff, NoCut, QuadraticFalloff
from .filters import EdgeAwareFilter, PlaneAwareFilter, SpatialFilter
from .gtao import GTAO
from .levels import LEVELS, Level, counts_of
from .pipeline import Pipeline
from .pyramid import DepthPyramid
from .thickness import ConstantThickness, DepthCut, RunningThickness

__all__ = ["LEVELS", "Level", "bevy", "filament", "filament_bitmask", "hdrp", "threejs", "xegtao"]

_FILAMENT: dict[str, Any] = {
    "n_slices": 4,
    "n_steps": 3,
    "slice_measure": "screen",
    "snap_to_texel": False,
    "step_exponent": 1.0,
    "step_law": "at_least",
    "step_jitter": "pixel",
    "border": "replicate",
    # The logarithm of the distance is rounded down before 3 is subtracted.
    "pyramid": DepthPyramid(filter="rotated_grid", level_offset=3.5),
}


def _checked(radius: float) -> float:
    """The radius, before anything is derived from it."""
    check_positive("radius", radius)
    return radius


def xegtao(level: Level = "high", radius: float = 0.5) -> Pipeline:
    """XeGTAO (Strugar and Mccalla 2021, version 1.30 of GameTechDev/XeGTAO, archived in 2024).

    The build with depths in single precision: the one in half precision pulls the shaded point by 0.08 % of its depth
    instead of 0.001 %, to outweigh its rounding.

    Args:
        level: "low", "medium", "high" or "ultra": 1×2, 2×2, 3×3 or 9×3 slices and steps per side.
        radius: effect radius in scene units; the search reaches 1.457 of it.

    Raises:
        ConfigError: the level does not exist or the radius is not positive.
    """
    radius = _checked(radius)
    reach = 1.457 * radius
    occlusion = GTAO(
        radius=radius,
        radius_multiplier=1.457,
        **counts_of(level),
        slice_measure="screen",
        step_exponent=2.0,
        step_law="offset",
        step_jitter="step",
        min_step_px=1.3,
        border="replicate",
        noise="hilbert_r2",
        pyramid=DepthPyramid(),
        depth_bias=1e-5,
        falloff=LinearFalloff(start=(1 - 0.615) * reach, end=reach),
        length_blend=0.05,
        arccosine="bit_trick",
        small_radius_fade=True,
        power=2.2,
        floor=0.03,
    )
    return Pipeline(occlusion=occlusion, spatial=EdgeAwareFilter())


def hdrp(radius: float = 2.0, temporal: bool = False) -> Pipeline:
    """Unity HDRP's screen-space ambient occlusion (com.unity.render-pipelines.high-definition, as of 2024).

    At full resolution and at intensity 1, six steps per side.

    Args:
        radius: in scene units. The search reaches half of it.
        temporal: one direction per frame for accumulation over frames, as by default there; else two directions.
    """
    radius = _checked(radius)
    # The angles are those of the slides' first two frames: two directions lie 120 and 60 degrees apart.
    directions: dict[str, Any] = {"n_slices": 2, "slice_angles": (1 / 6, 5 / 6), "noise": "interleaved_gradient"}
    if temporal:
        directions = {"n_slices": 1, "noise": "interleaved_gradient_cycled"}
    occlusion = GTAO(
        radius=radius,
        # The factor from scene units to pixels is a quarter of the frame's height in units of its half, not a half.
        radius_multiplier=0.5,
        n_steps=6,
        **directions,
        slice_measure="screen",
        fetch="floor",
        snap_to_texel=False,
        step_exponent=1.0,
        step_law="whole",
        step_jitter="pixel",
        max_radius_share=40 / (540 * 960) ** 0.5,
        border="clamp",
        # Of the levels it reads one alone.
        pyramid=DepthPyramid(filter="min", n_levels=2, level_offset=-16.0),
        falloff=QuadraticFalloff(end=radius, toward="horizon"),
        thickness=RunningThickness(blend=0.03),
        length_blend=1.0,
        arccosine="two_term",
        ceiling=1.0,
    )
    # HDRP's own 4×4 filter weighs by differences in metres; ours by shares of the depth.
    return Pipeline(occlusion=occlusion, spatial=SpatialFilter(derivatives="none"))


def filament(radius: float = 0.3) -> Pipeline:
    """Filament's GTAO (google/filament, 2025), four slices of three steps per side, at full resolution.

    Args:
        radius: in scene units.
    """
    radius = _checked(radius)
    occlusion = GTAO(
        radius=radius,
        **_FILAMENT,
        falloff=QuadraticFalloff(end=radius, strength=2.0, toward="horizon"),
        thickness=RunningThickness(blend=0.004),
        arccosine="two_term",
        ceiling=1.0,
    )
    # Filament's own filter is a separable Gaussian of eleven taps.
    return Pipeline(occlusion=occlusion, spatial=SpatialFilter(derivatives="none"))


def filament_bitmask(radius: float = 0.3) -> Pipeline:
    """Filament's GTAO with ``useVisibilityBitmasks`` (google/filament pull request 9101, 2025): 32 sectors.

    Args:
        radius: in scene units. Occluders are 5/3 of it thick: 0.5 at the default radius.
    """
    radius = _checked(radius)
    occlusion = VisibilityBitmask(
        radius=radius,
        **_FILAMENT,
        n_sectors=32,
        weighting="angle",
        thickness=ConstantThickness(thickness=radius / 0.6, along="view"),
        sector_rounding="outward",
        arccosine="two_term",
        falloff=NoCut(),
    )
    return Pipeline(occlusion=occlusion, spatial=SpatialFilter(derivatives="none"))


def bevy(level: Level = "high", radius: float = 0.7285) -> Pipeline:
    """Bevy's visibility-bitmask ambient occlusion (bevyengine/bevy, ``ssao.wesl`` of August 2026).

    On frames that are not square Bevy also marches beside its slices: it scales image offsets by the width of the
    frame alone.

    Args:
        level: as for :func:`xegtao`; a slice has two sectors per step and side, 4 or 6.
        radius: in scene units. Occluders are 0.343 of it thick: 0.25 at the default radius.

    Raises:
        ConfigError: the level does not exist or the radius is not positive.
    """
    counts, radius = counts_of(level), _checked(radius)
    occlusion = VisibilityBitmask(
        radius=radius,
        **counts,
        n_sectors=2 * counts["n_steps"],
        slice_measure="screen_unnormalised",
        fetch="bilinear",
        step_exponent=2.0,
        step_law="offset",
        step_jitter="step",
        min_step_px=0.0,
        border="replicate",
        noise="hilbert_r2",
        pyramid=DepthPyramid(filter="harmonic"),
        # 1e-5 in reversed depth is a share of 1e-4 of the depth per metre of it; this is the share at a metre.
        depth_bias=1e-4,
        weighting="angle",
        thickness=ConstantThickness(thickness=radius * (0.25 / 0.7285), along="view"),
        sector_rounding="outward",
        arccosine="two_term",
        falloff=NoCut(),
        floor=0.03,
    )
    # One pass of XeGTAO's denoiser, with finer links and without its leak.
    return Pipeline(occlusion=occlusion, spatial=EdgeAwareFilter(quantised_edges=False, leak_strength=0.0))


def threejs(variant: Literal["node", "webgl"] = "node", radius: float = 0.25) -> Pipeline:
    """three.js: ``GTAONode`` for WebGPU (2026) or ``GTAOPass`` for WebGL, with 16 samples, three slices of six steps.

    Args:
        variant: "node" or "webgl".
        radius: in scene units. Samples farther away in depth than four of it are ignored: 1 at the default radius.

    Raises:
        ConfigError: the variant does not exist or the radius is not positive.
    """
    if variant not in ("node", "webgl"):
        raise ConfigError(f"variant must be 'node' or 'webgl', got {variant!r}")
    radius = _checked(radius)
    common: dict[str, Any] = {
        "radius": radius,
        "n_slices": 3,
        "n_steps": 6,
        "slice_measure": "screen",
        "snap_to_texel": False,
        "step_law": "beyond",
        "border": "replicate",
        "horizon_start": "tangent",
        # It decides whether a sample counts, which has no derivative.
        "thickness": DepthCut(depth=4 * plain(radius)),
        "ceiling": 1.0,
    }
    if variant == "node":
        falloff = QuadraticFalloff(end=radius, toward="horizon")
        # Blue noise from void and cluster in the node.
        return Pipeline(
            occlusion=GTAO(
                **common,
                fetch="nearest_of_four",
                step_exponent=2.0,
                step_jitter="pixel",
                noise="hilbert_r2",
                falloff=falloff,
            )
        )
    # Directions from a magic square of 5×5 pixels in the pass.
    occlusion = GTAO(**common, step_exponent=1.0, step_jitter="none", falloff=IndexFalloff(), length_blend=1.0)
    # GTAOPass has a filter of 16 taps on a disc of eight pixels that weighs by planes and normals.
    return Pipeline(occlusion=occlusion, spatial=PlaneAwareFilter(size=7, fit="constant"))
