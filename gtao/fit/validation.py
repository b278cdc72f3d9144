"""Which form is worth using: errors on scenes that the fit has not seen, beside the published coefficients.

Leave-one-scene-out: each scene is scored with coefficients from all the others. The published coefficients
and the closed forms have nothing to fit, so that their training and left-out errors are the same.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gtao.data.multibounce import JIMENEZ2016, MultibounceFit
from gtao.errors import FitError

from .forms import evaluate
from .moments import Moments, cluster_moments
from .quadratic import UNDETERMINED
from .resampling import scene_weights
from .samples import Samples
from .scoring import Score, score
from .settings import REPORT_ALBEDOS, FitSettings, check
from .solver import Solver
from .table import FormScore, FormTable

__all__ = ["CANDIDATES", "FLOOR", "PUBLISHED", "compare_forms"]

#: Label of the row that all others are measured against.
PUBLISHED = "published"

#: Label of the row that shows what no function of V and ρ can be much better than.
FLOOR = "mean of V' given V"

#: Form, procedure and constraints of the fits that are always compared.
CANDIDATES: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    ("linear_cubic", "joint", ("unit_at_one",)),
    ("linear_cubic", "two-step", ("unit_at_one",)),
    ("linear_cubic", "joint", ()),
    ("linear_cubic", "two-step", ()),
    ("four_parameter", "joint", ()),
    ("one_parameter", "joint", ()),
    ("two_parameter", "joint", ()),
)

#: Bins of V of the mean of V' given V, drawn as straight lines through the means of the bins: no function of
#: V and ρ can be much better on the scenes that it was made from.
FLOOR_BINS = 32

Function = Callable[[np.ndarray, np.ndarray], np.ndarray]


def compare_forms(
    samples: Samples,
    bounces: float = 4,
    *,
    albedos: Iterable[float] = REPORT_ALBEDOS,
    weighting: str = "scene",
    include: FitSettings | None = None,
) -> FormTable:
    """Fit every form and score it beside the published coefficients and the closed forms.

    Args:
        samples: Path counts of the scenes.
        bounces: As in :func:`multibounce`.
        albedos: Albedos to fit and score, in (0, 1).
        weighting: As in :func:`multibounce`; it weights the fits, never the scores.
        include: A fit whose form, procedure and constraints get a row as well, under its
            :attr:`FitSettings.label`.

    Returns:
        One row per form; the published coefficients first, the floor last.

    Raises:
        ConfigError: An argument outside its range.
        FitError: Too few batches, or data that do not determine a form.
    """
    settings = check(samples, FitSettings(bounces=bounces, albedos=tuple(albedos), weighting=weighting))
    values = np.array(settings.albedos)
    plain = cluster_moments(samples, settings.bounces, values)
    weighted = cluster_moments(samples, settings.bounces, values, uniform=weighting == "uniform")
    folds = _folds(scene_weights(samples, weighting))
    rows = [_fixed_row(plain, JIMENEZ2016, PUBLISHED)]
    candidates = [FitSettings(form=f, procedure=p, constraints=c) for f, p, c in CANDIDATES]
    if include is not None and include.label not in [candidate.label for candidate in candidates]:
        candidates.insert(0, include)
    for candidate in candidates:
        rows.append(_fitted_row(plain, weighted, folds, candidate, settings.bounces))
    if not math.isinf(settings.bounces):
        fit = _fit("sphere_truncated", (settings.bounces,), settings.bounces)
        rows.append(_fixed_row(plain, fit, "sphere, truncated"))
    rows.append(_fixed_row(plain, _fit("sphere", (), math.inf), "sphere"))
    means = [_binned_mean(weighted, weights) for weights in folds]
    n = FLOOR_BINS * len(values)
    rows.append(_row(plain, means, label=FLOOR, form="binned_mean", n_parameters=n, coefficients=()))
    return FormTable(
        bounces=settings.bounces,
        albedos=settings.albedos,
        scenes=samples.names,
        rows=tuple(_against(row, rows[0], samples.names) for row in rows),
    )


def _fitted_row(
    plain: Moments, weighted: Moments, folds: np.ndarray, candidate: FitSettings, bounces: float
) -> FormScore:
    solver = Solver(candidate.form, candidate.constraints, two_step=candidate.procedure == "two-step")
    thetas = solver.solve(weighted, folds)
    if not np.all(np.isfinite(thetas[0])):
        raise FitError(f"{candidate.label}: {UNDETERMINED}")
    return _row(
        plain,
        [_function(candidate.form, theta, bounces) for theta in thetas],
        label=candidate.label,
        form=candidate.form,
        n_parameters=solver.form.n_coefficients - len(solver.constraints.d),
        coefficients=tuple(thetas[0].tolist()),
    )


def _folds(weights: np.ndarray) -> np.ndarray:
    """Scene weights with none left out, then with each left out; only the first if there is a single scene."""
    n = len(weights)
    return weights * np.concatenate([np.ones((1, n)), 1 - np.eye(n)])[: n + 1 if n > 1 else 1]


def _fit(form: str, coefficients: Iterable[float], bounces: float) -> MultibounceFit:
    return MultibounceFit(form=form, coefficients=tuple(coefficients), bounces=bounces, source="comparison of forms")


def _function(form: str, theta: np.ndarray, bounces: float) -> Function | None:
    if not np.all(np.isfinite(theta)):
        return None
    fit = _fit(form, theta.tolist(), bounces)
    return lambda V, rho: evaluate(fit, V, rho)


def _fixed_row(plain: Moments, fit: MultibounceFit, label: str) -> FormScore:
    """A row with nothing fitted: every fold has the same function."""
    n_folds = len(_folds(np.ones(len(plain.scene))))
    functions = [lambda V, rho: evaluate(fit, V, rho)] * n_folds
    return _row(plain, functions, label=label, form=fit.form, n_parameters=0, coefficients=fit.coefficients)


def _row(plain: Moments, functions: Sequence[Function | None], **named: Any) -> FormScore:
    """Scores of the function of all scenes (first) and of those that leave one out (rest, in order)."""
    assert functions[0] is not None
    train = score(plain, functions[0])
    rest = [None if f is None else score(plain, f) for f in functions[1:]]
    if not rest or any(x is None for x in rest):
        return FormScore(train_rmse=train.rmse, **named)
    left = Score(
        np.array([x.mse[i] for i, x in enumerate(rest) if x is not None]),
        np.array([x.bias[i] for i, x in enumerate(rest) if x is not None]),
    )
    return FormScore(
        train_rmse=train.rmse,
        loso_rmse=left.rmse,
        bias=float(left.bias.mean()),
        rmse_per_scene=tuple(left.rmse_per_scene.tolist()),
        rmse_per_albedo=tuple(left.rmse_per_albedo.tolist()),
        **named,
    )


def _against(row: FormScore, published: FormScore, scenes: tuple[str, ...]) -> FormScore:
    """Add wins and paired differences to the published row."""
    if row is published or row.rmse_per_scene is None or published.rmse_per_scene is None:
        return row
    change = np.array(row.rmse_per_scene) - np.array(published.rmse_per_scene)
    return replace(
        row,
        wins=int((change < 0).sum()),
        lost=tuple(name for name, c in zip(scenes, change, strict=True) if c >= 0),
        difference=float(change.mean()),
        difference_error=float(change.std(ddof=1) / math.sqrt(len(change))),
    )


def _binned_mean(moments: Moments, weights: np.ndarray) -> Function:
    """Mean of V' given V, as straight lines between the means of bins of V; constant beyond the outermost."""
    lattice = moments.lattices[0]
    weight = weights @ lattice.weight
    target = np.tensordot(weights, lattice.target, axes=1)
    bins = np.minimum((lattice.levels * FLOOR_BINS).astype(int), FLOOR_BINS - 1)
    total = np.bincount(bins, weight, FLOOR_BINS)
    some = total > 0
    nodes = (np.bincount(bins, weight * lattice.levels, FLOOR_BINS))[some] / total[some]
    means = np.array([np.bincount(bins, column, FLOOR_BINS)[some] for column in target.T]) / total[some]
    return lambda V, rho: np.stack([np.interp(V[:, 0], nodes, mean) for mean in means], axis=-1)
