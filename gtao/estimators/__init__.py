"""Image-level drivers: a G-buffer and a configuration in, a result out."""

from .denoise import denoise
from .downsample import downsample
from .inspect_filters import FilterWeights, filter_weights
from .inspect_slices import inspect_slices
from .inspect_types import InspectedSample, InspectedSlice, SliceInspection
from .irradiance import irradiance
from .motion import camera_motion
from .multibounce import multibounce
from .occlusion import ambient_occlusion
from .reflection import diffuse_radiance
from .shading import reflected_directions, shade, specular_radiance
from .specular import environment_brdf, specular_occlusion, specular_reflectance
from .upsample import upsample
from .value_and_gradient import ValueAndGradient, value_and_gradient

__all__ = [
    "FilterWeights",
    "InspectedSample",
    "InspectedSlice",
    "SliceInspection",
    "ValueAndGradient",
    "ambient_occlusion",
    "camera_motion",
    "denoise",
    "diffuse_radiance",
    "downsample",
    "environment_brdf",
    "filter_weights",
    "inspect_slices",
    "irradiance",
    "multibounce",
    "reflected_directions",
    "shade",
    "specular_occlusion",
    "specular_radiance",
    "specular_reflectance",
    "upsample",
    "value_and_gradient",
]
