"""Ray-traced occlusion of glossy reflections, the reference for what tables and formulas make of visibility."""

import math
from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from gtao.lighting import EnvironmentMap

from .chunks import Progress
from .environment import light_density, light_of, radiance
from .hemisphere import Drawn, RayKind, check_rays, image, mean_over_batches, ray_sums
from .loading import select_sensor
from .primary import check_normals, shoot
from .sampling import check_sampling
from .specular_hemisphere import hemisphere_terms
from .specular_lobe import Lobe
from .specular_origins import Seen, roughness_image, seen
from .specular_result import Estimate, Pair, Specular, Terms
from .variant import ensure_variant
from .walk import Origins, origins

__all__ = ["Estimate", "Specular", "Terms", "specular"]


def specular(
    scene: Any,
    g: Any = None,
    roughness: Any = 0.5,
    f0: Any = 0.04,
    max_distance: float = math.inf,
    spp: int = 256,
    seed: int = 0,
    *,
    environment: EnvironmentMap | None = None,
    sensor: Any = 0,
    normals: str = "shading",
    n_batches: int = 8,
    progress: Progress | None = None,
) -> Specular:
    """Trace the rays that a glossy surface behind every pixel centre reflects to the viewer (theory, eqs. (143)-(146)).

    The surface is a GGX microfacet mirror with height-correlated masking and Schlick's Fresnel term. Every shape
    occludes, whatever its BSDF or emission, and nothing is reflected twice. One render serves every F0
    (:meth:`Specular.with_f0`). Rays are drawn by the visible normals; under an environment every sample has a second
    one by the light, and radiance weighs both by the balance heuristic, while the occlusion keeps its bits. Normals
    that face away from the viewer are turned until they are seen edge-on, as estimators do it. What
    :func:`gtao.render.visibility` says about start points and backgrounds holds here.

    Args:
        scene: ``mitsuba.Scene``; see :func:`gtao.render.load_scene`.
        g: G-buffer of the same scene and sensor whose normals count. ``None`` uses those of the scene.
        roughness: perceptual, in [0, 1], the root of the microfacet width: a number or an (H, W) image. Below 0.01,
            where single precision ends, it counts as that: 0 is a mirror whose lobe is a hundredth of a degree wide.
        f0: reflectance at normal incidence, in [0, 1]: a number, (3,) linear RGB, or an (H, W) or (H, W, 3) image.
        max_distance: surfaces farther than this do not occlude; scene units, may be inf.
        spp: samples per pixel, a multiple of ``n_batches``; powers of two stratify best.
        seed: non-negative; the same seed gives the same bits.
        environment: map of radiance, turned into the world by its ``to_world``; with it, radiance is rendered too.
        sensor: index of the sensor, or a ``mitsuba.Sensor``.
        normals: "shading" or "geometric"; only looked at without ``g``.
        n_batches: independent batches, at least two, that the variance is estimated from.
        progress: called as ``progress(done, total)`` after each piece of work.

    Raises:
        SceneError: no such sensor, ``g`` is not of this scene and sensor, or there is an environment and the variant
            does not render in linear RGB.
        ConfigError: a parameter is out of range, or ``environment`` is not a map.
        ShapeError: roughness or F0 have another shape or values outside of [0, 1].
        BackendError: there is no usable backend.
    """
    ensure_variant()
    check_sampling(spp, n_batches, seed)
    check_normals(normals)
    check_rays(max_distance)
    light = None if environment is None else light_of(scene, environment)
    hits = shoot(scene, select_sensor(scene, sensor), normals)
    start = seen(hits, origins(hits, g), roughness_image(roughness, hits.camera.shape))
    kinds = [_by_lobe(light)] if light is None else [_by_lobe(light), _by_light(light)]

    def estimate(part: Origins, key: int, n_samples: int) -> np.ndarray:
        sums = ray_sums(scene, part, key, n_samples, max_distance, kinds) / n_samples
        a, b = sums.reshape(-1, 2, *sums.shape[1:]).swapaxes(0, 1)
        # With the variance of the sum, that of any F0 a + b is known.
        return np.concatenate([a, b, a + b])

    n_pairs = 1 if light is None else 7
    mean, variance = mean_over_batches(start, 3 * n_pairs, spp, n_batches, seed, estimate, progress)
    pairs = list(zip(*(x.reshape(3, n_pairs, -1).swapaxes(0, 1) for x in (mean, variance)), strict=True))
    shape = hits.camera.shape
    whole = np.stack([x.numpy() for x in hemisphere_terms(start.wo.z, start.alpha)]) if len(start) else np.zeros((2, 0))
    terms = Terms(
        visible=_pair(pairs[:1], start, shape, ()),
        hemisphere=image(whole, start, shape),
        mask=image(np.ones(len(start)), start, shape) > 0,
        radiance=None if light is None else _pair(pairs[1:4], start, shape, (3,)),
        unoccluded=None if light is None else _pair(pairs[4:], start, shape, (3,)),
    )
    return Specular(
        **terms.estimates(f0),
        terms=terms,
        f0=f0,
        count=spp,
        n_batches=n_batches,
        max_distance=float(max_distance),
        seed=seed,
    )


def _by_lobe(light: Any) -> RayKind:
    """Rays that the visible normals reflect; with a light, radiance is weighed against that of :func:`_by_light`."""

    def drawn(start: Seen, points: Callable[[int], Any]) -> Drawn:
        lobe, frame = Lobe(start.wo, start.alpha), mi.Frame3f(start.normal)
        wi = lobe.sample(points(0))
        direction = frame.to_world(wi)
        weights = lobe.weights(wi)
        if light is None:
            return Drawn(direction, weights)
        density = lobe.density(wi)
        share = density / (density + light_density(light, direction))
        terms = _times(weights, share * radiance(light, direction))
        return Drawn(direction, (*weights, *terms), terms)

    return drawn


def _by_light(light: Any) -> RayKind:
    """Rays that the light draws; they add to radiance alone."""

    def drawn(start: Seen, points: Callable[[int], Any]) -> Drawn:
        direction = light.sample_direction(dr.zeros(mi.Interaction3f), points(1))[0].d
        lobe, wi = Lobe(start.wo, start.alpha), mi.Frame3f(start.normal).to_local(direction)
        density = lobe.density(wi)
        total = density + light_density(light, direction)
        # Nothing can be drawn from a black map: its density is NaN.
        share = dr.select(total > 0, density / total, 0)
        terms = _times(lobe.weights(wi), share * radiance(light, direction))
        zero = dr.zeros(mi.Float)
        return Drawn(direction, (zero, zero, *terms), terms)

    return drawn


def _times(weights: tuple[Any, Any], colour: Any) -> tuple:
    """The terms of red, of green and of blue."""
    return tuple(weight * channel for channel in colour for weight in weights)


def _pair(rows: list[tuple[np.ndarray, np.ndarray]], start: Origins, shape: tuple[int, int], channels: tuple) -> Pair:
    """Images of some pairs, of each of which there are (a, b, a + b) and their variances."""
    mean = np.stack([image(m[:2], start, shape) for m, _ in rows], 2)
    spread = np.stack([image(np.stack([v[0], v[1], (v[2] - v[0] - v[1]) / 2]), start, shape) for _, v in rows], 2)
    return Pair(mean.reshape(*shape, *channels, 2), spread.reshape(*shape, *channels, 3))
