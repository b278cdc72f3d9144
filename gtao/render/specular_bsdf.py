"""Rays that a BSDF of Mitsuba reflects to the viewer, and what they count for."""

from collections.abc import Callable, Mapping
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from .brdf import shading_point
from .environment import light_density, radiance
from .hemisphere import Drawn, RayKind
from .specular_microfacets import balanced, light_direction
from .specular_origins import Seen
from .specular_result import Pair, estimate_of
from .specular_sums import Reflection

__all__ = ["bsdf_reflection"]


def bsdf_reflection(bsdf: Any, light: Any = None) -> Reflection:
    """Reflection by a BSDF, channel by channel; what it transmits counts for nothing."""
    n_channels = dr.size_v(mi.Spectrum)

    def pairs(values: np.ndarray, _: slice) -> np.ndarray:
        return values.swapaxes(1, 2)

    def results(found: Pair) -> Mapping[str, Any]:
        channels = slice(n_channels) if n_channels > 1 else 0
        occlusion = Pair(found.mean[:, :, channels], found.covariance[:, :, channels]).ratio()
        estimates = {"occlusion": estimate_of(*occlusion)}
        if light is not None:
            for k, name in enumerate(("radiance", "unoccluded")):
                lit = found.mean[:, :, n_channels:, k], found.covariance[:, :, n_channels:, k]
                estimates[name] = estimate_of(*lit)
        return estimates

    return Reflection(_rays(bsdf, light), n_channels if light is None else 2 * n_channels, pairs, results)


def _rays(bsdf: Any, light: Any) -> list[RayKind]:
    """Counted as f_r cos θ_i, and of a light as that times radiance, channel by channel."""
    context = mi.BSDFContext()

    def by_bsdf(start: Seen, points: Callable[[int], Any]) -> Drawn:
        frame, si = _shading(start)
        drawn, weight = bsdf.sample(context, si, points(2).x, points(0), True)
        direction = frame.to_world(drawn.wo)
        weight = dr.select((drawn.wo.z > 0) & (drawn.pdf > 0), weight, 0)
        if light is None:
            return Drawn(direction, tuple(weight), tuple(weight))
        # Of a mirror's direction there is no density, and a light's own rays never meet it.
        mirror = mi.has_flag(drawn.sampled_type, mi.BSDFFlags.Delta)
        share = dr.select(mirror, 1, balanced(drawn.pdf, light, direction))
        terms = (*weight, *(weight * share * radiance(light, direction)))
        return Drawn(direction, terms, terms)

    def by_light(start: Seen, points: Callable[[int], Any]) -> Drawn:
        direction = light_direction(light, points(1))
        frame, si = _shading(start)
        wi = frame.to_local(direction)
        value, density = bsdf.eval_pdf(context, si, wi, True)
        total = density + light_density(light, direction)
        value = dr.select((wi.z > 0) & (total > 0), value / total, 0)
        terms = (*dr.zeros(type(value)), *(value * radiance(light, direction)))
        return Drawn(direction, terms, terms)

    return [by_bsdf] if light is None else [by_bsdf, by_light]


def _shading(start: Seen) -> tuple[Any, Any]:
    frame = start.textured_frame
    return frame, shading_point(frame.to_local(start.frame.to_world(start.wo)), start.uv)
