"""Where the paths of a pixel begin, as both estimators of the ground truth use it."""

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from .primary import PrimaryHits, match_gbuffer

__all__ = ["Origins", "origins", "spawn"]


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

    def part(self, start: int, stop: int) -> "Origins":
        lane = dr.arange(mi.UInt32, stop - start) + dr.opaque(mi.UInt32, start)
        return Origins(*(dr.gather(type(v), v, lane) for v in vars(self).values()))


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


def spawn(position: Any, n_geo: Any, normal: Any, sample: Any, weighting: str = "cosine") -> Any:
    """Ray in a cosine-distributed or uniform direction about ``normal``, offset from the surface as Mitsuba does it."""
    uniform = weighting == "uniform"
    warp = mi.warp.square_to_uniform_hemisphere if uniform else mi.warp.square_to_cosine_hemisphere
    direction = mi.Frame3f(normal).to_world(warp(sample))
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.p = position
    si.n = n_geo
    return si.spawn_ray(direction)
