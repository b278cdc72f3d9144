"""Irradiance of one frame under one light: every method against rays."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gtao import evaluate, render
from gtao.estimators import diffuse_radiance
from gtao.lighting import EnvironmentMap, to_view
from gtao.plot import LightingView, MethodResult, SceneComparison

from .frames import RUNS, LightingFrame
from .lights import Light
from .methods import DENSE, ORDER, ORDERS, OURS, order_of
from .settings import CompareLightingConfig

__all__ = ["ALL", "CUTS", "LIMITS", "WINDOWED", "measure", "view"]

#: What the light is cut to -> highest band.
CUTS = {"order 2": 2, "order 4": 4}
#: The light as it is.
ALL = "all bands"
#: The same, but methods get it through a window that leaves no negative radiance.
WINDOWED = "all bands, windowed"
#: Group of what exact visibility makes of light that was cut: the error that the cut alone causes.
LIMITS = "exact visibility, light cut"

#: Methods that pictures show, if they take part; else as many of those that do.
PICTURED = (
    "occlusion",
    "bent-normal",
    "cone-seed",
    "clipped-cone-4",
    "moment-zh-4",
    "slice-moments",
    "slice-moments-4",
)

#: Errors relative to the mean of surfaces mean nothing where it is below this share of that of open surfaces.
DARK = 0.01


@dataclass(frozen=True, eq=False)
class _Image:
    """(n_pixels, 3) irradiance, and the variance of each number."""

    mean: np.ndarray
    variance: Any

    @classmethod
    def of(cls, runs: tuple[np.ndarray, np.ndarray], light: np.ndarray) -> "_Image":
        """Two independent runs of harmonics, or one twice, under light of some of their coefficients."""
        a, b = (run[:, : len(light)] @ light for run in runs)
        return cls((a + b) / 2, (a - b) ** 2 / 4)


def measure(
    frame: LightingFrame, light: Light, environment: EnvironmentMap, config: CompareLightingConfig
) -> tuple[dict[str, SceneComparison], np.ndarray] | None:
    """Every method under one light.

    Args:
        frame: the view.
        light: the light.
        environment: the light in the world of the scene.

    Returns:
        What the light is cut to -> errors of every method from every source of visibility, and the (H, W, 3) truth
        under all of the light. All errors are relative to its mean over the surface, and free of the noise of rays.
        None where hardly any light gets to the surface.
    """
    whole = to_view(environment.project(ORDER), render.view_to_world(frame.view.scene, frame.view.sensor))
    traced = render.irradiance(
        frame.view.scene,
        g=frame.view.g,
        max_distance=frame.view.radius,
        spp=config.spp,
        seed=(config.seed + RUNS) % 2**32,
        environment=environment,
        sensor=frame.view.sensor,
    )
    truth = traced.mean.numpy()
    if truth[frame.view.mask].mean() <= DARK * _open_mean(environment):
        return None
    truths = {cut: _Image.of(frame.truths, whole[: (order + 1) ** 2]) for cut, order in CUTS.items()}
    truths[ALL] = _Image(truth[frame.view.mask].astype(np.float64), traced.variance.numpy()[frame.view.mask])
    mean = float(truths[ALL].mean.mean())
    truths[WINDOWED] = truths[ALL]
    windowed = {order: light.windowed(whole, order) for order in ORDERS}
    comparisons = {}
    for cut, reference in truths.items():
        rows = []
        for source, methods in frame.harmonics.items():
            for name, runs in methods.items():
                given = windowed[order_of(name)] if cut == WINDOWED else whole[: (CUTS.get(cut, ORDER) + 1) ** 2]
                rows.append(_row(name, source, _Image.of(runs, given), reference, mean))
        if cut == ALL:
            rows += [_row(name, LIMITS, truths[name], reference, mean) for name in CUTS]
        comparisons[cut] = SceneComparison(
            name=frame.view.name,
            radius=frame.view.radius,
            truth=truth.mean(-1) / mean,
            mask=frame.view.mask,
            methods=rows,
            noise=evaluate.noise_floor(reference.variance) / mean,
        )
    return comparisons, truth


def _open_mean(environment: EnvironmentMap) -> float:
    """Irradiance of an open surface, averaged over all the ways that it can face and over the channels."""
    return float(environment.project(0).mean()) * math.sqrt(4 * math.pi) / 4


def _row(name: str, group: str, image: _Image, reference: _Image, mean: float) -> MethodResult:
    noise = image.variance + reference.variance
    metrics: dict[str, float | None] = {
        "rmse": evaluate.corrected_rmse(image.mean, reference.mean, noise) / mean,
        "bias": evaluate.bias(image.mean, reference.mean) / mean,
    }
    return MethodResult(name=name, label=name, metrics=metrics, group=group, ours=name in OURS)


def view(frame: LightingFrame, environment: EnvironmentMap, name: str, truth: np.ndarray) -> LightingView:
    """Pictures of the surface under one light, from dense slices, as a diffuse surface of its albedo shows it."""
    light = to_view(environment.project(ORDER), render.view_to_world(frame.view.scene, frame.view.sensor))
    albedo = frame.view.g.albedo

    def radiance(irradiance: np.ndarray) -> np.ndarray:
        return diffuse_radiance(frame.view.g.types.Tensor(irradiance.astype(np.float32)), albedo).numpy()

    methods = frame.harmonics[DENSE]
    images = {}
    for method in [name for name in PICTURED if name in methods] or list(methods)[: len(PICTURED)]:
        image = np.zeros(truth.shape)
        image[frame.view.mask] = methods[method][0] @ light
        images[method] = radiance(image)
    return LightingView(
        frame=frame.view.name,
        light=name,
        source=DENSE,
        mask=frame.view.mask,
        truth=radiance(truth),
        images=images,
    )
