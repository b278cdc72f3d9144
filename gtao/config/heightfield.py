"""The two ground truths of a depth buffer: what no method can know more about than from the depth buffer alone."""

import math
from dataclasses import dataclass
from typing import Any, Literal

from gtao.errors import ConfigError

from ._checks import check_choice, check_count, check_flag, check_number, check_positive
from .codec import to_dict

__all__ = ["HeightfieldHorizon", "HeightfieldRayMarch", "Reconstruction", "Weighting"]

Weighting = Literal["cosine", "uniform"]
Reconstruction = Literal["linear", "nearest"]

NODES_PER_WORD = 64


@dataclass(frozen=True, kw_only=True)
class _Heightfield:
    """Visibility on the height field of the depth buffer, solid behind its surface.

    A direction is blocked if matter lies on it within the radius. Outside of the frame and over background there is
    none.
    """

    radius: float = math.inf
    weighting: Weighting = "cosine"
    fetch: Reconstruction = "linear"
    bent_normal: bool = False
    directional: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        check_positive("radius", self.radius, infinite=True)
        check_choice("weighting", self.weighting, Weighting)
        check_choice("fetch", self.fetch, Reconstruction)
        check_flag("bent_normal", self.bent_normal)
        check_flag("directional", self.directional)
        check_count("seed", self.seed, 0, 2**32 - 1)

    def to_dict(self) -> dict[str, Any]:
        """Plain values that :func:`gtao.method_from_dict` turns back into the same configuration."""
        return to_dict(self)


@dataclass(frozen=True, kw_only=True)
class HeightfieldRayMarch(_Heightfield):
    """Brute force: random rays over the hemisphere of every pixel, marched over the depth buffer; not differentiable.

    Unbiased, with a ``variance`` of each pixel's mean (theory, eq. (77)), which is unbiased too but 0 where all rays
    agree: pool pixels before testing.

    Args:
        radius: reach of an occluder in scene units; ``inf`` for no limit.
        n_directions: azimuths about the normal, an even number from 2 to 1024; neighbours share a stratum.
        rays_per_direction: elevations per azimuth, 1 to 1024.
        n_steps: None follows every ray exactly, through every cell of the depth buffer that may block it. A number, 1
            to 4096, looks at that many jittered places, evenly spread over the ray's image within radius and frame:
            the cheap ray marching that horizons are compared with. It misses what lies between.
        weighting: "cosine" (diffuse visibility; theory, eq. (1)) or "uniform" (share of the open solid angle of the
            hemisphere; eq. (2)).
        fetch: the surface between texel centres: "linear" interpolates 1/z (z in parallel projection), which is exact
            on planes, and breaks at depth edges (theory, eqs. (30) and (31)); "nearest" makes every texel a block.
        bent_normal: also sum the open directions: ``mean_direction`` of the result. Unbiased, and exact in the open.
        directional: also sum their spherical harmonics of bands 0 to 2, ``visibility_sh`` of the result, and the mean
            direction with them.
        seed: selects the random numbers.

    Raises:
        ConfigError: a parameter is out of range.
    """

    n_directions: int = 8
    rays_per_direction: int = 4
    n_steps: int | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        check_count("n_directions", self.n_directions, 2, 1024)
        if self.n_directions % 2:
            raise ConfigError(f"n_directions must be even, two share a stratum, got {self.n_directions}")
        check_count("rays_per_direction", self.rays_per_direction, 1, 1024)
        if self.n_steps is not None:
            check_count("n_steps", self.n_steps, 1, 4096)


@dataclass(frozen=True, kw_only=True)
class HeightfieldHorizon(_Heightfield):
    """Dense slices about the view vector, every direction of a slice open or blocked by itself; not differentiable.

    The other way to the number that :class:`HeightfieldRayMarch` estimates. No arc is integrated in closed form, and
    any number of blocked arcs per slice is kept apart.

    Args:
        radius: reach of an occluder in scene units; ``inf`` for no limit.
        n_slices: slices per pixel, 1 to 4096, evenly about the view vector and rotated at random per pixel.
        n_nodes: directions per slice, a multiple of 64 up to 2048, evenly within the normal's hemisphere and moved at
            random from slice to slice. A direction stands for its surroundings.
        steps_per_pixel: from 1 to 64. At 1 a slice looks at the surface on both sides of every border of cells or
            texels that it crosses, and takes blocked angles to vary between the two no more than their ends do; above,
            no such step is longer than √2 / steps_per_pixel.
        weighting: "cosine" (diffuse visibility; theory, eq. (1)) or "uniform" (share of the open solid angle of the
            hemisphere; eq. (2)).
        fetch: the surface between texel centres: "linear" interpolates 1/z (z in parallel projection), which is exact
            on planes, and breaks at depth edges (theory, eqs. (30) and (31)); "nearest" makes every texel a block.
        bent_normal: also sum the open directions: ``mean_direction`` of the result, of the same nodes and weights as
            the visibility.
        directional: also sum their spherical harmonics of bands 0 to 2, ``visibility_sh`` of the result, and the mean
            direction with them.
        seed: selects the random numbers.

    Raises:
        ConfigError: a parameter is out of range.
    """

    n_slices: int = 32
    n_nodes: int = 64
    steps_per_pixel: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        check_count("n_slices", self.n_slices, 1, 4096)
        check_count("n_nodes", self.n_nodes, NODES_PER_WORD, 2048)
        if self.n_nodes % NODES_PER_WORD:
            raise ConfigError(f"n_nodes must be a multiple of {NODES_PER_WORD}, got {self.n_nodes}")
        if not 1 <= check_number("steps_per_pixel", self.steps_per_pixel) <= 64:
            raise ConfigError(f"steps_per_pixel must lie in [1, 64], got {self.steps_per_pixel!r}")
