"""What a tuning returns."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

__all__ = ["Candidate", "Fold", "TunedParameter", "TuningResult", "TuningScores"]


@dataclass(frozen=True, kw_only=True)
class TunedParameter:
    """One tuned option, in the unit of ``gtao.fit.CONTINUOUS``.

    Attributes:
        path: dotted name.
        unit: "" for plain numbers, "radius" for multiples of it, or the option that it is a share of.
        start, value: before and after.
        low, high: bounds.
        by: "gradient" or "differences": where its slope came from.
        standard_error, interval: from the bootstrap over scenes; None without one, and at a bound.
    """

    path: str
    unit: str
    start: float
    value: float
    low: float
    high: float
    by: str
    standard_error: float | None = None
    interval: tuple[float, float] | None = None

    @property
    def at_bound(self) -> bool:
        """Whether the data want more than the bounds allow."""
        return self.value in (self.low, self.high)


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """One combination of discrete options, tuned.

    Attributes:
        choice: path -> value.
        taps: depth samples per pixel.
        loss: mean squared error on the scenes of the tuning.
        values: of the tuned options.
        n_evaluations: of the loss.
        converged: whether nothing improved any more when it ended.
    """

    choice: dict[str, Any]
    taps: int
    loss: float
    values: dict[str, float]
    n_evaluations: int
    converged: bool


@dataclass(frozen=True, kw_only=True)
class Fold:
    """A tuning that some scenes took no part in.

    Attributes:
        left_out: their names.
        choice: discrete options that won.
        values: of the tuned options.
    """

    left_out: tuple[str, ...]
    choice: dict[str, Any]
    values: dict[str, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class TuningScores:
    """RMSE per view, with the noise of the truth taken out where its variance is known.

    Attributes:
        views: names.
        scenes: scene of each view.
        held_out: (views,) bool: no tuning ever saw the view.
        rmse: label -> (views,): "start"; "tuned", fitted to all scenes that are not held out; "unseen", a tuning that
            did not see the view: of its fold, or of all where it is held out (NaN without folds); rivals by name.
        unfiltered: the same without the spatial filter; None where there is none.
    """

    views: tuple[str, ...]
    scenes: tuple[str, ...]
    held_out: np.ndarray
    rmse: dict[str, np.ndarray]
    unfiltered: dict[str, np.ndarray] | None

    def summary(self, rival: str, *, held_out: bool, filtered: bool = True) -> dict[str, Any]:
        """Unseen views against a rival.

        Args:
            rival: a label.
            held_out: over the held-out views, else over those of the folds.
            filtered: as the method is, else without its spatial filter.

        Returns:
            "n_views"; "unseen" and "rival", root mean square over views; "ratio" of the two; "wins"; "difference" of
            the mean RMSE and its "standard_error" over scenes (None for one). Empty without such views.
        """
        table = self.rmse if filtered or self.unfiltered is None else self.unfiltered
        chosen = (self.held_out == held_out) & ~np.isnan(table["unseen"])
        if not chosen.any():
            return {}
        ours, theirs = table["unseen"][chosen], table[rival][chosen]
        names = np.array(self.scenes)[chosen]
        change = np.array([(ours - theirs)[names == scene].mean() for scene in dict.fromkeys(names.tolist())])
        error = float(change.std(ddof=1) / math.sqrt(change.size)) if change.size > 1 else None
        rms = [float(np.sqrt(np.mean(values**2))) for values in (ours, theirs)]
        return {
            "n_views": int(chosen.sum()),
            "unseen": rms[0],
            "rival": rms[1],
            "ratio": rms[0] / rms[1],
            "wins": int((ours < theirs).sum()),
            "difference": float(change.mean()),
            "standard_error": error,
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class TuningResult:
    """Tuned options and how far to trust them.

    Attributes:
        method: the configuration with them, at the radius that it came with; :func:`gtao.fit.at_radius` gives it for
            another.
        parameters: what was tuned.
        choice: discrete options that won.
        start_loss, loss: weighted mean squared error over the scenes of the tuning, before and after.
        history: (evaluations, best loss, "start", "descent" or "search") of every improvement.
        candidates: all combinations of discrete options, best first.
        folds: tunings that left scenes out.
        scores: errors per view.
        n_evaluations: of the loss, the folds' among them.
        converged: whether nothing improved any more when it ended.
    """

    method: Any
    parameters: tuple[TunedParameter, ...]
    choice: dict[str, Any]
    start_loss: float
    loss: float
    history: tuple[tuple[int, float, str], ...]
    candidates: tuple[Candidate, ...]
    folds: tuple[Fold, ...]
    scores: TuningScores
    n_evaluations: int
    converged: bool

    @property
    def values(self) -> dict[str, float]:
        """Tuned values by path."""
        return {p.path: p.value for p in self.parameters}

    def to_dict(self) -> dict[str, Any]:
        """All numbers as plain values, ready for a record; NaN becomes None."""
        return {
            "method": self.method.to_dict(),
            "choice": _plain(self.choice),
            "parameters": {
                p.path: {k: v for k, v in asdict(p).items() if k != "path"} | {"at_bound": p.at_bound}
                for p in self.parameters
            },
            "start_loss": self.start_loss,
            "loss": self.loss,
            "converged": self.converged,
            "n_evaluations": self.n_evaluations,
            "history": [list(entry) for entry in self.history],
            "candidates": [asdict(c) | {"choice": _plain(c.choice)} for c in self.candidates],
            "folds": [asdict(f) | {"left_out": list(f.left_out), "choice": _plain(f.choice)} for f in self.folds],
            "scores": {
                "views": list(self.scores.views),
                "scenes": list(self.scores.scenes),
                "held_out": self.scores.held_out.tolist(),
                "rmse": _lists(self.scores.rmse),
                "unfiltered_rmse": None if self.scores.unfiltered is None else _lists(self.scores.unfiltered),
            },
        }


def _plain(choice: Mapping[str, Any]) -> dict[str, Any]:
    return {path: value.to_dict() if hasattr(value, "to_dict") else value for path, value in choice.items()}


def _lists(table: Mapping[str, np.ndarray]) -> dict[str, list[float | None]]:
    return {label: [None if math.isnan(v) else float(v) for v in values] for label, values in table.items()}
