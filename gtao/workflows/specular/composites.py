"""Images of glossy surfaces under light from afar, put together as engines do it, against traced reflections."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gtao import evaluate, render
from gtao.estimators import reflected_directions, specular_radiance
from gtao.lighting import EnvironmentMap, PrefilteredEnvironment, prefilter
from gtao.plot import LightingView, MethodResult, SceneComparison
from gtao.workflows.lighting.lights import Light, placed

from .frames import RUNS, GlossyFrame
from .measuring import Noisy, Occlusions
from .methods import DENSE
from .settings import CompareSpecularConfig

__all__ = ["SPLITS", "Lit", "Probe", "lit_view", "measure_lit"]

#: Group of the composites whose factors are all traced.
SPLITS = "traced factors"
#: What is put together there: names of tables.
TWO, THREE, TRACED_S, UNSPLIT, OPEN = (
    "two splits",
    "three splits",
    "S traced, light pre-filtered",
    "S traced, light traced",
    "no occlusion, light traced",
)
#: Pre-filtered light without occluders against traced light without occluders.
LIGHT_ALONE = "light alone"

#: Methods that pictures show, if they take part.
PICTURED = ("cone-brdf", "brdf-4d", "cone-cone", "lagarde", "visibility", "unoccluded")

#: Errors relative to the mean mean nothing where occluders leave less than this share of the light.
DARK = 0.01
#: Least share of a lobe above the surface that is divided by.
LEAST = 1e-6


class Probe:
    """A light, blurred once for every roughness, in any world.

    Args:
        light: the light.
        roughness: the levels.
    """

    def __init__(self, light: Light, roughness: tuple[float, ...]):
        self.light = light
        self._levels = prefilter(light.map, tuple(sorted(roughness)))

    def placed(self, up: str, turn: float) -> tuple[EnvironmentMap, PrefilteredEnvironment]:
        """The map and its levels in a world whose ``up`` axis is the vertical, turned by ``turn`` degrees about it."""
        levels = tuple(placed(replace(self.light, map=level), up, turn) for level in self._levels.levels)
        return placed(self.light, up, turn), replace(self._levels, levels=levels)


@dataclass(frozen=True, eq=False)
class Lit:
    """What one frame reflects of one light at one roughness.

    Attributes:
        truth, open: (H, W, 3) traced radiance with occluders and without, and their variances.
        reflected: (H, W, 3) what is reflected of the pre-filtered light without occluders.
        images: (H, W, 3) radiance of composites by group and name, with variances.
    """

    truth: Noisy
    open: Noisy
    reflected: np.ndarray
    images: Mapping[str, Mapping[str, Noisy]]


def measure_lit(
    found: Occlusions,
    environment: EnvironmentMap,
    probe: PrefilteredEnvironment,
    roughness: float,
    config: CompareSpecularConfig,
) -> tuple[SceneComparison, Lit] | None:
    """Every composite of one frame under one light at one roughness.

    Args:
        found: the frame, and occlusion as methods have it.
        environment, probe: the light in the world of the scene, and its levels.
        roughness: of all surfaces.
        config: the settings.

    Returns:
        Errors relative to the mean traced radiance of the surface, free of noise, and the images. None where occluders
        leave hardly any light.
    """
    lit = _lit(found, environment, probe, roughness, config)
    mask = found.frame.view.mask
    truth, variance = (image[mask] for image in lit.truth)
    mean = float(truth.mean())
    if mean <= DARK * lit.open[0][mask].mean():
        return None
    rows = [
        _row(name, group, [x[mask] for x in image], (truth, variance), mean)
        for group, images in lit.images.items()
        for name, image in images.items()
    ]
    light = lit.reflected[mask]
    rows.append(_row(LIGHT_ALONE, LIGHT_ALONE, [light, 0 * light], tuple(x[mask] for x in lit.open), mean))
    comparison = SceneComparison(
        name=found.frame.view.name,
        radius=found.frame.view.radius,
        truth=lit.truth[0].mean(-1) / mean,
        mask=mask,
        methods=rows,
        noise=evaluate.noise_floor(variance) / mean,
    )
    return comparison, lit


def _row(name: str, group: str, image: Any, truth: Noisy, mean: float) -> MethodResult:
    metrics: dict[str, float | None] = {
        "rmse": evaluate.corrected_rmse(image[0], truth[0], image[1] + truth[1]) / mean,
        "bias": evaluate.bias(image[0], truth[0]) / mean,
    }
    return MethodResult(name=name, label=name, metrics=metrics, group=group)


def _lit(
    found: Occlusions,
    environment: EnvironmentMap,
    probe: PrefilteredEnvironment,
    roughness: float,
    config: CompareSpecularConfig,
) -> Lit:
    frame, g = found.frame, found.frame.view.g
    given = {"environment": environment, "sensor": frame.view.sensor}
    start = [frame.view.scene, g, roughness]
    seeds = [(config.seed + RUNS + k) % 2**32 for k in range(3)]
    traced = render.specular(*start, config.f0, frame.view.radius, config.lit_spp, seeds[0], **given)
    truth, unshadowed = (_noisy(estimate) for estimate in (traced.radiance, traced.unoccluded))
    # Rays of their own: what they share with the truth would make them look better than they are.
    other = render.specular(*start, config.f0, frame.view.radius, config.lit_spp, seeds[1], **given)
    split = render.split_integrals(*start, frame.view.radius, config.lit_spp, seeds[2], **given)
    level = _levels(frame, probe, roughness)

    def composite(light: Any) -> np.ndarray:
        return specular_radiance(1.0, light, g, roughness, config.f0).numpy().astype(np.float64)

    whole, reflected = composite(1.0), composite(level)
    above = np.maximum(_noisy(split.above)[0], LEAST)[..., None]
    s, free = _noisy(other.occlusion, wide=True), _noisy(other.unoccluded)
    share, seen = _noisy(split.visibility, wide=True), _noisy(split.radiance)
    images: dict[str, dict[str, Noisy]] = {
        SPLITS: {
            TWO: _times(seen, whole / above),
            THREE: _times(share, reflected / above),
            TRACED_S: _times(s, reflected),
            UNSPLIT: (s[0] * free[0], s[1] * free[0] ** 2 + s[0] ** 2 * free[1]),
            OPEN: free,
        }
    }
    # All that these multiply is the same for every method.
    for source in frame.given:
        images[source] = {}
        for name in config.names:
            image, variance = (x[..., None] for x in found.image(source, name, roughness))
            images[source][name] = _times((image, variance), reflected)
    return Lit(truth, unshadowed, reflected, images)


def _noisy(estimate: Any, wide: bool = False) -> Noisy:
    """Mean and variance of an estimate; wide: with an axis for colours."""
    mean, variance = (x.numpy().astype(np.float64) for x in (estimate.mean, estimate.variance))
    return (mean[..., None], variance[..., None]) if wide else (mean, variance)


def _times(image: Noisy, factor: np.ndarray) -> Noisy:
    """By a factor without noise."""
    return image[0] * factor, image[1] * factor**2


def _levels(frame: GlossyFrame, probe: PrefilteredEnvironment, roughness: float) -> Any:
    """(H, W, 3) tensor of the pre-filtered light about the reflected directions."""
    g = frame.view.g
    world = reflected_directions(g, render.view_to_world(frame.view.scene, frame.view.sensor)).numpy()
    world[~frame.view.mask] = (0.0, 0.0, 1.0)
    return g.types.Tensor(probe.lookup(world, roughness).astype(np.float32))


def lit_view(found: Occlusions, lit: Lit, light: str, roughness: float) -> LightingView:
    """Pictures of one frame under one light, with occlusion from dense slices."""
    methods = lit.images[DENSE]
    names = [name for name in PICTURED if name in methods] or list(methods)[: len(PICTURED)]
    shown = {TWO: lit.images[SPLITS][TWO], TRACED_S: lit.images[SPLITS][TRACED_S]} | {n: methods[n] for n in names}
    return LightingView(
        frame=found.frame.view.name,
        light=f"{light}, roughness {roughness:g}",
        source=DENSE,
        mask=found.frame.view.mask,
        truth=lit.truth[0],
        images={name: image for name, (image, _) in shown.items()},
    )
