"""Where the paths of a pixel begin, and their directions, as all estimators of the ground truth use them."""

from dataclasses import dataclass
from typing import Any, Self

import drjit as dr
import mitsuba as mi
import numpy as np

from .primary import PrimaryHits, match_gbuffer

__all__ = ["Origins", "cosine_direction", "origins", "spawn", "uniform_direction"]


@dataclass
class Origins:
    """Surface points that paths start from, one per valid pixel.

    Attributes:
        pixel: flat index ``y * width + x``.
        position: world space.
        n_geo: geometric normal that faces the camera.
        normal: world normal that directions are drawn about.
    """

    pixel: Any
    position: Any
    n_geo: Any
    normal: Any

    def __len__(self) -> int:
        return dr.width(self.pixel)

    def part(self, start: int, stop: int) -> Self:
        lane = dr.arange(mi.UInt32, stop - start) + dr.opaque(mi.UInt32, start)
        return type(self)(*(dr.gather(type(v), v, lane) for v in vars(self).values()))


def origins(hits: PrimaryHits, g: Any = None) -> Origins:
    """Start points of all pixels with a surface; directions are drawn about the normals of ``g``, if given."""
    normal, valid = (hits.normal_w, hits.valid) if g is None else match_gbuffer(hits, g)
    if not dr.any(valid)[0]:
        pixel = mi.UInt32(np.empty(0, dtype=np.uint32))
        return Origins(pixel, mi.Point3f(), mi.Normal3f(), mi.Normal3f())
    pixel = dr.compress(valid)
    values = (dr.gather(type(v), v, pixel) for v in (mi.Point3f(hits.si.p), hits.n_geo_w, normal))
    start = Origins(pixel, *values)
    dr.eval(vars(start))
    return start


def cosine_direction(normal: Any, sample: Any) -> Any:
    """Direction about ``normal`` with the density cos θ / π, from a point of the unit square."""
    return mi.Frame3f(normal).to_world(mi.warp.square_to_cosine_hemisphere(sample))


def uniform_direction(normal: Any, sample: Any) -> Any:
    """Direction about ``normal`` with the density 1 / 2π, from a point of the unit square."""
    return mi.Frame3f(normal).to_world(mi.warp.square_to_uniform_hemisphere(sample))


def spawn(position: Any, n_geo: Any, direction: Any) -> Any:
    """Ray from a surface, offset from it as Mitsuba does it."""
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.p = position
    si.n = n_geo
    return si.spawn_ray(direction)
