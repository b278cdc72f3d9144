"""The visibility bitmask: several blocked arcs per slice."""

import math
from dataclasses import dataclass
from typing import Literal, get_args

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
from .falloff import NoCut, SampleCut
from .slices import Arccosine, SliceMethod, with_slice_arguments
from .thickness import ConstantThickness, ContinuityThickness, LinearThickness, MeasuredThickness

__all__ = ["Mapping", "Rounding", "VisibilityBitmask"]

Mapping = Literal["cosine", "uniform", "angle"]
Thickness = ConstantThickness | ContinuityThickness | LinearThickness | MeasuredThickness
Rounding = Literal["jittered", "outward", "nearest"]


@with_slice_arguments
@dataclass(frozen=True, kw_only=True)
class VisibilityBitmask(SliceMethod):
    """Screen-space visibility bitmask (Therrien et al. 2023): samples close the sectors of a slice.

    Args:
        n_slices: slices per pixel, 1 to 1024.
        n_sectors: sectors of a slice's hemisphere, 4 to 128.
        weighting: what sectors of equal size hold equal amounts of: "cosine" (diffuse visibility), "uniform" (solid
            angle), or "angle" (the original, neither of the two).
        thickness: :class:`gtao.ConstantThickness`, :class:`gtao.ContinuityThickness`,
            :class:`gtao.LinearThickness`, :class:`gtao.MeasuredThickness` (the frame's depth layers), or None: solid
            without end.
        sector_rounding: "jittered" by one number per slice, unbiased; "outward" (the original) closes every sector
            that a sample touches; "nearest" rounds.
        arccosine: how angles are found, as for :class:`gtao.GTAO`; with the weighting "angle" only.
        linked: whether occluders of two samples in a row that overlap in depth, or nearly so, are one body that also
            blocks what lies between them; samples stand alone in the original. None links them with
            :class:`gtao.MeasuredThickness` only, whose sheets block nothing otherwise.
        falloff: :class:`gtao.SampleCut` or :class:`gtao.NoCut` in place of the exact cut at the radius.
        bent_normal: also give the mean unoccluded direction of every pixel, that of the open sectors (theory, eq.
            (147)). Weightings "cosine" and "uniform" only, and not with ``zenith="optical_axis"``.
        directional: also give the visibility of every pixel in spherical harmonics of bands 0 to 2, exact for the open
            sectors, and the bent normal with it. As for ``bent_normal``.
        power, floor, ceiling: as for :class:`gtao.GTAO`.
    """

    n_slices: int = 4
    n_sectors: int = 32
    weighting: Mapping = "cosine"
    thickness: Thickness | None = None
    sector_rounding: Rounding = "jittered"
    linked: bool | None = None
    arccosine: Arccosine = "exact"
    falloff: SampleCut | NoCut | None = None
    bent_normal: bool = False
    directional: bool = False
    power: float = 1.0
    floor: float = 0.0
    ceiling: float = math.inf

    def __post_init__(self) -> None:
        super().__post_init__()
        check_count("n_slices", self.n_slices, 1, 1024)
        check_count("n_sectors", self.n_sectors, 4, 128)
        if self.n_sectors > 32 and self.n_sectors % 32:
            raise ConfigError(f"n_sectors above 32 must be a multiple of 32, got {self.n_sectors}")
        check_choice("weighting", self.weighting, Mapping)
        check_instance("thickness", self.thickness, get_args(Thickness))
        check_choice("sector_rounding", self.sector_rounding, Rounding)
        if self.linked is not None:
            check_flag("linked", self.linked)
        check_choice("arccosine", self.arccosine, Arccosine)
        if self.arccosine != "exact" and self.weighting != "angle":
            raise ConfigError(f"arccosine {self.arccosine!r} needs weighting 'angle', got {self.weighting!r}")
        check_instance("falloff", self.falloff, (SampleCut, NoCut))
        self._check_falloff(self.falloff)
        if self.zenith == "optical_axis" and self.falloff is None and not math.isinf(plain(self.radius)):
            raise ConfigError(
                "zenith='optical_axis' needs a falloff: the exact cut at a radius needs slices about the view vector;"
                " give falloff=NoCut() or SampleCut"
            )
        self._check_directions()
        check_positive("power", self.power)
        check_share("floor", self.floor)
        check_ceiling(self.ceiling)

    def _check_directions(self) -> None:
        for name in ("bent_normal", "directional"):
            check_flag(name, getattr(self, name))
            if not getattr(self, name):
                continue
            if self.weighting == "angle":
                raise ConfigError(
                    f"{name} is an integral over solid angle, which weighting 'angle' does not measure; choose 'cosine'"
                    " or 'uniform'"
                )
            if self.zenith == "optical_axis":
                raise ConfigError(
                    f"{name} needs slices about the view vector, whose sectors end where the tangent plane does; leave"
                    " zenith at 'view'"
                )
