"""Minimisation of the objective: quasi-Newton steps by gradients and differences, and a compass search at the end.

Options that decide which texels are read have no derivative: their loss is a staircase, fine because it is a mean over
many samples. Differences over many stairs say where it falls. They make up the gradient together with the derivatives
of the other options, because the two kinds depend on each other: a falloff that begins later wants another radius, and
moving one at a time ends on the valley's side. On the last stairs a compass search goes on.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy import optimize

from .tuning_objective import Objective

__all__ = ["Descent", "minimise"]

#: First and last step of the compass search, in coordinates: from a twentieth of a value to half a percent of it.
FIRST_STEP, LAST_STEP = 0.05, 0.005

#: Iterations of L-BFGS-B at once: where stairs end it early, the compass search helps it on.
MOST_ITERATIONS = 30


@dataclass(eq=False)
class Descent:
    """Where a minimisation went.

    Attributes:
        coordinates: (parameters,) of the best point so far.
        loss: there.
        differentiable: the coordinates that went by their derivative.
        history: (evaluations so far, best loss so far, "start", "descent" or "search") of every improvement.
        converged: whether it ended because nothing improved any more.
    """

    coordinates: np.ndarray
    loss: float
    differentiable: tuple[int, ...] = ()
    history: list[tuple[int, float, str]] = field(default_factory=list)
    converged: bool = False

    def take(self, coordinates: np.ndarray, loss: float, n_evaluations: int, kind: str) -> None:
        """Remember a point if it is the best."""
        if not self.history or loss < self.loss:
            self.coordinates, self.loss = np.array(coordinates, dtype=float), loss
            self.history.append((n_evaluations, loss, kind))


def minimise(objective: Objective, tolerance: float, max_rounds: int, progress: Callable[[int, int], None]) -> Descent:
    """Minimise the loss between its bounds, from where its space starts.

    L-BFGS-B over all coordinates, and then a compass search over those without a usable derivative: where that still
    gains, both once more, until it has come to its last step.

    Args:
        objective: the loss.
        tolerance: relative gain of the compass search that is worth another round.
        max_rounds: of both.
        progress: called as ``progress(rounds, max_rounds)``.

    Raises:
        FitError: the estimate is not finite somewhere on the way.
    """
    start = objective.space.start
    descent = Descent(start, np.inf)
    descent.take(start, objective.loss(start), objective.n_evaluations, "start")
    descent.differentiable = objective.differentiable(start)
    stepped = tuple(i for i in range(start.size) if i not in descent.differentiable)
    step, again = FIRST_STEP, True
    for done in range(max_rounds):
        progress(done, max_rounds)
        if again:
            again = _quasi_newton(objective, descent)
        before = descent.loss
        _compass(objective, descent, stepped, step)
        if descent.loss < before * (1 - tolerance):
            again = True
        elif not again and (not stepped or step <= LAST_STEP):
            descent.converged = True
            break
        else:
            step = max(step / 2, LAST_STEP)
    progress(max_rounds, max_rounds)
    return descent


def _quasi_newton(objective: Objective, descent: Descent) -> bool:
    """L-BFGS-B from the best point; whether it could have gone on."""
    chosen = list(descent.differentiable)
    rest = [i for i in range(descent.coordinates.size) if i not in chosen]

    def value(point: np.ndarray) -> tuple[float, np.ndarray]:
        gradient = np.zeros(point.size)
        if chosen:
            loss, gradient[chosen] = objective.loss_and_gradient(point, chosen)
        else:
            loss = objective.loss(point)
        gradient[rest] = [objective.difference(point, i) for i in rest]
        descent.take(point, loss, objective.n_evaluations, "descent")
        # L-BFGS-B judges gradients by absolute size, and losses here are small.
        return loss / scale, gradient / scale

    scale = descent.loss if descent.loss > 0 else 1.0
    bounds = list(zip(objective.space.lower, objective.space.upper, strict=True))
    options = {"maxiter": MOST_ITERATIONS, "ftol": 1e-9, "gtol": 1e-6}
    if rest:  # on a staircase neither small gains nor long line searches find anything
        options |= {"ftol": 1e-6, "maxls": 8}
    ended = optimize.minimize(value, descent.coordinates, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
    return ended.status == 1


def _compass(objective: Objective, descent: Descent, chosen: tuple[int, ...], step: float) -> None:
    """One poll of both sides of every coordinate, going on while a side keeps improving."""
    for i in chosen:
        for side in (step, -step):
            improved = False
            while True:
                trial = descent.coordinates.copy()
                trial[i] = np.clip(trial[i] + side, objective.space.lower[i], objective.space.upper[i])
                if trial[i] == descent.coordinates[i]:
                    break
                loss = objective.loss(trial)
                if not loss < descent.loss:
                    break
                descent.take(trial, loss, objective.n_evaluations, "search")
                improved = True
            if improved:
                break
