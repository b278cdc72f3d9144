"""Fit of the reflection cone's aperture, cos α_s = u^(α²/2), to ray-traced specular occlusion.

Every sample's dissimilarity is tabulated over u once. What is fitted, to all samples, to some roughness, or to
bootstrap draws of scenes, is then the minimum of a mean of curves.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar

from gtao.errors import ConfigError, FitError
from gtao.evaluate import bootstrap_counts, bootstrap_interval, bootstrap_standard_error, dssim, rmse

__all__ = ["METRICS", "PUBLISHED_U", "ApertureFit", "ApertureSample", "Optimum", "aperture"]

#: Jimenez et al. 2016.
PUBLISHED_U = 0.01

#: Name -> dissimilarity of an image and the truth in a mask.
METRICS: Mapping[str, Callable[..., float]] = {"dssim": dssim, "rmse": rmse}

#: -ln u at which samples are tabulated: α_s grows like its root. From a cone of 0.3 rad at α = 1 to the whole sphere's.
KAPPA = np.geomspace(0.1, 25.0, 29)

#: Fewer scenes cannot tell how much scenes differ.
FEWEST_SCENES = 3


@dataclass(frozen=True, kw_only=True, eq=False)
class ApertureSample:
    """One view at one roughness.

    Attributes:
        scene: scenes are resampled and left out as wholes.
        view: name of the view.
        roughness: perceptual, in [0, 1].
        truth: (H, W) specular occlusion.
        mask: (H, W) pixels that count.
        occlusion: u -> (H, W) specular occlusion by two cones.
        rivals: name -> (H, W) specular occlusion of something else that is to be scored; the same names everywhere.
    """

    scene: str
    view: str
    roughness: float
    truth: np.ndarray
    mask: np.ndarray
    occlusion: Callable[[float], np.ndarray]
    rivals: Mapping[str, np.ndarray] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Optimum:
    """The best u for some of the samples.

    Attributes:
        u: share of the cone, in (0, 1).
        score: mean dissimilarity there.
        published: mean dissimilarity at u = 0.01.
        at_bound: whether it lies at an end of what was searched, so that the best may lie beyond.
    """

    u: float
    score: float
    published: float
    at_bound: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class ApertureFit:
    """A fitted aperture.

    Attributes:
        metric: key of :data:`METRICS`.
        best: of all samples.
        by_roughness: of the samples of each roughness.
        interval: of u at confidence ``level``, by the bootstrap over scenes; None without draws.
        standard_error: of ln(-ln u), likewise.
        level: of the interval.
        left_out: scene -> best of all others, its score that of the scene itself at their u.
        grid: (n,) u that were tabulated, falling.
        curves: (n_samples, n) dissimilarity of every sample.
        samples: (scene, view, roughness) of every curve.
        rivals: name -> mean dissimilarity of the samples' rivals.
    """

    metric: str
    best: Optimum
    by_roughness: Mapping[float, Optimum]
    interval: tuple[float, float] | None
    standard_error: float | None
    level: float
    left_out: Mapping[str, Optimum]
    grid: np.ndarray
    curves: np.ndarray
    samples: tuple[tuple[str, str, float], ...]
    rivals: Mapping[str, float]

    @property
    def exponent(self) -> float:
        """k of cos α_s = 2^(-k α²): 3.32193 for the published u."""
        return -math.log2(self.best.u) / 2

    def to_dict(self) -> dict[str, Any]:
        """Plain values, as records keep them."""
        return {
            "metric": self.metric,
            "best": vars(self.best),
            "exponent": self.exponent,
            "interval": None if self.interval is None else list(self.interval),
            "standard_error_of_log_log": self.standard_error,
            "level": self.level,
            "by_roughness": {f"{r:g}": vars(found) for r, found in self.by_roughness.items()},
            "left_out": {scene: vars(found) for scene, found in self.left_out.items()},
            "rivals": dict(self.rivals),
            "grid": self.grid.tolist(),
            "curves": [
                {"scene": s, "view": v, "roughness": r, "score": curve.tolist()}
                for (s, v, r), curve in zip(self.samples, self.curves, strict=True)
            ],
        }


def aperture(
    samples: Sequence[ApertureSample],
    *,
    metric: str = "dssim",
    n_bootstrap: int = 1000,
    level: float = 0.95,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> ApertureFit:
    """The u whose specular occlusion by two cones is nearest to the truth, in the mean over scenes.

    Every scene counts once, its views and roughness alike within it.

    Args:
        samples: what was traced, of any number of scenes.
        metric: "dssim", (1 - SSIM) / 2 as published, or "rmse".
        n_bootstrap: draws of scenes; 0 for none. With fewer than three scenes there are none.
        level: of the interval, in (0, 1).
        seed: of the bootstrap.
        progress: called as ``progress(done, total)``.

    Raises:
        ConfigError: the metric is unknown, or draws or level are out of range.
        FitError: there are no samples, or an occlusion is not finite.
        ShapeError: an image has another shape than its truth, or too few pixels for the metric.
    """
    if metric not in METRICS:
        raise ConfigError(f"metric must be one of {', '.join(METRICS)}, got {metric!r}")
    if n_bootstrap < 0:
        raise ConfigError(f"n_bootstrap must be 0 or more, got {n_bootstrap}")
    if not samples:
        raise FitError("there is nothing to fit to; give at least one sample")
    curves, others = [], []
    for i, sample in enumerate(samples):
        if progress:
            progress(i, len(samples))
        score = partial(_score, sample, METRICS[metric])
        curves.append([score(f"u = {u:g}", sample.occlusion(float(u))) for u in np.exp(-KAPPA)])
        others.append([score(name, image) for name, image in sample.rivals.items()])
    if progress:
        progress(len(samples), len(samples))
    table = np.array(curves)
    scenes = list(dict.fromkeys(s.scene for s in samples))
    member = np.array([[s.scene == scene for s in samples] for scene in scenes], dtype=float)
    share = member / member.sum(1, keepdims=True)
    rows = share @ table
    interval, error = None, None
    if n_bootstrap and len(scenes) >= FEWEST_SCENES:
        counts = bootstrap_counts(len(scenes), n_bootstrap, seed)
        draws = np.array([math.log(_minimum(c @ rows / len(scenes))[0]) for c in counts])
        ends = bootstrap_interval(draws, len(scenes), level)
        high, low = (math.exp(-math.exp(float(end))) for end in ends)
        interval, error = (low, high), float(bootstrap_standard_error(draws, len(scenes)))
    rough = list(dict.fromkeys(s.roughness for s in samples))
    return ApertureFit(
        metric=metric,
        best=_optimum(rows.mean(0)),
        by_roughness={r: _optimum(_of(table, member, np.array([s.roughness == r for s in samples]))) for r in rough},
        interval=interval,
        standard_error=error,
        level=level,
        left_out={} if len(scenes) < 2 else {scene: _left_out(rows, i) for i, scene in enumerate(scenes)},
        grid=np.exp(-KAPPA),
        curves=table,
        samples=tuple((s.scene, s.view, s.roughness) for s in samples),
        rivals=dict(zip(samples[0].rivals, map(float, (share @ np.array(others)).mean(0)), strict=True)),
    )


def _score(sample: ApertureSample, metric: Callable[..., float], what: str, image: np.ndarray) -> float:
    image = np.asarray(image, dtype=np.float64)
    if not np.isfinite(image[sample.mask]).all():
        raise FitError(f"the occlusion of {sample.view} at roughness {sample.roughness:g} is not finite for {what}")
    return metric(image, sample.truth, mask=sample.mask)


def _of(table: np.ndarray, member: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Mean curve over scenes of some of the samples."""
    own = member * chosen
    counts = own.sum(1)
    return (own[counts > 0] / counts[counts > 0, None] @ table).mean(0)


def _left_out(rows: np.ndarray, i: int) -> Optimum:
    found = _optimum(np.delete(rows, i, 0).mean(0))
    own = CubicSpline(np.log(KAPPA), rows[i])
    score, published = (float(own(math.log(-math.log(u)))) for u in (found.u, PUBLISHED_U))
    return Optimum(u=found.u, score=score, published=published, at_bound=found.at_bound)


def _optimum(curve: np.ndarray) -> Optimum:
    kappa, score, at_bound = _minimum(curve)
    published = float(CubicSpline(np.log(KAPPA), curve)(math.log(-math.log(PUBLISHED_U))))
    return Optimum(u=math.exp(-kappa), score=score, published=published, at_bound=at_bound)


def _minimum(curve: np.ndarray) -> tuple[float, float, bool]:
    """-ln u and value of the lowest point of the spline through a tabulated curve, and whether that is an end."""
    x = np.log(KAPPA)
    spline = CubicSpline(x, curve)
    k = int(np.argmin(curve))
    if k in (0, len(x) - 1):
        return float(KAPPA[k]), float(curve[k]), True
    found = minimize_scalar(spline, bounds=(x[k - 1], x[k + 1]), method="bounded", options={"xatol": 1e-6})
    return math.exp(found.x), float(found.fun), False
