"""Tuning: fit the options of an estimator to ground truth."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from gtao.errors import ConfigError

from .tuning_candidates import Candidates, Settings, combinations, fit_candidates
from .tuning_objective import mean_squares
from .tuning_options import with_continuous
from .tuning_problem import Problem
from .tuning_result import Fold, TuningResult
from .tuning_scoring import score, tuned_parameters
from .tuning_space import Bounds, Space
from .tuning_spread import MIN_SCENES

__all__ = ["check_tuning", "tune"]

Report = Callable[[str, int, int], None]


def tune(
    problems: Iterable[Problem],
    method: Any,
    parameters: Mapping[str, Bounds] | Iterable[str],
    *,
    search: Mapping[str, Sequence[Any]] | None = None,
    max_taps: int | None = None,
    held_out: Iterable[str] = (),
    folds: int = 0,
    rivals: Mapping[str, Any] | None = None,
    frames: Sequence[int] = (0,),
    n_bootstrap: int = 0,
    level: float = 0.95,
    seed: int = 0,
    tolerance: float = 1e-4,
    max_rounds: int = 20,
    progress: Report | None = None,
) -> TuningResult:
    """Fit options of an estimator to the truth of several views, by gradients where the estimator has them.

    What is minimised is the mean over views of the mean squared error over surface pixels (theory, eq. (96)), by
    L-BFGS-B. Options with a derivative go by reverse-mode differentiation; those that decide which texels are read
    have none, and go by wide differences of the error and, in the end, a compass search. Lengths count in radii, so
    that views of several radii are fitted by one set of numbers.

    Args:
        problems: views with truth.
        method: a configuration, or a :class:`gtao.Pipeline`, whose filter then is part of the fit. Where problems have
            a radius it must have a finite one, and its lengths scale along.
        parameters: continuous options by the paths and units of ``gtao.fit.CONTINUOUS``, optionally with bounds.
        search: discrete options by path, with the values to try; every combination is tuned in those parameters that
            it has, and the best on the tuning's own scenes is taken.
        max_taps: combinations that read more depth samples per pixel are left out.
        held_out: scenes that are only scored.
        folds: parts that the other scenes are split into at random; each is scored by a tuning, search included, on
            the rest. 0 for none.
        rivals: other methods to score, by name.
        frames: frame indices of the noise that every view is estimated with.
        n_bootstrap: draws of the bootstrap over scenes for standard errors; 0 for none.
        level: of the intervals.
        seed: of folds and bootstrap.
        tolerance: relative gain of the loss below which a round of steps ends the tuning.
        max_rounds: of gradient steps and searches.
        progress: called as ``progress(task, done, total)``.

    Returns:
        The tuned method with errors per view, before, after and unseen.

    Raises:
        ConfigError: an option does not exist or starts outside of its bounds, a scene to hold out is unknown, or the
            scenes do not suffice for the folds or the bootstrap.
        FitError: the estimate is not finite somewhere on the way.
    """
    problems, held_out, rivals = tuple(problems), tuple(held_out), dict(rivals or {})
    kept = _kept(problems, held_out)
    scenes = tuple(dict.fromkeys(p.scene for p in kept))
    _check(scenes, folds, n_bootstrap, frames, max_rounds, rivals)
    bounds, candidates = check_tuning(method, parameters, search or {}, max_taps)
    settings = Settings(bounds, candidates, tuple(frames), tolerance, max_rounds)
    report = progress or (lambda *_: None)

    whole = fit_candidates(kept, settings, partial(report, "tuning"))
    parts = np.array_split(np.random.default_rng(seed).permutation(len(scenes)), folds) if folds else []
    left = []
    for k, part in enumerate(parts):
        names = tuple(scenes[i] for i in sorted(part))
        rest = [p for p in kept if p.scene not in names]
        left.append((names, fit_candidates(rest, settings, partial(report, f"fold {k + 1} of {folds}"))))
    before = mean_squares(kept, partial(with_continuous, method, {}), frames)
    return TuningResult(
        method=whole.at(None),
        parameters=tuned_parameters(whole, n_bootstrap, level, seed),
        choice=whole.choice,
        start_loss=float(np.average(before, weights=[p.weight for p in kept])),
        loss=whole.descent.loss,
        history=tuple(whole.descent.history),
        candidates=whole.candidates,
        folds=tuple(Fold(left_out=names, choice=t.choice, values=t.values) for names, t in left),
        scores=score(problems, set(held_out), method, whole, left, rivals, frames),
        n_evaluations=sum(c.n_evaluations for t in (whole, *(t for _, t in left)) for c in t.candidates),
        converged=whole.descent.converged,
    )


def _kept(problems: tuple[Problem, ...], held_out: tuple[str, ...]) -> tuple[Problem, ...]:
    """The problems to fit to."""
    names = [p.name for p in problems]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ConfigError(f"problems given more than once: {', '.join(twice)}")
    if unknown := sorted(set(held_out) - {p.scene for p in problems}):
        raise ConfigError(f"no problem is of scene {', '.join(unknown)}, which is to be held out")
    kept = tuple(p for p in problems if p.scene not in held_out)
    if not kept:
        raise ConfigError("there is no scene to tune on; give problems that are not held out")
    return kept


def _check(
    scenes: tuple[str, ...], folds: int, n_bootstrap: int, frames: Sequence[int], max_rounds: int, rivals: dict
) -> None:
    if folds != 0 and not 2 <= folds <= len(scenes):
        raise ConfigError(f"folds must be 0 (none) or from 2 to the number of scenes, {len(scenes)}, got {folds}")
    if n_bootstrap < 0 or n_bootstrap == 1:
        raise ConfigError(f"n_bootstrap must be 0 (none) or at least 2, got {n_bootstrap}")
    if n_bootstrap and len(scenes) < MIN_SCENES:
        raise ConfigError(f"the bootstrap needs at least {MIN_SCENES} scenes, got {len(scenes)}; use n_bootstrap=0")
    if not frames:
        raise ConfigError("there must be at least one noise frame; give frames=(0,)")
    if max_rounds < 1:
        raise ConfigError(f"max_rounds must be at least 1, got {max_rounds}")
    if taken := sorted({"start", "tuned", "unseen"} & set(rivals)):
        raise ConfigError(f"a rival cannot be called {taken[0]}; choose another name")


def check_tuning(
    method: Any,
    parameters: Mapping[str, Bounds] | Iterable[str],
    search: Mapping[str, Sequence[Any]],
    max_taps: int | None = None,
) -> tuple[dict[str, Bounds], Candidates]:
    """Check what :func:`tune` is to do before there is anything to do it on.

    Args:
        method, parameters, search, max_taps: of :func:`tune`.

    Returns:
        Bounds by path, and every choice of discrete options with the method that it makes.

    Raises:
        ConfigError: as :func:`tune`.
    """
    if isinstance(parameters, str):
        raise ConfigError(f"parameters must be a sequence of names, got the string {parameters!r}")
    bounds = dict(parameters) if isinstance(parameters, Mapping) else dict.fromkeys(parameters)
    if both := sorted(set(bounds) & set(search)):
        raise ConfigError(f"{', '.join(both)} cannot be both tuned and searched")
    candidates = combinations(method, search, max_taps)
    Space(method, bounds)
    for _, candidate in candidates:
        Space.where_possible(candidate, bounds)
    return bounds, candidates
