"""Spatial filters for :func:`gtao.denoise`."""

from dataclasses import dataclass
from typing import Any, Literal

from gtao.errors import ConfigError

from ._checks import check_choice, check_count, check_flag, check_number, check_positive, check_share
from .codec import to_dict

__all__ = ["EdgeAwareFilter", "PlaneAwareFilter", "SpatialFilter"]

Derivatives = Literal["none", "first", "second"]
Fit = Literal["constant", "linear"]


@dataclass(frozen=True, kw_only=True)
class EdgeAwareFilter:
    """XeGTAO's denoiser (Strugar and Mccalla 2021): 3×3 averages across links that depth leaves open.

    The defaults are XeGTAO's. Otherwise than there, values stay in floating point between passes (XeGTAO stores
    8 bits, of values up to 1.5: ``ceiling`` of :class:`gtao.GTAO`), and the background, which is excluded from every
    average, does not leak into isolated pixels.

    Args:
        passes: how often the filter is applied, 1 ("sharp") to 8; XeGTAO offers up to 3 ("soft").
        beta: weight of the pixel itself in the last pass, against 1 of a neighbour with an open link; earlier passes
            use a fifth of it.
        edge_threshold: step of depth that closes a link, as a share of the depth, beyond what the slope explains.
        quantised_edges: round links to four levels, which two bits store.
        diagonal_weight: weight of a diagonal neighbour, per open way of two links to it.
        leak_threshold: number of closed links, of four, beyond which a pixel is averaged with its neighbours all the
            same, in [0, 4).
        leak_strength: how much: added to each link when all four are closed, in [0, 1].
    """

    passes: int = 1
    beta: float = 1.2
    edge_threshold: float = 0.011
    quantised_edges: bool = True
    diagonal_weight: float = 0.425
    leak_threshold: float = 2.5
    leak_strength: float = 0.5

    def __post_init__(self) -> None:
        check_count("passes", self.passes, 1, 8)
        check_positive("beta", self.beta)
        check_positive("edge_threshold", self.edge_threshold)
        check_flag("quantised_edges", self.quantised_edges)
        if not 0 <= check_number("diagonal_weight", self.diagonal_weight) <= 10:
            raise ConfigError(f"diagonal_weight must lie in [0, 10], got {self.diagonal_weight}")
        if not 0 <= check_number("leak_threshold", self.leak_threshold) < 4:
            raise ConfigError(f"leak_threshold must lie in [0, 4), got {self.leak_threshold}")
        check_share("leak_strength", self.leak_strength)

    def to_dict(self) -> dict[str, Any]:
        """Plain values that :func:`gtao.method_from_dict` turns back into the same configuration."""
        return to_dict(self)


@dataclass(frozen=True, kw_only=True)
class SpatialFilter:
    """The slides' 4×4 bilateral filter (Jimenez et al. 2016), which averages one period of their noise pattern.

    A tap at depth z weighs max(0, 1 - |z - ẑ| / (threshold · z_c)), with ẑ the depth predicted from the pixel's z_c
    by its derivatives. The slides do not say how they estimate these: here, per axis, from the side where depth
    changes less. The footprint lies from one texel before to two after the pixel on even frames and from two before
    to one after on odd ones: the image moves by half a pixel, back and forth.

    Args:
        threshold: difference from the predicted depth, as a share of the depth, from which a tap counts nothing.
        derivatives: "first" follows slopes, "second" their change too; "none" takes every slope for an edge.
        planar: take the derivatives of 1 / depth instead, in perspective. Planes are linear in it, so that the first
            ones predict them exactly at any tilt; not in the slides.
    """

    threshold: float = 0.1
    derivatives: Derivatives = "second"
    planar: bool = False

    def __post_init__(self) -> None:
        check_positive("threshold", self.threshold)
        check_choice("derivatives", self.derivatives, Derivatives)
        check_flag("planar", self.planar)
        if self.planar and self.derivatives == "none":
            raise ConfigError("planar says what derivatives are of; choose derivatives='first' or leave it out")

    def to_dict(self) -> dict[str, Any]:
        """Plain values that :func:`gtao.method_from_dict` turns back into the same configuration."""
        return to_dict(self)


@dataclass(frozen=True, kw_only=True)
class PlaneAwareFilter:
    """An average over the surface around a pixel: taps weigh by their distance from each other's tangent planes.

    A tap at distance d (the larger of its distance from the pixel's tangent plane and of the pixel's from the tap's)
    weighs max(0, 1 - d / (tolerance · pixel width)). Planes at any tilt are therefore averaged in full, and nothing
    crosses a depth edge or a crease.

    Args:
        size: of the footprint in texels, 2 to 16. An odd size spans size - 1 texels, its outermost counting half: 5
            averages one period of the 4×4 noise pattern like 4 does, but symmetrically. An even one lies on one side
            on even frames and on the other on odd ones.
        tolerance: in pixel widths at the pixel's depth.
        fit: "linear" takes the value at the pixel of a plane fitted to the taps, which does not blur gradients of
            visibility; "constant" their mean.
    """

    size: int = 5
    tolerance: float = 0.5
    fit: Fit = "linear"

    def __post_init__(self) -> None:
        check_count("size", self.size, 2, 16)
        check_positive("tolerance", self.tolerance)
        check_choice("fit", self.fit, Fit)

    def to_dict(self) -> dict[str, Any]:
        """Plain values that :func:`gtao.method_from_dict` turns back into the same configuration."""
        return to_dict(self)
