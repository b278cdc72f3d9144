"""The one place that builds Mitsuba meshes: the mesh interface changes between Mitsuba releases."""

from collections.abc import Sequence

import mitsuba as mi
import numpy as np

from gtao.errors import ConfigError

from .surface import Surface

#: Grey, or RGB.
Reflectance = float | Sequence[float]


def diffuse(reflectance: Reflectance) -> dict:
    """Two-sided diffuse BSDF as a Mitsuba dict; ``reflectance`` is grey or RGB, each in [0, 1].

    Raises:
        ConfigError: a reflectance outside [0, 1], or neither one nor three of them.
    """
    try:
        value = np.asarray(reflectance, float)
    except (TypeError, ValueError):
        value = np.array(np.nan)
    if value.shape not in ((), (3,)) or not np.all((value >= 0) & (value <= 1)):
        raise ConfigError(f"reflectance must be one number or three in [0, 1], got {reflectance!r}")
    rgb = np.broadcast_to(value, 3).tolist()
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": rgb}}}


def mesh(surface: Surface, reflectance: Reflectance):
    """Mitsuba mesh with face normals and a two-sided diffuse BSDF, in float32.

    Args:
        surface: the triangles.
        reflectance: grey or RGB, in [0, 1].

    Returns:
        ``mi.Mesh`` of the active variant.
    """
    properties = mi.Properties()
    properties["face_normals"] = True
    properties["bsdf"] = mi.load_dict(diffuse(reflectance))
    result = mi.Mesh("surface", len(surface.vertices), len(surface.faces), properties)
    parameters = mi.traverse(result)
    parameters["vertex_positions"] = surface.vertices.astype(np.float32).ravel()
    parameters["faces"] = surface.faces.astype(np.uint32).ravel()
    parameters.update()
    return result
