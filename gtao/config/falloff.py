"""What far occluders count: attenuations in place of the exact cut at the radius."""

from dataclasses import dataclass
from typing import Literal

from gtao.errors import ConfigError

from ._checks import check_choice, check_number, check_positive, check_share

__all__ = ["Falloff", "IndexFalloff", "LinearFalloff", "NoCut", "QuadraticFalloff", "SampleCut"]

Toward = Literal["tangent", "nadir", "horizon"]


@dataclass(frozen=True, kw_only=True)
class LinearFalloff:
    """Attenuation of far occluders, linear in world distance.

    The weight of a sample at distance d is clamp((end - d) / (end - start), 0, 1); it moves the sample's horizon
    cosine toward the tangent plane of its side (theory, eq. (29)).

    Args:
        start: distance in scene units up to which a sample counts in full.
        end: distance from which it no longer counts.
        toward: cosine at weight 0: that of the "tangent" plane; -1, straight away from the viewer ("nadir"); or the
            "horizon" of the samples before, which a sample above it raises by the share w only (theory, eq. (65)).
    """

    start: float
    end: float
    toward: Toward = "tangent"

    def __post_init__(self) -> None:
        check_positive("falloff end", self.end)
        if not 0 <= check_number("falloff start", self.start) < self.end:
            raise ConfigError(f"falloff needs 0 <= start < end, got start={self.start}, end={self.end}")
        check_choice("falloff toward", self.toward, Toward)


@dataclass(frozen=True, kw_only=True)
class QuadraticFalloff:
    """Attenuation of far occluders by the square of world distance.

    The weight of a sample at distance d is clamp(1 - strength · (d / end)², 0, 1).

    Args:
        end: distance in scene units; with strength 1 a sample no longer counts from there.
        strength: factor of the square, positive.
        toward: cosine at weight 0, as for :class:`LinearFalloff`.
    """

    end: float
    strength: float = 1.0
    toward: Toward = "tangent"

    def __post_init__(self) -> None:
        check_positive("falloff end", self.end)
        check_positive("falloff strength", self.strength)
        check_choice("falloff toward", self.toward, Toward)


@dataclass(frozen=True, kw_only=True)
class IndexFalloff:
    """Attenuation by the number of the step, whatever its distance; the horizon rises by the share of the weight.

    The weight of step j = 0, 1, … is 1 + strength · (2/(j + 2) - 1): 1, 2/3, 1/2, … at strength 1.

    Args:
        strength: share in [0, 1].
    """

    strength: float = 1.0

    def __post_init__(self) -> None:
        check_share("falloff strength", self.strength)


@dataclass(frozen=True, kw_only=True)
class SampleCut:
    """A sample farther than ``end`` (scene units) is ignored, a nearer one counts in full.

    What HBAO does (Bavoil et al. 2008). The part within the radius of matter whose surface lies outside is lost.
    """

    end: float

    def __post_init__(self) -> None:
        check_positive("falloff end", self.end)


@dataclass(frozen=True, kw_only=True)
class NoCut:
    """Every sample on the marched segment counts in full, however far it is in depth: halos around foreground."""


Falloff = LinearFalloff | QuadraticFalloff | IndexFalloff | SampleCut | NoCut
