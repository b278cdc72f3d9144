"""Ambient occlusion that is right and can prove it.

The names below are the public core. The rooms ``gtao.render`` (ground truth with Mitsuba), ``gtao.io``, ``gtao.fit``,
``gtao.evaluate``, ``gtao.lighting`` (environment maps, spherical harmonics), ``gtao.plot``, ``gtao.interop`` (PyTorch,
JAX), ``gtao.tables`` (tables of specular occlusion), ``gtao.noise`` (masks, spectra and the errors that noise leaves)
and ``gtao.workflows`` load when they are first used, so that ``import gtao`` needs neither Mitsuba nor the scientific
stack.
"""

import importlib
from typing import Any

from . import backend as backend  # settles the LLVM library: must come before anything that imports Dr.Jit
from ._version import __version__
from .camera import OrthographicCamera, PerspectiveCamera, camera_from_dict
from .config import (
    GTAO,
    HBAO,
    BentNormalIrradiance,
    BilateralUpsample,
    BilinearUpsample,
    ClippedCone,
    ConeBRDF,
    ConeCone,
    ConeLobe,
    ConeSH,
    ConeTable,
    ConstantThickness,
    ContinuityThickness,
    DepthCut,
    DepthPyramid,
    Downsample,
    EdgeAwareFilter,
    HeightfieldHorizon,
    HeightfieldRayMarch,
    IndexFalloff,
    Lagarde2014,
    LinearFalloff,
    LinearThickness,
    MeasuredThickness,
    MomentZH,
    NearestDepthUpsample,
    NoCut,
    OcclusionTimesIrradiance,
    Pipeline,
    PlaneAwareFilter,
    PlaneAwareUpsample,
    QuadraticFalloff,
    RunningThickness,
    SampleCut,
    SliceMoments,
    SpatialFilter,
    TemporalFilter,
    TripleProduct,
    VisibilityAsSpecular,
    VisibilityBitmask,
    method_from_dict,
)
from .data import JIMENEZ2016, REFIT_2026_11, SPHERE, MultibounceFit
from .errors import (
    BackendError,
    ConfigError,
    FitError,
    GtaoError,
    ImageError,
    RecordError,
    SceneError,
    ShapeError,
)
from .estimators import (
    FilterWeights,
    InspectedSample,
    InspectedSlice,
    SliceInspection,
    ValueAndGradient,
    ambient_occlusion,
    camera_motion,
    denoise,
    diffuse_radiance,
    downsample,
    environment_brdf,
    filter_weights,
    inspect_slices,
    irradiance,
    multibounce,
    reflected_directions,
    shade,
    specular_occlusion,
    specular_radiance,
    specular_reflectance,
    upsample,
    value_and_gradient,
)
from .gbuffer import GBuffer
from .history import History
from .layers import DepthLayers
from .results import AmbientOcclusion, Stages

__all__ = [
    "GTAO",
    "HBAO",
    "JIMENEZ2016",
    "REFIT_2026_11",
    "SPHERE",
    "AmbientOcclusion",
    "BackendError",
    "BentNormalIrradiance",
    "BilateralUpsample",
    "BilinearUpsample",
    "ClippedCone",
    "ConeBRDF",
    "ConeCone",
    "ConeLobe",
    "ConeSH",
    "ConeTable",
    "ConfigError",
    "ConstantThickness",
    "ContinuityThickness",
    "DepthCut",
    "DepthLayers",
    "DepthPyramid",
    "Downsample",
    "EdgeAwareFilter",
    "FilterWeights",
    "FitError",
    "GBuffer",
    "GtaoError",
    "HeightfieldHorizon",
    "HeightfieldRayMarch",
    "History",
    "ImageError",
    "IndexFalloff",
    "InspectedSample",
    "InspectedSlice",
    "Lagarde2014",
    "LinearFalloff",
    "LinearThickness",
    "MeasuredThickness",
    "MomentZH",
    "MultibounceFit",
    "NearestDepthUpsample",
    "NoCut",
    "OcclusionTimesIrradiance",
    "OrthographicCamera",
    "PerspectiveCamera",
    "Pipeline",
    "PlaneAwareFilter",
    "PlaneAwareUpsample",
    "QuadraticFalloff",
    "RecordError",
    "RunningThickness",
    "SampleCut",
    "SceneError",
    "ShapeError",
    "SliceInspection",
    "SliceMoments",
    "SpatialFilter",
    "Stages",
    "TemporalFilter",
    "TripleProduct",
    "ValueAndGradient",
    "VisibilityAsSpecular",
    "VisibilityBitmask",
    "__version__",
    "ambient_occlusion",
    "backend",
    "camera_from_dict",
    "camera_motion",
    "denoise",
    "diffuse_radiance",
    "downsample",
    "environment_brdf",
    "filter_weights",
    "inspect_slices",
    "irradiance",
    "method_from_dict",
    "multibounce",
    "reflected_directions",
    "shade",
    "specular_occlusion",
    "specular_radiance",
    "specular_reflectance",
    "upsample",
    "value_and_gradient",
]

_ROOMS = ("evaluate", "fit", "interop", "io", "lighting", "noise", "plot", "render", "tables", "workflows")


def __getattr__(name: str) -> Any:
    if name in _ROOMS:
        return importlib.import_module(f".{name}", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, *_ROOMS])
