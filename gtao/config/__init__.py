"""Strategy objects: frozen, keyword-only, validated when they are made.

Static parameters (counts, switches) specialise the kernel; lengths, blends and seeds reach it as values and change
without recompiling.
"""

from typing import Any

from ._checks import plain
from .bitmask import VisibilityBitmask
from .codec import from_dict, register
from .deviations import Deviation, deviations, faithful
from .falloff import IndexFalloff, LinearFalloff, NoCut, QuadraticFalloff, SampleCut
from .filters import EdgeAwareFilter, PlaneAwareFilter, SpatialFilter
from .gtao import GTAO
from .hbao import HBAO
from .heightfield import HeightfieldHorizon, HeightfieldRayMarch
from .lighting import (
    BentNormalIrradiance,
    ClippedCone,
    ConeSH,
    MomentZH,
    OcclusionTimesIrradiance,
    SliceMoments,
    TripleProduct,
)
from .named import NAMED, NamedMethod, named, with_budget
from .pipeline import Pipeline
from .pyramid import DepthPyramid
from .resolution import BilateralUpsample, BilinearUpsample, Downsample, NearestDepthUpsample, PlaneAwareUpsample
from .slices import SliceMethod
from .specular import ConeBRDF, ConeCone, ConeLobe, ConeTable, Lagarde2014, VisibilityAsSpecular
from .temporal import TemporalFilter
from .thickness import (
    ConstantThickness,
    ContinuityThickness,
    DepthCut,
    LinearThickness,
    MeasuredThickness,
    RunningThickness,
)

__all__ = [
    "GTAO",
    "HBAO",
    "NAMED",
    "BentNormalIrradiance",
    "BilateralUpsample",
    "BilinearUpsample",
    "ClippedCone",
    "ConeBRDF",
    "ConeCone",
    "ConeLobe",
    "ConeSH",
    "ConeTable",
    "ConstantThickness",
    "ContinuityThickness",
    "DepthCut",
    "DepthPyramid",
    "Deviation",
    "Downsample",
    "EdgeAwareFilter",
    "HeightfieldHorizon",
    "HeightfieldRayMarch",
    "IndexFalloff",
    "Lagarde2014",
    "LinearFalloff",
    "LinearThickness",
    "MeasuredThickness",
    "MomentZH",
    "NamedMethod",
    "NearestDepthUpsample",
    "NoCut",
    "OcclusionTimesIrradiance",
    "Pipeline",
    "PlaneAwareFilter",
    "PlaneAwareUpsample",
    "QuadraticFalloff",
    "RunningThickness",
    "SampleCut",
    "SliceMethod",
    "SliceMoments",
    "SpatialFilter",
    "TemporalFilter",
    "TripleProduct",
    "VisibilityAsSpecular",
    "VisibilityBitmask",
    "deviations",
    "faithful",
    "method_from_dict",
    "named",
    "plain",
    "with_budget",
]

register(GTAO, HBAO, VisibilityBitmask, HeightfieldRayMarch, HeightfieldHorizon, Pipeline)
register(LinearFalloff, QuadraticFalloff, IndexFalloff, SampleCut, NoCut)
register(RunningThickness, DepthCut, ConstantThickness, ContinuityThickness, LinearThickness, MeasuredThickness)
register(EdgeAwareFilter, SpatialFilter, PlaneAwareFilter)
register(TemporalFilter)
register(DepthPyramid)
register(Downsample, BilinearUpsample, NearestDepthUpsample, BilateralUpsample, PlaneAwareUpsample)
register(SliceMoments, MomentZH, ConeSH, ClippedCone, TripleProduct, BentNormalIrradiance, OcclusionTimesIrradiance)
register(ConeTable, ConeCone, ConeLobe, ConeBRDF, Lagarde2014, VisibilityAsSpecular)


def method_from_dict(data: dict[str, Any]) -> Any:
    """The configuration that its ``to_dict`` described; without a "type" it is a :class:`GTAO`.

    Raises:
        ConfigError: the type is unknown, a name does not exist or a value is out of range.
    """
    return from_dict(data, "GTAO")
