"""Ground truth with Mitsuba: G-buffers, depth layers, ray-traced visibility, irradiance and transport of any scene.

The first call sets a Mitsuba variant unless one is set already: ``cuda_ad_rgb`` where CUDA and OptiX work,
``llvm_ad_rgb`` elsewhere.
"""

from . import animations, scenes
from .aov import gbuffer_from_aov
from .brdf import brdf
from .coated import coated
from .directional import DirectionalVisibility, directional
from .environment import environment, environment_emitter, view_to_world
from .fingerprint import fingerprint
from .gbuffer import gbuffer
from .irradiance import Irradiance, irradiance
from .layers import layers, thickness
from .loading import load_scene
from .sensor import camera_from_sensor
from .sequence import SequenceFrame, sequence
from .sequence_animation import Animation
from .sequence_poses import look_at, rigid
from .specular import Estimate, Specular, specular
from .split import SplitIntegrals, split_integrals
from .transport import Transport, transport
from .truth import Visibility, visibility

__all__ = [
    "Animation",
    "DirectionalVisibility",
    "Estimate",
    "Irradiance",
    "SequenceFrame",
    "Specular",
    "SplitIntegrals",
    "Transport",
    "Visibility",
    "animations",
    "brdf",
    "camera_from_sensor",
    "coated",
    "directional",
    "environment",
    "environment_emitter",
    "fingerprint",
    "gbuffer",
    "gbuffer_from_aov",
    "irradiance",
    "layers",
    "load_scene",
    "look_at",
    "rigid",
    "scenes",
    "sequence",
    "specular",
    "split_integrals",
    "thickness",
    "transport",
    "view_to_world",
    "visibility",
]
