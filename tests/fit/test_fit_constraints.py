"""Every constraint binds somewhere, holds everywhere, and costs no more than it must."""

import math

import numpy as np
import pytest
from fit import _synthetic as synthetic
from scipy import optimize

from gtao import fit
from gtao.errors import FitError
from gtao.fit import Samples, multibounce
from gtao.fit.constraints import CONSTRAINTS, ConstraintSet, constraint_set
from gtao.fit.forms import FITTED_FORMS
from gtao.fit.moments import cluster_moments
from gtao.fit.quadratic import quadratic
from gtao.fit.scoring import score
from gtao.fit.solver import Solver

V = np.linspace(0, 1, 1001)
RHO = np.linspace(0, 1, 51)[:, None]

#: Between the lines of the fit's grid (256 cells of V) a constraint can be missed by the sagitta max|f''| h²/8 of a
#: cell, or its like in albedo; second derivatives of these fits stay below 60. For "monotone" it is the slope that is
#: held, and a drop from one of our points to the next is a thousandth of its sagitta.
SAGITTA = 60 / 256**2 / 8


def samples(shares):
    return Samples.from_transports([(f"s{i}", synthetic.exact(t, paths=512)) for i, t in enumerate(shares)])


def bright(V):
    """More light comes back than any surface could send: breaks the energy bound at V < 0.5."""
    return np.array([V, np.minimum(1 - V, 0.1 + 2.5 * V * (1 - V))])


def dark(V):
    """Nothing comes back from where V is small: a fit bends below V."""
    return np.array([V, (1 - V) * np.clip(3 * V - 1.8, 0, 1)])


def humped(V):
    """Light peaks at middling visibility and falls towards the open: breaks monotony at high albedo."""
    return np.array([V, (1 - V) * np.clip(1.2 - 6 * (V - 0.45) ** 2, 0, 1), 0.3 * (1 - V) * (V < 0.5) * 0])


CASES = {
    ("linear_cubic", "above_visibility"): dark,
    ("linear_cubic", "monotone"): humped,
    ("linear_cubic", "energy"): bright,
    ("four_parameter", "above_visibility"): dark,
    ("four_parameter", "monotone"): humped,
    ("four_parameter", "energy"): bright,
    ("one_parameter", "above_visibility"): lambda V: np.array([V, 0 * V]),
    ("two_parameter", "above_visibility"): dark,
    ("two_parameter", "monotone"): humped,
    ("two_parameter", "energy"): bright,
}


def violation(name, result):
    """By how much the fitted function misses a constraint, by its definition, on a grid of our own."""
    form = FITTED_FORMS[result.fit.form]
    f = form.raw(np.array(result.fit.coefficients), V[1:], RHO)  # at V = 0 the rational forms need no check: f = 0
    if name == "above_visibility":
        return float((V[1:] - f).max())
    if name == "energy":
        return float((f - V[1:] - RHO * (1 - V[1:])).max())
    return float(-np.diff(f, axis=1).min())


def data(shares):
    return samples([shares(np.linspace(0.004, 0.996, 249)), shares(np.linspace(0.1, 0.9, 81))])


@pytest.mark.parametrize(("form", "name"), sorted(CASES))
def test_inequality_binds_and_holds(form, name):
    s = data(CASES[form, name])
    free = multibounce(s, form=form, bounces=2, n_bootstrap=0)
    held = multibounce(s, form=form, bounces=2, n_bootstrap=0, constraints=("unit_at_one", name))
    if (form, name) != ("one_parameter", "above_visibility"):  # there the free optimum lies on the bound
        assert violation(name, free) > 3 * SAGITTA
        assert held.rmse > free.rmse
    assert violation(name, held) < SAGITTA
    assert name in held.active


@pytest.mark.parametrize("form", ["linear_cubic", "four_parameter", "two_parameter"])
def test_constraints_hold_together(form):
    everything = tuple(CONSTRAINTS)
    for shares in (bright, dark, humped):
        result = multibounce(data(shares), form=form, bounces=2, n_bootstrap=0, constraints=everything)
        for name in ("above_visibility", "monotone", "energy"):
            assert violation(name, result) < SAGITTA


@pytest.mark.parametrize("form", ["linear_cubic", "four_parameter", "two_parameter"])
@pytest.mark.parametrize("shares", [bright, dark, humped])
def test_constrained_fit_is_optimal(form, shares):
    """Karush, Kuhn and Tucker: downhill points nowhere but into the constraints that bind."""
    names = ("unit_at_one", "above_visibility", "monotone", "energy")
    s, albedos = data(shares), np.array([0.3, 0.6, 0.9])
    result = multibounce(s, form=form, bounces=2, albedos=tuple(albedos), n_bootstrap=0, constraints=names)
    moments = cluster_moments(s, 2, albedos)
    family, constraints = FITTED_FORMS[form], constraint_set(FITTED_FORMS[form], names)
    theta, step = np.array(result.fit.coefficients), 1e-5

    def objective(theta):
        return score(moments, lambda V, rho: family.raw(theta, V, rho)).mse.mean()

    gradient = [objective(theta + step * e) - objective(theta - step * e) for e in np.eye(len(theta))]
    gradient = np.array(gradient) / (2 * step)
    binding = constraints.G[constraints.G @ theta - constraints.h < 1e-7]
    pushes = np.concatenate([binding, constraints.E, -constraints.E])
    assert len(binding) > 0
    # Central differences of a function of order 0.1 with steps of 1e-5: rounding 1e-17/1e-5 and curvature 1e-10.
    assert optimize.nnls(pushes.T, gradient)[1] < 1e-8


@pytest.mark.parametrize("form", ["one_parameter", "two_parameter"])
def test_rational_forms_stay_finite(form):
    # All light comes back: only κ > 1 could follow, and would have a pole inside [0, 1].
    s = data(lambda V: np.array([V, np.minimum(1 - V, 0.3 + 2 * V)]))
    result = multibounce(s, form=form, bounces=2, n_bootstrap=0, constraints=())
    assert "finite" in result.active
    assert np.all(np.isfinite(fit.evaluate(result.fit, V, RHO)))
    assert result.fit.coefficients[0] <= 1 + 1e-8


def test_free_cubic_misses_one_and_the_equation_mends_it():
    s = data(humped)
    free = multibounce(s, bounces=2, n_bootstrap=0, constraints=())
    held = multibounce(s, bounces=2, n_bootstrap=0)
    form = FITTED_FORMS["linear_cubic"]
    assert np.abs(form.raw(np.array(free.fit.coefficients), np.ones(1), RHO) - 1).max() > 1e-3
    assert form.raw(np.array(held.fit.coefficients), np.ones(1), RHO) == pytest.approx(np.ones((51, 1)), abs=1e-12)
    assert free.rmse < held.rmse
    # At V = 0 the form has no choice.
    assert multibounce(s, bounces=2, n_bootstrap=0, constraints=("zero_at_zero",)).fit == free.fit


def test_many_weightings_are_each_constrained():
    s = Samples.from_transports(
        [(f.__name__, synthetic.exact(f(np.linspace(0.004, 0.996, 249)), paths=512)) for f in (bright, dark, humped)]
    )
    moments = cluster_moments(s, 2, np.array([0.3, 0.9]))
    solver = Solver("four_parameter", ("above_visibility", "energy"))
    thetas = solver.solve(moments, np.eye(3))
    assert np.min(thetas @ solver.constraints.G.T - solver.constraints.h) > -1e-8
    assert thetas[1] == pytest.approx(solver.solve(moments, np.array([[0.0, 5.0, 0.0]]))[0], abs=1e-9)
    assert len({solver.constraints.active(theta) for theta in thetas}) > 1


def _set(G, h):
    return ConstraintSet(
        np.zeros((0, 2)), np.zeros(0), np.array(G, float), np.array(h, float), np.array(["x"] * len(h))
    )


def test_quadratic_program_by_hand():
    # The point of the half plane x + y ≥ 2 nearest to the origin, then with x ≤ 0.5 as well.
    assert quadratic(np.eye(2), np.zeros(2), _set([[1, 1]], [2])) == pytest.approx([1, 1])
    assert quadratic(np.eye(2), np.zeros(2), _set([[1, 1], [-1, 0]], [2, -0.5])) == pytest.approx([0.5, 1.5])


def test_impossible_programs():
    with pytest.raises(FitError, match="contradict each other"):
        quadratic(np.eye(2), np.zeros(2), _set([[1, 0], [-1, 0]], [1, 1]))
    with pytest.raises(FitError, match="do not determine"):
        quadratic(np.array([[1.0, 1.0], [1.0, 1.0]]), np.zeros(2), _set([[1, 0]], [-1]))


def test_infinite_bounces_need_no_counted_maximum():
    s = data(bright)
    assert math.isinf(multibounce(s, bounces=math.inf, n_bootstrap=0).fit.bounces)
