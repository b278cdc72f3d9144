"""GTAO: horizons of slices, integrated in closed form."""

import math
from dataclasses import dataclass
from typing import Any, Literal

from gtao.errors import ConfigError

from ._checks import (
    check_ceiling,
    check_choice,
    check_count,
    check_flag,
    check_instance,
    check_positive,
    check_share,
    plain,
)
from .falloff import Falloff, IndexFalloff, LinearFalloff, NoCut, QuadraticFalloff, SampleCut
from .slices import Arccosine, SliceMethod, with_slice_arguments
from .thickness import DepthCut, RunningThickness

__all__ = ["GTAO", "Weighting"]

Weighting = Literal["cosine", "uniform"]
BentNormal = bool | Literal["average_horizon"]
HorizonStart = Literal["nadir", "tangent"]

#: Lowest temperature of soft horizons: differences of cosines are known to about a tenth of it.
COLDEST = 1e-6


@with_slice_arguments
@dataclass(frozen=True, kw_only=True)
class GTAO(SliceMethod):
    """Ground-truth ambient occlusion (Jimenez et al. 2016): horizons of vertical slices, integrated in closed form.

    The defaults estimate the integral as it is defined; what the papers or engines do otherwise is an option.

    Args:
        n_slices: slices per pixel, 1 to 1024.
        weighting: "cosine" (diffuse visibility; theory, eq. (1)) or "uniform" (share of the open solid angle of the
            hemisphere; eq. (2)).
        falloff: attenuation in place of the sharp cut at the radius: :class:`gtao.LinearFalloff`,
            :class:`gtao.QuadraticFalloff`, :class:`gtao.IndexFalloff`, :class:`gtao.SampleCut` or
            :class:`gtao.NoCut`. Its end must not exceed the radius and the search radius.
        horizon_start: horizon before the first sample: -1 ("nadir"), or the "tangent" plane. It matters only where
            samples move the horizon by a share, that is with a falloff toward the horizon or a running thickness.
        thickness: heuristic for thin occluders: :class:`gtao.RunningThickness` or :class:`gtao.DepthCut`. It needs a
            falloff, because the exact cut already says how far behind a sample matter is solid.
        thin_occluder_compensation: the falloff measures distances with depth stretched by 1 plus this.
        length_blend: share in [0, 1] by which the length of the projected normal is moved to 1. XeGTAO takes 5 %,
            shaders that leave the length out take all.
        arccosine: "exact", or what shaders compute instead: one of two terms, or the same with the square root made
            of the bits of its argument (:func:`gtao.kernels.arcs.fast_acos`). Cosine weighting only.
        small_radius_fade: where the search is shorter than ten pixels the slices' sum grows with what is lacking, by
            0.05 at most, as in XeGTAO.
        soft_horizon: temperature τ, in units of cosines, of a smooth maximum over the samples of a side: the mean of
            their cosines and the tangent plane's with weights exp(c/τ) (theory, eq. (91)). All samples above the
            tangent plane then have gradients, not the highest alone; for gradients n_steps may be 32 at most. The
            horizon lies below the highest sample by at most 1.04 τ with 8 steps and 1.85 τ with 32 (eq. (92)), so
            that visibility is up to twice that too high: in the mean of four test scenes by 0.016 at τ = 0.1, 0.004 at
            0.03 and 0.0006 at 0.01. An open plane stays exact. None is the maximum itself.
        bent_normal: also give the mean unoccluded direction of every pixel: its closed form (ATVI-TR-19-01; theory, eq.
            (124)), or with "average_horizon" the slides' approximation, the directions halfway between the horizons
            (eq. (54)): a baseline that leans to the viewer, and whose length means nothing.
        directional: also give the visibility of every pixel in spherical harmonics of bands 0 to 2, exact for the
            horizons that were found (eq. (112)), and the bent normal with it.
        power: the result is raised to this power, which has no physical meaning; 1 leaves it alone.
        floor: smallest result, in [0, 1].
        ceiling: largest result, at least 1; with few slices single pixels exceed 1, and come out right in the mean.
    """

    n_slices: int = 4
    weighting: Weighting = "cosine"
    falloff: Falloff | None = None
    horizon_start: HorizonStart = "nadir"
    thickness: RunningThickness | DepthCut | None = None
    thin_occluder_compensation: float = 0.0
    length_blend: float = 0.0
    arccosine: Arccosine = "exact"
    small_radius_fade: bool = False
    soft_horizon: float | None = None
    bent_normal: BentNormal = False
    directional: bool = False
    power: float = 1.0
    floor: float = 0.0
    ceiling: float = math.inf

    def __post_init__(self) -> None:
        super().__post_init__()
        check_count("n_slices", self.n_slices, 1, 1024)
        check_choice("weighting", self.weighting, Weighting)
        check_instance("falloff", self.falloff, (LinearFalloff, QuadraticFalloff, IndexFalloff, SampleCut, NoCut))
        self._check_falloff(self.falloff)
        check_instance("thickness", self.thickness, (RunningThickness, DepthCut))
        self._check_exact_cut()
        check_share("thin_occluder_compensation", self.thin_occluder_compensation, high=10.0)
        check_choice("horizon_start", self.horizon_start, HorizonStart)
        check_share("length_blend", self.length_blend)
        check_choice("arccosine", self.arccosine, Arccosine)
        if self.arccosine != "exact" and self.weighting == "uniform":
            raise ConfigError("uniform weighting needs no arc cosine; leave arccosine at 'exact'")
        check_flag("small_radius_fade", self.small_radius_fade)
        self._check_soft_horizon()
        self._check_directions()
        check_positive("power", self.power)
        check_share("floor", self.floor)
        check_ceiling(self.ceiling)

    def _check_exact_cut(self) -> None:
        if self.falloff is not None or math.isinf(plain(self.radius)):
            return
        for name, on in (
            ("thickness", self.thickness is not None),
            ("thin_occluder_compensation", self.thin_occluder_compensation > 0),
            ("zenith='optical_axis'", self.zenith == "optical_axis"),
        ):
            if on:
                raise ConfigError(
                    f"{name} needs a falloff: without one a finite radius cuts matter exactly, which leaves no room for"
                    " it; give falloff=NoCut() or another"
                )

    def _check_soft_horizon(self) -> None:
        if self.soft_horizon is None:
            return
        check_positive("soft_horizon", self.soft_horizon)
        if plain(self.soft_horizon) < COLDEST:
            raise ConfigError(
                f"soft_horizon must be at least {COLDEST:g}, got {plain(self.soft_horizon):g}: cosines in single"
                " precision are not known better; leave it out for the maximum itself"
            )
        for name, on in (
            ("RunningThickness", isinstance(self.thickness, RunningThickness)),
            ("IndexFalloff", isinstance(self.falloff, IndexFalloff)),
            ("a falloff toward the horizon", getattr(self.falloff, "toward", None) == "horizon"),
        ):
            if on:
                raise ConfigError(
                    f"soft_horizon is a smooth maximum of samples, and {name} makes horizons depend on their order;"
                    " give one or the other"
                )

    def _check_directions(self) -> None:
        check_flag("directional", self.directional)
        if self.bent_normal != "average_horizon" and not isinstance(self.bent_normal, bool):
            raise ConfigError(f"bent_normal must be True, False or 'average_horizon', got {self.bent_normal!r}")
        if self.directional and self.bent_normal == "average_horizon":
            raise ConfigError("directional=True gives the bent normal of the same moments; leave bent_normal out")

    @classmethod
    def xegtao(cls, level: str = "high", radius: float = 0.5) -> "GTAO":
        """What XeGTAO computes before its denoiser; see :func:`gtao.config.engines.xegtao`.

        Args:
            level: "low", "medium", "high" or "ultra".
            radius: effect radius in scene units.
        """
        from .engines import xegtao

        return xegtao(level, radius).occlusion

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
