"""What a slice method looked at and what it made of it, for one pixel, in plain numbers."""

from dataclasses import dataclass
from typing import Any

__all__ = ["InspectedSample", "InspectedSlice", "SliceInspection"]

Vector = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class InspectedSample:
    """One depth sample.

    Attributes:
        side: 0 toward -T, 1 toward +T.
        step: number of the step, from 0, outward.
        x, y: texel coordinates of the point that the depth is taken to belong to: columns and rows, whole numbers at
            texel centres. Off the frame where the border replicates.
        view_z: the depth read, in scene units along the optical axis; inf for the background.
        position_v: the point behind (x, y) at that depth, in the view frame; not finite for the background.
        distance: from the shaded point in scene units; inf for the background.
        cosine: of the direction from the shaded point to the sample with the zenith (the view vector, unless the method
            chose another); NaN where there is no direction.
        blocks: pairs (front, back) of cosines between which the sample alone blocks its side, the front the higher.
            Of horizon methods the front holds the falloff and the back is the tangent plane, or where the eye ray
            behind the sample leaves the sphere of the radius; of bitmasks each layer of the sample has a pair. Empty
            where it blocks nothing.
        horizon: cosine of the side's horizon after this sample; None for bitmasks.
        closes: sectors that were open before this sample and are closed after it; bitmasks only.
        wins: whether it is the one that the side's horizon stands on in the end; for bitmasks, whether it closed any
            sector.
    """

    side: int
    step: int
    x: float
    y: float
    view_z: float
    position_v: Vector
    distance: float
    cosine: float
    blocks: tuple[tuple[float, float], ...]
    horizon: float | None
    closes: tuple[int, ...]
    wins: bool


@dataclass(frozen=True, kw_only=True)
class InspectedSlice:
    """One slice.

    Attributes:
        index: its number, from 0.
        azimuth: angle φ about the zenith in radians, of the tangent T toward which side 1 lies; in the image where the
            slice measure is one of the screen.
        direction: unit vector in pixels, x right and y down, in which side 1 is marched; side 0 is the opposite.
        normal: components (n_V, n_T) of the normal in the slice.
        tangent: cosines of the tangent plane on sides 0 and 1: where horizons start.
        reach: lengths of the search on sides 0 and 1, in pixels.
        horizons: pairs (upper, lower) of cosines between which sides 0 and 1 are blocked in the end; lower is the
            tangent plane unless the slice is open again below. None for bitmasks.
        open_sectors: for each sector from side 0's tangent plane to side 1's whether it is open; None without.
        contribution: the slice's share of visibility: the estimate is the mean of these over slices.
        samples: what was read, outward, sides in turn.
    """

    index: int
    azimuth: float
    direction: tuple[float, float]
    normal: tuple[float, float]
    tangent: tuple[float, float]
    reach: tuple[float, float]
    horizons: tuple[tuple[float, float], tuple[float, float]] | None
    open_sectors: tuple[bool, ...] | None
    contribution: float
    samples: tuple[InspectedSample, ...]


@dataclass(frozen=True, kw_only=True)
class SliceInspection:
    """All slices of one pixel.

    Attributes:
        x, y: column and row.
        view_z: the pixel's depth in scene units.
        position_v: the shaded point in the view frame.
        normal_v: the unit normal of the frame there.
        zenith: unit vector that cosines are measured from.
        visibility: the method's estimate before power, floor and ceiling: the mean of the slices' contributions.
        slices: the slices.
        method: the configuration.
        frame_index: number of the frame.
    """

    x: int
    y: int
    view_z: float
    position_v: Vector
    normal_v: Vector
    zenith: Vector
    visibility: float
    slices: tuple[InspectedSlice, ...]
    method: Any
    frame_index: int
