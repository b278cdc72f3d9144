"""One tuning: every combination of discrete options descends, and the lowest loss wins."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

from gtao.config import SliceMethod
from gtao.errors import ConfigError

from .tuning_objective import Objective
from .tuning_options import with_options
from .tuning_problem import Problem
from .tuning_result import Candidate
from .tuning_search import Descent, minimise
from .tuning_space import Bounds, Space

__all__ = ["Candidates", "Settings", "Tuned", "combinations", "fit_candidates"]

#: Choices of discrete options, and the method with each.
Candidates = tuple[tuple[dict[str, Any], Any], ...]


@dataclass(frozen=True)
class Settings:
    """What every tuning of one call has in common.

    Attributes:
        parameters: continuous options with bounds.
        candidates: what is tuned in turn.
        frames: frame indices of the noise.
        tolerance, max_rounds: of :func:`gtao.fit.tuning_search.minimise`.
    """

    parameters: Mapping[str, Bounds]
    candidates: Candidates
    frames: tuple[int, ...]
    tolerance: float
    max_rounds: int


@dataclass(frozen=True, eq=False)
class Tuned:
    """The winner of a tuning, and everything that was tried."""

    objective: Objective
    descent: Descent
    choice: dict[str, Any]
    candidates: tuple[Candidate, ...]

    @property
    def values(self) -> dict[str, float]:
        return self.objective.space.values(self.descent.coordinates)

    def at(self, radius: float | None) -> Any:
        """The tuned method for a radius; None for that of the method it began with."""
        return self.objective.space.build(self.descent.coordinates, radius)


def _taps(method: Any) -> int:
    occlusion = getattr(method, "occlusion", method)
    return 2 * occlusion.n_slices * occlusion.n_steps


def combinations(method: Any, search: Mapping[str, Sequence[Any]], max_taps: int | None) -> Candidates:
    """All choices of discrete options with the methods that they make, within the budget.

    Raises:
        ConfigError: an option does not exist or does not take a value, or no combination is left.
    """
    occlusion = getattr(method, "occlusion", method)
    if not isinstance(occlusion, SliceMethod):
        raise ConfigError(f"only methods that march slices can be tuned, got {type(occlusion).__name__}")
    for path, values in search.items():
        if isinstance(values, str) or not isinstance(values, Sequence) or not values:
            raise ConfigError(f"search of {path} needs a list of values to try, got {values!r}")
    made = []
    for values in product(*search.values()):
        choice = dict(zip(search, values, strict=True))
        made.append((choice, with_options(method, choice)))
    within = tuple(m for m in made if max_taps is None or _taps(m[1]) <= max_taps)
    if not within:
        fewest = min(_taps(candidate) for _, candidate in made)
        raise ConfigError(f"no combination reads at most {max_taps} depth samples per pixel; the least is {fewest}")
    return within


def fit_candidates(problems: Sequence[Problem], settings: Settings, progress: Callable[[int, int], None]) -> Tuned:
    """Tune every combination on the problems.

    Args:
        problems: the views that count.
        settings: what to tune.
        progress: called as ``progress(done, total)``, in rounds.
    """
    tried: list[tuple[Objective, Descent, dict[str, Any], Candidate]] = []
    total = len(settings.candidates) * settings.max_rounds
    for k, (choice, method) in enumerate(settings.candidates):

        def step(done: int, _: int, first: int = k * settings.max_rounds) -> None:
            progress(first + done, total)

        objective = Objective(problems, Space.where_possible(method, settings.parameters), settings.frames)
        descent = minimise(objective, settings.tolerance, settings.max_rounds, step)
        candidate = Candidate(
            choice=choice,
            taps=_taps(method),
            loss=descent.loss,
            values=objective.space.values(descent.coordinates),
            n_evaluations=objective.n_evaluations,
            converged=descent.converged,
        )
        tried.append((objective, descent, choice, candidate))
    tried.sort(key=lambda entry: entry[3].loss)
    objective, descent, choice, _ = tried[0]
    return Tuned(objective, descent, choice, tuple(entry[3] for entry in tried))
