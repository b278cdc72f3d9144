"""Methods of :func:`gtao.irradiance`: what stands for the visible directions of a pixel."""

from dataclasses import dataclass
from typing import Any, Literal

from ._checks import check_choice, check_count
from .codec import to_dict

__all__ = [
    "BentNormalIrradiance",
    "ClippedCone",
    "ConeSH",
    "MomentZH",
    "OcclusionTimesIrradiance",
    "SliceMoments",
    "TripleProduct",
]

Aperture = Literal["seed", "matched"]

#: Highest band that light may have, and that the methods with an ``order`` can use.
HIGHEST_BAND = 4


class _Banded:
    order: int

    def __post_init__(self) -> None:
        check_count("order", self.order, 0, HIGHEST_BAND)

    def to_dict(self) -> dict[str, Any]:
        """Plain values that :func:`gtao.method_from_dict` turns back into the same configuration."""
        return to_dict(self)


@dataclass(frozen=True, kw_only=True)
class SliceMoments(_Banded):
    """The estimate's own spherical harmonics of visibility times cosine: no shape is assumed of what is visible.

    Exact, for the horizons that were found, under light without bands above 2. Needs ``directional=True`` and cosine
    weighting.

    Args:
        order: highest band, 0 to 4; those of the light above it are ignored. Bands 3 and 4, which slices do not sum up,
            are guessed like those of :class:`MomentZH`.
    """

    order: int = 2


@dataclass(frozen=True, kw_only=True)
class MomentZH(_Banded):
    """A zonal function about the bent normal, from visibility and mean direction alone (theory, eq. (115)).

    Bands 0 and 1 are exact; those from 2 on are of the cone with the same ratio of the two. Needs ``bent_normal=True``
    and cosine weighting.

    Args:
        order: highest band, 0 to 4; those of the light above it are ignored.
    """

    order: int = 2


@dataclass(frozen=True, kw_only=True)
class ConeSH(_Banded):
    """Cone times cosine as one zonal function about the bent normal (ATVI-TR-19-01; theory, eq. (114)).

    Its band 0 is that of the visibility, its higher ones have the ratios of a cone about its own normal. Needs
    ``bent_normal=True``.

    Args:
        aperture: "seed" as published, cos α = √(1 - A), which takes the bent normal for the normal; or "matched", that
            of the cone about the bent normal that leaves the visibility A above the true tangent plane, at most a
            hemisphere. With uniform weighting there is only the seed, cos α = 1 - A, and band 0 is π sin² α.
        order: highest band, 0 to 4; those of the light above it are ignored.
    """

    aperture: Aperture = "seed"
    order: int = 2

    def __post_init__(self) -> None:
        check_choice("aperture", self.aperture, Aperture)
        super().__post_init__()


@dataclass(frozen=True, kw_only=True)
class ClippedCone(_Banded):
    """A cone about the bent normal times the cosine to the true normal, cut by its tangent plane, in closed form.

    Needs ``bent_normal=True``; theory, eq. (119).

    Args:
        aperture: "matched" leaves the visibility A above the tangent plane; "seed" is the published cos α = √(1 - A),
            which loses light: a whole cone keeps A cos β of it where the bent normal leans away by β. With uniform
            weighting there is only the seed, cos α = 1 - A, which keeps the solid angle of a whole cone.
        order: highest band, 0 to 4; those of the light above it are ignored.
    """

    aperture: Aperture = "matched"
    order: int = 2

    def __post_init__(self) -> None:
        check_choice("aperture", self.aperture, Aperture)
        super().__post_init__()


@dataclass(frozen=True, kw_only=True)
class TripleProduct(_Banded):
    """Light, a cone about the bent normal and the clamped cosine, each cut to the same bands (Snyder 2006).

    The cone has the seed aperture of :class:`ConeSH`. Theory, eq. (116); needs ``bent_normal=True``.

    Args:
        order: highest band of cone and cosine, 0 to 4; those of the light above it are ignored.
    """

    order: int = 2


@dataclass(frozen=True, kw_only=True)
class BentNormalIrradiance(_Banded):
    """Visibility times the irradiance of an open surface that faces along the bent normal (Landis 2002).

    Needs ``bent_normal=True``.

    Args:
        order: highest band, 0 to 4; those of the light above it are ignored.
    """

    order: int = 2


@dataclass(frozen=True, kw_only=True)
class OcclusionTimesIrradiance(_Banded):
    """Visibility times the irradiance of an open surface: what ambient occlusion without directions can do.

    Args:
        order: highest band, 0 to 4; those of the light above it are ignored.
    """

    order: int = 2
