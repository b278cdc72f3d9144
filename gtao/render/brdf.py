"""BSDFs of Mitsuba as functions of two directions."""

from collections.abc import Callable, Mapping
from typing import Any

import drjit as dr
import mitsuba as mi

from gtao.errors import ConfigError, SceneError

from .variant import ensure_variant

__all__ = ["brdf", "load_bsdf", "shading_point"]


def brdf(bsdf: Any) -> Callable[[Any, Any], Any]:
    """Reflection of a BSDF of Mitsuba, as tables of specular occlusion are baked from.

    Args:
        bsdf: ``mitsuba.BSDF``, or the dictionary of one. Textures are looked up at their origin.

    Returns:
        Function of two unit vectors in the frame of the surface (n = z), Dr.Jit arrays of three, the first to the light
        and the second to the camera, that returns f_r cos θ_i: the luminance of it where there are colours; 0 where
        either is below the surface. Mitsuba computes in single precision.

    Raises:
        ConfigError: it is neither.
        SceneError: colours of the variant are spectra or polarised.
        BackendError: there is no usable backend.
    """
    ensure_variant()
    loaded = load_bsdf(bsdf)

    def reflected(wi: Any, wo: Any) -> Any:
        wi, wo = mi.Vector3f(wi), mi.Vector3f(wo)
        value = loaded.eval(mi.BSDFContext(), shading_point(wo), wi, True)
        grey = mi.luminance(value) if mi.is_rgb else value[0]
        return dr.select((wi.z > 0) & (wo.z > 0), grey, 0)

    return reflected


def load_bsdf(bsdf: Any) -> Any:
    """A ``mitsuba.BSDF``, from itself or its dictionary.

    Raises:
        ConfigError: it is neither.
        SceneError: colours of the variant are spectra or polarised.
    """
    if mi.is_spectral or mi.is_polarized:
        raise SceneError(f"a bsdf needs an rgb or mono variant of Mitsuba, not {mi.variant()}")
    try:
        loaded = mi.load_dict(dict(bsdf)) if isinstance(bsdf, Mapping) else bsdf
    except (RuntimeError, ValueError) as error:
        raise ConfigError(f"Mitsuba does not load this bsdf: {error}") from None
    if not isinstance(loaded, mi.BSDF):
        raise ConfigError(f"bsdf must be a mitsuba.BSDF or the dictionary of one, got {type(loaded).__name__}")
    return loaded


def shading_point(wo: Any, uv: Any = None) -> Any:
    """Surface interaction seen from ``wo`` in the frame of the surface, with all that a BSDF looks at."""
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(wo))
    si.wi = wo
    si.n = mi.Normal3f(0, 0, 1)
    si.sh_frame = mi.Frame3f(mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0), mi.Vector3f(0, 0, 1))
    if uv is not None:
        si.uv = uv
    return si
