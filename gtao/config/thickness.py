"""How thick occluders are, which a depth buffer does not know."""

from dataclasses import dataclass
from typing import Literal

from gtao.errors import ConfigError

from ._checks import check_choice, check_positive, check_share

__all__ = [
    "ConstantThickness",
    "ContinuityThickness",
    "DepthCut",
    "LinearThickness",
    "MeasuredThickness",
    "RunningThickness",
]

Along = Literal["ray", "view"]


@dataclass(frozen=True, kw_only=True)
class RunningThickness:
    """Horizons sink toward later samples that lie below them (Jimenez et al. 2016, Eq. 9, in cosines).

    H ← c ≥ H ? c : H + blend (c - H) along the march; theory, the thickness heuristic.

    Args:
        blend: share in [0, 1]; 0 is the plain maximum. The paper gives no value.
    """

    blend: float

    def __post_init__(self) -> None:
        check_share("thickness blend", self.blend)


@dataclass(frozen=True, kw_only=True)
class DepthCut:
    """A sample whose view depth differs from the shaded point's by ``depth`` scene units or more is ignored."""

    depth: float

    def __post_init__(self) -> None:
        check_positive("thickness depth", self.depth)


@dataclass(frozen=True, kw_only=True)
class ConstantThickness:
    """Every occluder is solid for ``thickness`` scene units behind its surface.

    Args:
        thickness: in scene units.
        along: the eye "ray" through the sample; or the "view" vector of the shaded point, as shaders have it, which
            shears what lies beside it.
    """

    thickness: float
    along: Along = "ray"

    def __post_init__(self) -> None:
        check_positive("thickness", self.thickness)
        check_choice("thickness along", self.along, Along)


@dataclass(frozen=True, kw_only=True)
class LinearThickness:
    """Occluders are ``slope`` times their distance from the eye thick: a constant width in the image."""

    slope: float

    def __post_init__(self) -> None:
        check_positive("thickness slope", self.slope)


@dataclass(frozen=True, kw_only=True)
class ContinuityThickness:
    """Thick where a surface goes on along the slice, thin where it appears anew.

    A sample whose view depth is within ``gap`` of the one before it on the march (of the shaded point, for the first)
    continues a surface and is solid for ``continuing`` scene units along its eye ray; one that leaps out of its
    neighbour's surroundings belongs to something narrow or to an edge, and is solid for ``isolated``. What is wide in
    the image is likely to be deep, too; ropes and leaves are neither.

    Args:
        continuing: thickness of continued surfaces in scene units.
        isolated: thickness of the others, at most ``continuing``.
        gap: greatest step in view depth within one surface, scene units.
    """

    continuing: float
    isolated: float
    gap: float

    def __post_init__(self) -> None:
        check_positive("thickness continuing", self.continuing)
        check_positive("thickness isolated", self.isolated)
        check_positive("thickness gap", self.gap)
        if self.isolated > self.continuing:
            raise ConfigError(
                f"isolated occluders are not thicker than continuing ones, got {self.isolated} > {self.continuing}"
            )


@dataclass(frozen=True, kw_only=True)
class MeasuredThickness:
    """Occluders are as thick as the frame's depth layers say (:func:`gtao.render.layers`), all layers counted."""
