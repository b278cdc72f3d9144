"""Estimating at a part of the resolution: how a frame is made smaller, and its estimate large again."""

import math
from dataclasses import dataclass
from typing import Any, Literal

from gtao.errors import ConfigError

from ._checks import check_choice, check_number, check_positive
from .codec import to_dict

__all__ = ["BilateralUpsample", "BilinearUpsample", "Downsample", "NearestDepthUpsample", "PlaneAwareUpsample"]

Choice = Literal["nearest", "farthest", "checkerboard", "first"]
Place = Literal["texel", "centre"]
FACTORS = (2, 4)


@dataclass(frozen=True, kw_only=True)
class Downsample:
    """A frame of a half or a quarter of the width and height: one of its pixels stands for each block of them.

    The defaults lose least on embedded scenes (docs/resolution); the slides take the nearest and its own depth.

    Args:
        factor: 2 or 4.
        choice: the surface pixel of a block that stands for it: the "nearest", as the slides have it (Jimenez et al.
            2016), the "farthest", either in turn ("checkerboard": the nearest where column plus row is even), or the
            "first", row by row from the top left.
        place: "texel" keeps the pixel's depth although the block's centre lies elsewhere, as is common; "centre"
            moves it along its tangent plane to there, so that planes stay planes (theory, eq. (183)).
    """

    factor: int = 2
    choice: Choice = "checkerboard"
    place: Place = "centre"

    def __post_init__(self) -> None:
        if isinstance(self.factor, bool) or not isinstance(self.factor, int) or self.factor not in FACTORS:
            raise ConfigError(f"factor must be 2 or 4, got {self.factor!r}")
        check_choice("choice", self.choice, Choice)
        check_choice("place", self.place, Place)

    def to_dict(self) -> dict[str, Any]:
        """Plain values that :func:`gtao.method_from_dict` turns back into the same configuration."""
        return to_dict(self)


@dataclass(frozen=True, kw_only=True)
class BilinearUpsample:
    """The mean of the 2×2 texels around a pixel by distance in the image alone; it blurs across depth edges."""

    def to_dict(self) -> dict[str, Any]:
        """Plain values that :func:`gtao.method_from_dict` turns back into the same configuration."""
        return to_dict(self)


@dataclass(frozen=True, kw_only=True)
class NearestDepthUpsample:
    """Bilinear where the 2×2 texels around a pixel are as deep as it, elsewhere the texel nearest in depth alone.

    Args:
        threshold: difference of depth, as a share of the pixel's, from which a texel is of another surface. It decides
            between two values, and has no derivative.
    """

    threshold: float = 0.02

    def __post_init__(self) -> None:
        check_positive("threshold", self.threshold)

    def to_dict(self) -> dict[str, Any]:
        """Plain values that :func:`gtao.method_from_dict` turns back into the same configuration."""
        return to_dict(self)


@dataclass(frozen=True, kw_only=True)
class BilateralUpsample:
    """Bilinear weights of the 2×2 texels around a pixel times 1 / (1 + (d / threshold)⁴), d by depth.

    Theory, eq. (184). Where no texel is as deep as the pixel, the nearest in depth dominates: no weight is ever zero.

    Args:
        threshold: difference of depth, as a share of the pixel's, that halves a weight.
    """

    threshold: float = 0.02

    def __post_init__(self) -> None:
        check_positive("threshold", self.threshold)

    def to_dict(self) -> dict[str, Any]:
        """Plain values that :func:`gtao.method_from_dict` turns back into the same configuration."""
        return to_dict(self)


@dataclass(frozen=True, kw_only=True)
class PlaneAwareUpsample:
    """Bilinear weights of the 2×2 texels around a pixel times 1 / (1 + (d / tolerance)⁴ + e²), by tangent planes.

    Theory, eqs. (184) to (186). d is the larger of a texel's distance from the pixel's tangent plane and of the
    pixel's from the texel's, e grows with the angle between the normals. Planes at any tilt are interpolated
    bilinearly, and nothing crosses a depth edge. A pixel whose surface is not among its 2×2 texels takes the texel of
    the 4×4 around it that is nearest in this sense.

    Args:
        tolerance: distance that halves a weight, in widths of a small pixel at that depth.
        angle: between the normals, in radians up to π, that halves a weight.
    """

    tolerance: float = 0.5
    angle: float = 0.5

    def __post_init__(self) -> None:
        check_positive("tolerance", self.tolerance)
        if not 0 < check_number("angle", self.angle) <= math.pi:
            raise ConfigError(f"angle must lie in (0, pi], got {self.angle!r}")

    def to_dict(self) -> dict[str, Any]:
        """Plain values that :func:`gtao.method_from_dict` turns back into the same configuration."""
        return to_dict(self)
