"""Ray-traced occlusion of glossy reflections, the reference for what tables and formulas make of visibility."""

import math
from typing import Any

from gtao.lighting import EnvironmentMap

from .brdf import load_bsdf
from .chunks import Progress
from .environment import light_of
from .hemisphere import check_rays
from .loading import select_sensor
from .primary import check_normals, shoot
from .sampling import check_sampling
from .specular_bsdf import bsdf_reflection
from .specular_microfacets import microfacets
from .specular_origins import roughness_image, seen
from .specular_result import Estimate, Specular, Terms
from .specular_sums import pair_images
from .variant import ensure_variant
from .walk import origins

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
    bsdf: Any = None,
    sensor: Any = 0,
    normals: str = "shading",
    n_batches: int = 8,
    progress: Progress | None = None,
) -> Specular:
    """Trace the rays that glossy surfaces reflect to the viewer (theory, eqs. (143) to (146), (155) and (156)).

    All surfaces are taken for GGX microfacet mirrors with height-correlated masking and Schlick's Fresnel term, or for
    ``bsdf``. Every shape occludes, whatever its BSDF or emission, and nothing is reflected twice. One render serves
    every F0 (:meth:`Specular.with_f0`). Rays are drawn by the visible normals; under an environment every sample has a
    second one by the light, and radiance weighs both by the balance heuristic, while the occlusion keeps its bits.
    Normals that face away from the viewer are turned until they are seen edge-on, as estimators do it. What
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
        bsdf: ``mitsuba.BSDF``, or the dictionary of one, that reflects instead; ``roughness`` and ``f0`` are not looked
            at. It is drawn from by its own sampling, and occlusion is the ratio of the same rays with and without
            visibility. What it transmits is left out.
        sensor: index of the sensor, or a ``mitsuba.Sensor``.
        normals: "shading" or "geometric"; only looked at without ``g``.
        n_batches: independent batches, at least two, that the variance is estimated from.
        progress: called as ``progress(done, total)`` after each piece of work.

    Raises:
        SceneError: no such sensor, ``g`` is not of this scene and sensor, or the variant renders spectra, or, with an
            environment, not in linear RGB.
        ConfigError: a parameter is out of range, ``environment`` is not a map or ``bsdf`` not a BSDF.
        ShapeError: roughness or F0 have another shape or values outside of [0, 1].
        BackendError: there is no usable backend.
    """
    ensure_variant()
    check_sampling(spp, n_batches, seed)
    check_normals(normals)
    check_rays(max_distance)
    light = None if environment is None else light_of(scene, environment)
    material = None if bsdf is None else load_bsdf(bsdf)
    hits = shoot(scene, select_sensor(scene, sensor), normals)
    shape = hits.camera.shape
    start = seen(hits, origins(hits, g), roughness_image(roughness, shape))
    reflection = microfacets(start, shape, f0, light) if material is None else bsdf_reflection(material, light)
    found = pair_images(scene, start, shape, reflection, max_distance, spp, n_batches, seed, progress)
    return Specular(
        **reflection.results(found),
        count=spp,
        n_batches=n_batches,
        max_distance=float(max_distance),
        seed=seed,
    )
