"""Ray-traced factors of the split-integral approximations: light and visibility in the symmetric lobe of a probe."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from gtao.kernels.microfacet import LEAST_ALPHA, ggx_of_sine
from gtao.lighting import EnvironmentMap

from .chunks import Progress
from .environment import light_density, light_of, radiance
from .hemisphere import Drawn, RayKind, check_rays, image, mean_over_batches, ray_sums
from .loading import select_sensor
from .primary import check_normals, shoot
from .sampling import check_sampling
from .specular_origins import Seen, roughness_image, seen
from .specular_result import Estimate
from .variant import ensure_variant
from .walk import origins

__all__ = ["SplitIntegrals", "split_integrals"]


@dataclass(frozen=True, kw_only=True)
class SplitIntegrals:
    """Means over the lobe about the reflected direction (theory, eq. (141)), each an :class:`Estimate`.

    A symmetric lobe reaches below surfaces that are seen at an angle. What is there counts as blocked: open surfaces
    have ``visibility`` equal to ``above``, and quotients by it are means over the part of the lobe above the surface.

    Attributes:
        visibility: (H, W) share of the lobe that nothing blocks, the factor of three splits; 1 on the background.
        above: (H, W) share of the lobe above the surface, by the same rays; 1 on the background.
        radiance: (H, W, 3) mean radiance in the lobe, 0 where something blocks, the factor of two splits; 0 on the
            background. None without an environment.
        count: samples per pixel: rays, or under an environment pairs of rays.
        n_batches: batches that variances rest on; single pixels have one degree of freedom fewer: pool before testing.
        max_distance: distance beyond which nothing occludes, in scene units.
        seed: of the random numbers.
    """

    visibility: Estimate
    above: Estimate
    radiance: Estimate | None = None
    count: int
    n_batches: int
    max_distance: float = math.inf
    seed: int = 0

    def __repr__(self) -> str:
        height, width = self.visibility.mean.shape
        light = "" if self.radiance is None else ", with an environment"
        return f"SplitIntegrals({width}x{height}, {self.count} samples per pixel{light})"


def split_integrals(
    scene: Any,
    g: Any = None,
    roughness: Any = 0.5,
    max_distance: float = math.inf,
    spp: int = 256,
    seed: int = 0,
    *,
    environment: EnvironmentMap | None = None,
    sensor: Any = 0,
    normals: str = "shading",
    n_batches: int = 8,
    progress: Progress | None = None,
) -> SplitIntegrals:
    """Trace the means of visibility and of visible radiance over the lobe of a pre-filtered probe (theory, eq. (141)).

    The lobe is that of :func:`gtao.lighting.prefilter`, symmetric about the reflected direction, so that open surfaces
    which no part of the lobe passes below see what the probe holds. Arguments, random numbers and errors are those of
    :func:`gtao.render.specular`; rays are drawn by the lobe, under an environment also by the light.

    Raises:
        SceneError: no such sensor, ``g`` is not of this scene and sensor, or there is an environment and the variant
            does not render in linear RGB.
        ConfigError: a parameter is out of range, or ``environment`` is not a map.
        ShapeError: roughness has another shape or values outside of [0, 1].
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

    def estimate(part: Seen, key: int, n_samples: int) -> np.ndarray:
        sums = ray_sums(scene, part, key, n_samples, max_distance, kinds)
        return sums / (n_samples * _integral(part.alpha.numpy().astype(np.float64)))

    n_values = 2 if light is None else 5
    moments = mean_over_batches(start, n_values, spp, n_batches, seed, estimate, progress)
    shape = hits.camera.shape

    def pair(rows: Any, background: float) -> Estimate:
        mean, variance = (values[rows] for values in moments)
        return Estimate(mi.TensorXf(image(mean, start, shape, background)), mi.TensorXf(image(variance, start, shape)))

    return SplitIntegrals(
        visibility=pair(0, 1),
        above=pair(-1, 1),
        radiance=None if light is None else pair(slice(1, 4), 0),
        count=spp,
        n_batches=n_batches,
        max_distance=float(max_distance),
        seed=seed,
    )


class _ProbeLobe:
    """D(cos t/2) ⟨cos t⟩₊ about z, and directions drawn by D / 4, in the frame of the axis."""

    def __init__(self, alpha: Any) -> None:
        self.alpha = dr.select(alpha > LEAST_ALPHA, alpha, LEAST_ALPHA)

    def sample(self, sample: Any) -> Any:
        """What a microfacet, drawn with the density D cos θ_h, mirrors the axis into."""
        # tan² θ_h = α² u / (1 - u).
        tangent2 = dr.square(self.alpha) * sample.y / (1 - sample.y)
        cos2 = 1 / (1 + tangent2)
        sin_t, cos_t = 2 * cos2 * dr.sqrt(tangent2), dr.fma(-tangent2, cos2, cos2)
        sin_phi, cos_phi = dr.sincos(2 * dr.pi * sample.x)
        return mi.Vector3f(sin_t * cos_phi, sin_t * sin_phi, cos_t)

    def density(self, w: Any) -> Any:
        # sin² (t/2) from the chord, which keeps its digits.
        chord2 = dr.squared_norm(w - mi.Vector3f(0, 0, 1))
        return 0.25 * ggx_of_sine(0.25 * chord2, self.alpha)

    def weight(self, w: Any) -> Any:
        """The lobe over the density; at most 4."""
        return dr.select(w.z > 0, 4 * w.z, 0)


def _integral(alpha: np.ndarray) -> np.ndarray:
    """Of the lobe over all directions (theory, eq. (140))."""
    a = np.maximum(alpha, LEAST_ALPHA) ** 2
    z = 0.5 * (1 - a) / a
    # z - ln(1 + z) cancels where z is small.
    small = z < 1e-3
    series = 0.5 - z * (1 / 3 - z * (0.25 - 0.2 * z))
    safe = np.where(small, 1, z)
    return 2 / a * np.where(small, series, (safe - np.log1p(safe)) / safe**2)


def _by_lobe(light: Any) -> RayKind:
    """Rays that the lobe draws; with a light, radiance is weighed against that of :func:`_by_light`."""

    def drawn(start: Seen, points: Callable[[int], Any]) -> Drawn:
        lobe, frame = _ProbeLobe(start.alpha), _reflected(start)
        w = lobe.sample(points(0))
        direction, weight = frame.to_world(w), lobe.weight(w)
        above = dr.select(dr.dot(direction, start.normal) > 0, weight, 0)
        if light is None:
            return Drawn(direction, (above,), (above,))
        density = lobe.density(w)
        share = density / (density + light_density(light, direction))
        return Drawn(direction, (above, *(above * share * radiance(light, direction))), (above,))

    return drawn


def _by_light(light: Any) -> RayKind:
    """Rays that the light draws; they add to radiance alone."""

    def drawn(start: Seen, points: Callable[[int], Any]) -> Drawn:
        direction = light.sample_direction(dr.zeros(mi.Interaction3f), points(1))[0].d
        lobe, w = _ProbeLobe(start.alpha), _reflected(start).to_local(direction)
        density = lobe.density(w)
        total = density + light_density(light, direction)
        # Nothing can be drawn from a black map: its density is NaN.
        share = dr.select((total > 0) & (dr.dot(direction, start.normal) > 0), density / total, 0)
        zero = dr.zeros(mi.Float)
        return Drawn(direction, (zero, *(lobe.weight(w) * share * radiance(light, direction))), (zero,))

    return drawn


def _reflected(start: Seen) -> Any:
    """Frame about the view direction mirrored at the normal."""
    return mi.Frame3f(mi.Frame3f(start.normal).to_world(mi.Vector3f(-start.wo.x, -start.wo.y, start.wo.z)))
