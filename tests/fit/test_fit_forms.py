"""The NumPy forms against golden values, their own definitions and finite differences."""

import numpy as np
import pytest
from oracles import golden

import gtao
from gtao import fit
from gtao.data.multibounce import MultibounceFit
from gtao.errors import ConfigError
from gtao.fit.forms import FITTED_FORMS, coefficients_of_cubics, fitted_form

V, RHO = (x.ravel() for x in np.meshgrid(np.linspace(0.02, 0.98, 13), np.linspace(0.05, 0.95, 11)))
THETA = {
    "linear_cubic": np.array(gtao.JIMENEZ2016.coefficients),
    "four_parameter": np.array([0.7, -0.3, 0.9, -0.6]),
    "one_parameter": np.array([0.9]),
    "two_parameter": np.array([0.8, 0.15]),
}

#: Central differences with this step: rounding 1e-16/1e-5 and truncation (1e-5)² stay below the tolerance.
STEP, DIFFERENCE_TOLERANCE = 1e-5, 1e-7


def make(form, coefficients, bounces=4.0):
    return MultibounceFit(form=form, coefficients=tuple(coefficients), bounces=bounces, source="test")


@pytest.mark.parametrize(
    ("multibounce_fit", "key"),
    [
        (gtao.JIMENEZ2016, "clamped"),
        (gtao.SPHERE, "sphere_inf"),
        (make("one_parameter", [1.0]), "sphere_inf"),
        (make("two_parameter", [1.0, 0.0]), "sphere_inf"),
        # Four bounces after the first.
        (make("sphere_truncated", [5]), "sphere_4"),
    ],
)
def test_golden(multibounce_fit, key):
    inputs, outputs = zip(*golden.cases("D.multibounce"), strict=True)
    got = fit.evaluate(multibounce_fit, [i["V"] for i in inputs], [i["rho"] for i in inputs])
    assert got == pytest.approx([o[key] for o in outputs], abs=golden.FLOAT64_TOLERANCE)


def test_golden_cubic_without_max():
    form = FITTED_FORMS["linear_cubic"]
    for inputs, outputs in golden.cases("D.multibounce"):
        got = form.raw(THETA["linear_cubic"], np.array(inputs["V"]), np.array(inputs["rho"]))
        assert got == pytest.approx(outputs["raw"], abs=golden.FLOAT64_TOLERANCE)


def test_four_parameters_by_definition():
    k0, k1, k2, k3 = THETA["four_parameter"]
    expected = V + RHO * V * (1 - V) * (k0 + k1 * V + RHO * (k2 + k3 * V))
    assert fit.evaluate(make("four_parameter", THETA["four_parameter"]), V, RHO) == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("form", [gtao.SPHERE, make("one_parameter", [1.0]), make("two_parameter", [1.0, -0.2])])
def test_nothing_seen_and_nothing_absorbed_is_the_limit(form):
    assert fit.evaluate(form, 0.0, 1.0) == 1.0
    assert fit.evaluate(gtao.SPHERE, [0.3, 1.0], 1.0) == pytest.approx([1.0, 1.0], abs=1e-15)


def test_visibility_and_albedo_broadcast():
    assert fit.evaluate(gtao.JIMENEZ2016, np.zeros((3, 1)), np.full(4, 0.5)).shape == (3, 4)


@pytest.mark.parametrize("name", ["linear_cubic", "four_parameter"])
def test_slopes_are_derivatives(name):
    form = FITTED_FORMS[name]
    numeric = (form.basis(V + STEP, RHO) - form.basis(V - STEP, RHO)) / (2 * STEP)
    assert form.slopes(V, RHO) == pytest.approx(numeric, abs=DIFFERENCE_TOLERANCE)


@pytest.mark.parametrize("name", ["linear_cubic", "four_parameter"])
def test_design_gives_the_basis(name):
    form = FITTED_FORMS[name]
    powers = V[:, None] ** np.arange(4)
    design = np.array([form.design(np.array([rho]))[:, 0] for rho in RHO])
    assert np.einsum("njp,np->jn", design, powers) == pytest.approx(form.basis(V, RHO), abs=1e-14)


@pytest.mark.parametrize("name", ["one_parameter", "two_parameter"])
def test_derivatives_of_rational_forms(name):
    form, theta = FITTED_FORMS[name], THETA[name]
    jacobian = form.jacobian(theta, V, RHO)
    for j in range(form.n_coefficients):
        step = STEP * np.eye(form.n_coefficients)[j]
        numeric = (form.raw(theta + step, V, RHO) - form.raw(theta - step, V, RHO)) / (2 * STEP)
        assert jacobian[j] == pytest.approx(numeric, abs=DIFFERENCE_TOLERANCE)
        second = (form.jacobian(theta + step, V, RHO) - form.jacobian(theta - step, V, RHO)) / (2 * STEP)
        # Second derivatives reach 100 at low V and high albedo.
        assert form.bend(theta, V, RHO) * jacobian * jacobian[j] == pytest.approx(second, rel=1e-6, abs=1e-6)
    assert np.all(form.bend(theta, np.zeros(1), np.ones(1)) == 0)


def test_lines_through_cubics():
    albedos = np.array([0.1, 0.4, 0.9])
    slopes, intercepts = np.array([2.0, -5.0, 3.0]), np.array([-0.3, 0.6, 0.7])
    found = coefficients_of_cubics(albedos[:, None] * slopes + intercepts, albedos)
    assert found == pytest.approx([2.0, -0.3, -5.0, 0.6, 3.0, 0.7])


def test_unknown_forms():
    with pytest.raises(ConfigError, match="'sphere' has no coefficients to fit"):
        fitted_form("sphere")
    with pytest.raises(ConfigError, match="unknown form 'quartic'; choose one of linear_cubic"):
        fitted_form("quartic")
