"""Ray-traced irradiance under light from afar, the reference for what estimators make of an environment."""

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from gtao.lighting import EnvironmentMap

from .chunks import Progress
from .environment import light_of, radiance
from .hemisphere import check_rays, image, mean_over_batches, open_sums
from .loading import select_sensor
from .primary import check_normals, shoot
from .sampling import check_sampling
from .variant import ensure_variant
from .walk import Origins, cosine_direction, origins

__all__ = ["Irradiance", "irradiance"]


@dataclass(frozen=True, kw_only=True)
class Irradiance:
    """Irradiance of one view, with its uncertainty.

    Attributes:
        mean: (H, W, 3) tensor, linear RGB, in units of radiance times steradian; 0 on the background. Times ρ/π: the
            radiance that a diffuse surface of albedo ρ reflects.
        variance: (H, W, 3) variance *of the mean*, from independent batches; 0 on the background. Single pixels
            have few degrees of freedom (``n_batches - 1``): pool them before testing.
        count: samples per pixel, two rays each.
        n_batches: batches that the variance rests on.
        max_distance: distance beyond which nothing occludes, in scene units.
        seed: of the random numbers.
    """

    mean: Any
    variance: Any
    count: int
    n_batches: int
    max_distance: float = math.inf
    seed: int = 0

    def __repr__(self) -> str:
        height, width = self.mean.shape[:2]
        return f"Irradiance({width}x{height}, {self.count} samples per pixel, max_distance={self.max_distance:g})"


def irradiance(
    scene: Any,
    g: Any = None,
    max_distance: float = math.inf,
    spp: int = 256,
    seed: int = 0,
    *,
    environment: EnvironmentMap | None = None,
    sensor: Any = 0,
    normals: str = "shading",
    n_batches: int = 8,
    progress: Progress | None = None,
) -> Irradiance:
    """Irradiance at every pixel from the light that reaches it straight from the environment (theory, eq. (127)).

    Every shape occludes, whatever its BSDF or emission; nothing is reflected, and the scene's lamps give no light.
    Each sample draws one direction by the cosine and one by the light, and weighs both by the balance heuristic: a
    small bright sun converges like a smooth sky. The first kind are the rays of :func:`gtao.render.visibility` with
    the same numbers, and what is said there about start points and backgrounds holds here.

    Args:
        scene: ``mitsuba.Scene``; see :func:`gtao.render.load_scene`.
        g: G-buffer of the same scene and sensor whose normals count. ``None`` uses those of the scene.
        max_distance: surfaces farther than this do not occlude; scene units, may be inf.
        spp: samples per pixel, of two rays each; a multiple of ``n_batches``; powers of two stratify best.
        seed: non-negative; the same seed gives the same bits.
        environment: map of radiance, turned into the world by its ``to_world``. ``None`` takes the scene's own
            environment emitter, otherwise that is ignored.
        sensor: index of the sensor, or a ``mitsuba.Sensor``.
        normals: "shading" or "geometric"; only looked at without ``g``.
        n_batches: independent batches, at least two, that the variance is estimated from.
        progress: called as ``progress(done, total)`` after each piece of work.

    Raises:
        SceneError: no such sensor, no environment in the scene and none given, ``g`` is not of this scene and sensor,
            or the variant does not render in linear RGB.
        ConfigError: a parameter is out of range, or ``environment`` is not a map.
        BackendError: there is no usable backend.
    """
    ensure_variant()
    check_sampling(spp, n_batches, seed)
    check_normals(normals)
    check_rays(max_distance)
    hits = shoot(scene, select_sensor(scene, sensor), normals)
    light = light_of(scene, environment)
    start = origins(hits, g)

    def by_light(normal: Any, sample: Any) -> Any:
        return light.sample_direction(dr.zeros(mi.Interaction3f), sample)[0].d

    def values(direction: Any, normal: Any) -> tuple:
        sampled = dr.zeros(mi.DirectionSample3f)
        sampled.d = direction
        cosine = dr.dot(direction, normal)
        density = cosine / dr.pi + light.pdf_direction(dr.zeros(mi.Interaction3f), sampled)
        # Nothing can be drawn from a black map: its density is NaN.
        return (dr.select((cosine > 0) & (density > 0), radiance(light, direction) * (cosine / density), 0),)

    def estimate(part: Origins, key: int, n_samples: int) -> np.ndarray:
        return open_sums(scene, part, key, n_samples, max_distance, (cosine_direction, by_light), values) / n_samples

    mean, variance = mean_over_batches(start, 3, spp, n_batches, seed, estimate, progress)
    shape = hits.camera.shape
    return Irradiance(
        mean=mi.TensorXf(image(mean, start, shape)),
        variance=mi.TensorXf(image(variance, start, shape)),
        count=spp,
        n_batches=n_batches,
        max_distance=float(max_distance),
        seed=seed,
    )
