"""The rungs between ray-traced truth and an estimate, and what each step down costs."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gtao.config import HBAO, HeightfieldHorizon, HeightfieldRayMarch, Pipeline, faithful, with_budget
from gtao.estimators import ambient_occlusion
from gtao.evaluate import ErrorBudget, error_budget

from .frames import Frame
from .settings import CompareConfig

__all__ = ["DENSE", "Field", "budget_of", "height_field"]

#: Slices and steps per side of a dense estimate.
DENSE = (32, 32)

TRUTH = "ray-traced truth"


@dataclass(frozen=True, eq=False)
class Field:
    """What the depth buffer alone can know, (H, W) each, with variances.

    Attributes:
        wide: ray march of the frame with its guard band; equal to ``inside`` without one.
        inside: ray march of the frame.
        horizon: the same by dense slices and quadrature.
    """

    wide: np.ndarray
    wide_variance: np.ndarray
    inside: np.ndarray
    inside_variance: np.ndarray
    horizon: np.ndarray


def height_field(frame: Frame, config: CompareConfig) -> Field:
    """Both screen-space ground truths of a frame."""
    march = HeightfieldRayMarch(
        radius=frame.radius,
        n_directions=config.n_directions,
        rays_per_direction=config.rays_per_direction,
        seed=config.seed,
    )
    inside = ambient_occlusion(frame.g, march)
    v, variance = inside.visibility.numpy(), inside.variance.numpy()
    wide, wide_variance = v, variance
    if frame.wide is not None:
        # Another seed: noise that two rungs share would hide in their difference.
        banded = ambient_occlusion(frame.wide, replace(march, seed=config.seed + 1))
        wide, wide_variance = frame.inner(banded.visibility.numpy()), frame.inner(banded.variance.numpy())
    horizon = ambient_occlusion(frame.g, HeightfieldHorizon(radius=frame.radius, seed=config.seed))
    return Field(wide, wide_variance, v, variance, horizon.visibility.numpy())


def budget_of(pipeline: Pipeline, frame: Frame, field: Field) -> ErrorBudget:
    """What each step from the truth to the result of ``pipeline`` costs.

    The rungs: ray-traced truth; the height field with a guard band; the height field of the frame alone; its dense
    horizon integral; the faithful method of the same family, dense; the method with all its heuristics, dense; the
    method as it is; its filtered and clamped result.
    """

    def estimate(candidate: Pipeline, dense: bool) -> np.ndarray:
        if dense:
            candidate = replace(with_budget(candidate, *DENSE), spatial=None, clamp=False)
        return candidate.step(frame.g).visibility.numpy()

    rungs: dict[str, Any] = {TRUTH: frame.truth, "one depth layer": field.wide}
    variances: dict[str, Any] = {TRUTH: frame.variance, "one depth layer": field.wide_variance}
    if frame.wide is not None:
        rungs["frame's edge"] = field.inside
        variances["frame's edge"] = field.inside_variance
    rungs["horizon integral"] = field.horizon
    if not isinstance(pipeline.occlusion, HBAO | HeightfieldRayMarch):
        rungs["closed form"] = estimate(replace(pipeline, occlusion=faithful(pipeline.occlusion)), dense=True)
    rungs["heuristics"] = estimate(pipeline, dense=True)
    rungs["sampling"] = ambient_occlusion(frame.g, pipeline.occlusion).visibility.numpy()
    if pipeline.spatial is not None or pipeline.clamp:
        rungs["filter"] = estimate(pipeline, dense=False)
    return error_budget(rungs, variances=variances, mask=frame.mask)
