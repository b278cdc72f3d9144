"""Multi-bounce forms: golden values, definitions, limits."""

import numpy as np
import pytest
from oracles import golden

import gtao
from gtao.data.multibounce import FORM_PARAMETERS
from gtao.kernels.multibounce import evaluate

CASES = golden.cases("D.multibounce")
JIMENEZ = gtao.JIMENEZ2016.coefficients


def lanes_of(precision, key, side=0):
    return precision.lanes([case[side][key] for case in CASES])


@pytest.mark.parametrize(
    ("form", "coefficients", "key"),
    [
        ("linear_cubic", JIMENEZ, "clamped"),
        ("sphere", (), "sphere_inf"),
        # The value with four extra bounces has five terms.
        ("sphere_truncated", (5,), "sphere_4"),
    ],
)
def test_golden(precision, form, coefficients, key):
    got = np.array(evaluate(form, coefficients, lanes_of(precision, "V"), lanes_of(precision, "rho")))
    assert got == pytest.approx([o[key] for _, o in CASES], abs=precision.tolerance)


def test_golden_cubic_before_its_maximum_with_visibility(precision):
    got = np.array(evaluate("linear_cubic", JIMENEZ, lanes_of(precision, "V"), lanes_of(precision, "rho")))
    raw, V = (np.array([case[side][key] for case in CASES]) for side, key in ((1, "raw"), (0, "V")))
    above = raw >= V
    assert 0 < above.sum() < len(CASES)
    assert got[above] == pytest.approx(raw[above], abs=precision.tolerance)
    assert got[~above] == pytest.approx(V[~above], abs=precision.tolerance)


@pytest.mark.parametrize(
    ("form", "coefficients"), [("sphere", ()), ("sphere_truncated", (5,)), ("linear_cubic", JIMENEZ)]
)
def test_energy_bound_golden(precision, form, coefficients):
    """V + ρ (1 - V) bounds the sphere by theory; the cubic, but for its overshoot at V = 1, by its fit."""
    got = np.array(evaluate(form, coefficients, lanes_of(precision, "V"), lanes_of(precision, "rho")))
    bound = np.array([outputs["upper_bound"] for _, outputs in CASES])
    overshoot = 1e-4 if form == "linear_cubic" else 0
    assert (got <= bound + overshoot + precision.tolerance).all()
    V, rho = (np.array([inputs[key] for inputs, _ in CASES]) for key in ("V", "rho"))
    assert bound == pytest.approx(V + rho * (1 - V), abs=golden.FLOAT64_TOLERANCE)


FORMULAS = {
    "linear_cubic": lambda k, V, p: np.maximum(
        V, (((k[0] * p + k[1]) * V + k[2] * p + k[3]) * V + k[4] * p + k[5]) * V
    ),
    "four_parameter": lambda k, V, p: V + p * V * (1 - V) * (k[0] + k[1] * V + p * (k[2] + k[3] * V)),
    "one_parameter": lambda k, V, p: V / (1 - k[0] * p * (1 - V)),
    "two_parameter": lambda k, V, p: V / (1 - p * (1 - V) * (k[0] + k[1] * V)),
    "sphere": lambda k, V, p: V / (1 - p * (1 - V)),
    "sphere_truncated": lambda k, V, p: V * sum((p * (1 - V)) ** j for j in range(int(k[0]))),
}
COEFFICIENTS = {
    "linear_cubic": JIMENEZ,
    "four_parameter": (0.7, -0.3, 0.9, -0.6),
    "one_parameter": (0.9,),
    "two_parameter": (0.8, 0.15),
    "sphere": (),
    "sphere_truncated": (4,),
}
GRID = [v.ravel() for v in np.meshgrid(np.linspace(0.01, 1, 23), np.linspace(0, 0.99, 21))]


def test_every_form_is_covered():
    assert set(FORMULAS) == set(COEFFICIENTS) == set(FORM_PARAMETERS)


@pytest.mark.parametrize("form", sorted(FORMULAS))
def test_form_is_its_formula(precision, form):
    V, rho = GRID
    k = COEFFICIENTS[form]
    assert len(k) == len(FORM_PARAMETERS[form])
    got = np.array(evaluate(form, k, precision.lanes(V), precision.lanes(rho)))
    assert got == pytest.approx(FORMULAS[form](k, V, rho), abs=precision.tolerance)


@pytest.mark.parametrize("form", sorted(FORMULAS))
def test_limits_that_every_form_shares(precision, form):
    """0 at V = 0, 1 at V = 1 (the published cubic to 5e-4), never below V, V itself without albedo."""
    k, rho = COEFFICIENTS[form], np.linspace(0, 0.99, 12)

    def flat(value):
        return precision.lanes(np.full(12, value))

    at_end = 5e-4 if form == "linear_cubic" else precision.tolerance
    assert np.array(evaluate(form, k, flat(0.0), precision.lanes(rho))) == pytest.approx(0.0, abs=precision.tolerance)
    assert np.array(evaluate(form, k, flat(1.0), precision.lanes(rho))) == pytest.approx(1.0, abs=at_end)
    V, rho = GRID
    got = np.array(evaluate(form, k, precision.lanes(V), precision.lanes(rho)))
    assert (got >= V - precision.tolerance).all()
    if form != "linear_cubic":
        dark = np.array(evaluate(form, k, precision.lanes(V), precision.lanes(np.zeros_like(V))))
        assert dark == pytest.approx(V, abs=precision.tolerance)


def test_sphere_at_white_albedo_in_closed_surroundings(precision):
    """V → 0 with ρ = 1: no light is lost, the limit is 1; with any darker albedo it is 0."""
    got = evaluate("sphere", (), precision.lanes([0.0, 0.0]), precision.lanes([1.0, 0.9]))
    assert list(np.array(got)) == [1.0, 0.0]


@pytest.mark.parametrize("case", CASES)
def test_published_fit_respects_the_energy_bound(case):
    """V' <= V + ρ (1 - V), on images, after the clamp to 1 that removes the cubic's overshoot."""
    inputs, outputs = case
    got = gtao.multibounce(np.full((1, 1), inputs["V"], np.float32), inputs["rho"]).numpy()[0, 0]
    assert got <= outputs["upper_bound"] + golden.FLOAT32_TOLERANCE
    assert got == pytest.approx(min(1.0, outputs["clamped"]), abs=golden.FLOAT32_TOLERANCE)
