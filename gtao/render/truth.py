"""Ray-traced visibility, the reference that every estimator is measured against."""

import math
from dataclasses import dataclass
from typing import Any

import mitsuba as mi
import numpy as np

from gtao import display

from .chunks import Progress
from .hemisphere import DIRECTIONS, bent, check_rays, image, mean_over_batches, normals_v, open_sums
from .loading import select_sensor
from .primary import check_normals, shoot
from .sampling import check_sampling
from .sensor import rotation
from .variant import ensure_variant
from .walk import Origins, origins

__all__ = ["Visibility", "visibility"]


@dataclass(frozen=True, kw_only=True)
class Visibility:
    """Visibility of one view, with its uncertainty.

    Attributes:
        mean: (H, W) tensor in [0, 1], 1 = open, 1 on the background.
        variance: (H, W) variance *of the mean* (its root is the standard error), from independent batches; 0
            on the background. Single pixels have few degrees of freedom (``n_batches - 1``): pool them before
            testing.
        count: rays per pixel.
        n_batches: batches that the variance rests on.
        bent_normal: (H, W, 3) unit mean unoccluded direction, view frame; the normal where nothing is
            visible, +z on the background; None unless asked for.
        mean_direction: (H, W, 3) the same before normalisation: the integral of V(ω) ω cos θ / π (or of
            V(ω) ω / 2π), of length at most 2/3 (1/2) when only the weighting shortens it; 0 on the background.
        max_distance: distance beyond which nothing occludes, in scene units.
        seed: of the random numbers.
        weighting: "cosine" or "uniform" over the hemisphere.
    """

    mean: Any
    variance: Any
    count: int
    n_batches: int
    bent_normal: Any = None
    mean_direction: Any = None
    max_distance: float = math.inf
    seed: int = 0
    weighting: str = "cosine"

    def _repr_png_(self) -> bytes:
        return display.grey_png(self.mean)

    def __repr__(self) -> str:
        height, width = self.mean.shape
        return f"Visibility({width}x{height}, {self.count} rays per pixel, max_distance={self.max_distance:g})"


def visibility(
    scene: Any,
    g: Any = None,
    max_distance: float = math.inf,
    spp: int = 256,
    seed: int = 0,
    *,
    sensor: Any = 0,
    normals: str = "shading",
    n_batches: int = 8,
    bent_normal: bool = True,
    weighting: str = "cosine",
    progress: Progress | None = None,
) -> Visibility:
    """Trace rays over the hemisphere from the surface behind every pixel centre (theory, eqs. (1) and (3)).

    Every shape occludes, whatever its BSDF or emission, and so does the surface itself where a normal leans so
    far that directions about it point below the geometric surface. Start points are found anew in the scene, so
    a rounded depth in ``g`` does no harm; directions are drawn about the normals of ``g``. Pixels where only one of
    the two has a surface count as background. As Mitsuba's own, rays start 9e-5 (1 + |p|) off the surface for a
    largest coordinate |p|: scale up scenes much smaller than one unit.

    Args:
        scene: ``mitsuba.Scene``; see :func:`gtao.render.load_scene`.
        g: G-buffer of the same scene and sensor whose normals count. ``None`` uses those of the scene.
        max_distance: surfaces farther than this do not occlude; scene units, may be inf.
        spp: rays per pixel, a multiple of ``n_batches``; powers of two stratify best.
        seed: non-negative; the same seed gives the same bits.
        sensor: index of the sensor, or a ``mitsuba.Sensor``.
        normals: "shading" or "geometric"; only looked at without ``g``.
        n_batches: independent batches, at least two, that the variance is estimated from.
        bent_normal: also average the unoccluded directions.
        weighting: "cosine" for diffuse visibility (theory, eq. (1)), "uniform" for the open share of the solid angle
            (eq. (2)).
        progress: called as ``progress(done, total)`` after each piece of work.

    Raises:
        SceneError: no such sensor, or ``g`` is not of this scene and sensor.
        ConfigError: a parameter is out of range.
        BackendError: there is no usable backend.
    """
    ensure_variant()
    check_sampling(spp, n_batches, seed)
    check_normals(normals)
    check_rays(max_distance, weighting)
    hits = shoot(scene, select_sensor(scene, sensor), normals)
    start = origins(hits, g)
    to_view = rotation(hits.view_to_world.T)

    def values(direction: Any, _: Any) -> tuple:
        return (mi.UInt32(1), to_view @ direction) if bent_normal else (mi.UInt32(1),)

    def estimate(part: Origins, key: int, n_rays: int) -> np.ndarray:
        return open_sums(scene, part, key, n_rays, max_distance, (DIRECTIONS[weighting],), values) / n_rays

    n_values = 4 if bent_normal else 1
    mean, variance = mean_over_batches(start, n_values, spp, n_batches, seed, estimate, progress)
    shape = hits.camera.shape
    direction = image(mean[1:], start, shape) if bent_normal else None
    return Visibility(
        mean=mi.TensorXf(image(mean[0], start, shape, 1.0)),
        variance=mi.TensorXf(image(variance[0], start, shape)),
        count=spp,
        n_batches=n_batches,
        bent_normal=None if direction is None else mi.TensorXf(bent(direction, normals_v(start, hits))),
        mean_direction=None if direction is None else mi.TensorXf(direction),
        max_distance=float(max_distance),
        seed=seed,
        weighting=weighting,
    )
