"""Errors of tuned methods and their rivals per view, and the spread of what was tuned over scenes."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from gtao.config import Pipeline
from gtao.evaluate import bootstrap_interval, bootstrap_standard_error

from .tuning_candidates import Tuned
from .tuning_objective import mean_squares, unfiltered
from .tuning_options import CONTINUOUS, with_continuous
from .tuning_problem import Problem
from .tuning_result import TunedParameter, TuningScores
from .tuning_spread import scene_draws

__all__ = ["score", "tuned_parameters"]

_LABELS = ("start", "tuned", "unseen")

At = Callable[[float | None], Any]


def score(
    problems: Sequence[Problem],
    held_out: set[str],
    start: Any,
    whole: Tuned,
    folds: Sequence[tuple[tuple[str, ...], Tuned]],
    rivals: Mapping[str, Any],
    frames: Sequence[int],
) -> TuningScores:
    """RMSE of the method before and after, of what was tuned without each view, and of rivals.

    Args:
        problems: all views.
        held_out: names of the scenes that no tuning saw.
        start: the method as it was given.
        whole: the tuning on all scenes but those.
        folds: names of the scenes left out, and the tuning without them.
        rivals: methods by name.
        frames: frame indices of the noise.
    """
    unseen_by = {scene: tuned for names, tuned in folds for scene in names}
    unseen_by |= dict.fromkeys(held_out, whole)
    methods: dict[str, At] = {"start": partial(with_continuous, start, {}), "tuned": whole.at}
    methods |= {name: partial(with_continuous, rival, {}) for name, rival in rivals.items()}
    filtered = any(isinstance(m, Pipeline) and m.spatial is not None for m in (start, whole.at(None), *rivals.values()))

    def table(change: Callable[[Any], Any]) -> dict[str, np.ndarray]:
        def rmse(views: Sequence[Problem], at: At) -> np.ndarray:
            squares = mean_squares(views, lambda radius: change(at(radius)), frames)
            return np.sqrt(np.maximum(squares - [p.noise for p in views], 0))

        found = {label: rmse(problems, at) for label, at in methods.items()}
        unseen = np.full(len(problems), np.nan)
        for tuned in dict.fromkeys(unseen_by.values()):
            chosen = [i for i, p in enumerate(problems) if unseen_by.get(p.scene) is tuned]
            unseen[chosen] = rmse([problems[i] for i in chosen], tuned.at)
        return {"start": found.pop("start"), "tuned": found.pop("tuned"), "unseen": unseen} | found

    return TuningScores(
        views=tuple(p.name for p in problems),
        scenes=tuple(p.scene for p in problems),
        held_out=np.array([p.scene in held_out for p in problems]),
        rmse=table(lambda method: method),
        unfiltered=table(unfiltered) if filtered else None,
    )


def tuned_parameters(tuned: Tuned, n_bootstrap: int, level: float, seed: int) -> tuple[TunedParameter, ...]:
    """What was tuned, with standard errors from resampled scenes.

    Args:
        tuned: the tuning.
        n_bootstrap: draws; 0 for no errors.
        level: of the intervals.
        seed: of the draws.
    """
    space, optimum = tuned.objective.space, tuned.descent.coordinates
    known = np.zeros(optimum.size, bool)
    errors = low = high = np.full(optimum.size, np.nan)
    if n_bootstrap:
        known = (optimum > space.lower) & (optimum < space.upper)
        n_scenes, losses = _per_scene(tuned)
        draws = scene_draws(losses, optimum, (space.lower, space.upper), n_bootstrap, seed)
        values = np.array([list(space.values(draw).values()) for draw in draws])
        errors = bootstrap_standard_error(values, n_scenes)
        low, high = bootstrap_interval(values, n_scenes, level)
    found = []
    for i, (p, value) in enumerate(zip(space.parameters, tuned.values.values(), strict=True)):
        found.append(
            TunedParameter(
                path=p.path,
                unit=CONTINUOUS[p.path].unit,
                start=p.start,
                value=value,
                low=p.low,
                high=p.high,
                by="gradient" if i in tuned.descent.differentiable else "differences",
                standard_error=float(errors[i]) if known[i] else None,
                interval=(float(low[i]), float(high[i])) if known[i] else None,
            )
        )
    return tuple(found)


def _per_scene(tuned: Tuned) -> tuple[int, Callable[[np.ndarray], np.ndarray]]:
    """How many scenes there are, and coordinates -> their parts of the loss."""
    problems = tuned.objective.problems
    scenes = list(dict.fromkeys(p.scene for p in problems))
    share = np.zeros((len(scenes), len(problems)))
    for i, p in enumerate(problems):
        share[scenes.index(p.scene), i] = p.weight
    share /= share.sum()
    return len(scenes), lambda u: share @ tuned.objective.losses(u)
