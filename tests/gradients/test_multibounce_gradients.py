"""Gradients of ``gtao.multibounce`` against differences in float64: visibility, albedo, coefficients."""

import drjit as dr
import numpy as np
import pytest
from gradients._functions import check, native, pullback, pushforward, unit_moves

import gtao

RNG = np.random.default_rng(3)
VISIBILITY = RNG.uniform(0.01, 0.99, (7, 8))
ALBEDO = RNG.uniform(0.02, 0.98, (7, 8, 3))
FORMS = {
    "linear_cubic": gtao.JIMENEZ2016.coefficients,
    "four_parameter": (0.6, 0.3, 0.9, -0.7),
    "one_parameter": (0.8,),
    "two_parameter": (0.9, -0.3),
    "sphere": (),
    "sphere_truncated": (4,),
}


def coloured(form, albedo=None):
    """Multi-bounce visibility as a function of everything attachable: "V", "rho" and the coefficients by name."""
    names = gtao.data.FORM_PARAMETERS[form]

    def f(values):
        coefficients = FORMS[form] if form == "sphere_truncated" else tuple(values[name] for name in names)
        fit = gtao.MultibounceFit(form=form, coefficients=coefficients, bounces=4, source="test")
        return gtao.multibounce(values["V"], values["rho"], fit)

    values = {"V": VISIBILITY, "rho": ALBEDO if albedo is None else albedo}
    if form != "sphere_truncated":
        values |= dict(zip(names, FORMS[form], strict=True))
    return f, values


@pytest.mark.parametrize("form", FORMS)
def test_visibility_and_albedo(form):
    f, values = coloured(form)
    mask = np.ones(VISIBILITY.shape, bool)
    check(f, values, "V", unit_moves(mask, 20, 1))
    rng = np.random.default_rng(2)
    check(f, values, "rho", [rng.standard_normal(ALBEDO.shape) for _ in range(4)])


@pytest.mark.parametrize("form", [name for name in FORMS if name not in ("sphere", "sphere_truncated")])
def test_coefficients(form):
    f, values = coloured(form)
    for name in gtao.data.FORM_PARAMETERS[form]:
        check(f, values, name)


@pytest.mark.parametrize("albedo", [0.6, ALBEDO[..., 0]], ids=["number", "grey"])
def test_grey_albedo(albedo):
    f, values = coloured("linear_cubic", albedo)
    check(f, values, "rho", [1.0] if np.ndim(albedo) == 0 else list(unit_moves(np.ones((7, 8), bool), 10, 4)))
    check(f, values, "b1")


@pytest.mark.parametrize("form", FORMS)
def test_modes_are_each_others_transpose(form):
    f, values = coloured(form)
    rng = np.random.default_rng(6)
    v = {name: rng.standard_normal(np.shape(value)) for name, value in values.items()}
    w = rng.standard_normal(ALBEDO.shape)
    gradient = pullback(f, values, w)
    forward = np.sum(pushforward(f, values, v) * w)
    # Sums of some thousand products of order 1 in double precision.
    assert forward == pytest.approx(sum(np.sum(gradient[name] * v[name]) for name in values), rel=1e-10)


def test_on_a_bound_derivatives_are_those_of_the_bound():
    """Beyond the energy bound V + ρ (1 - V), below V, and above 1, where the fit says nothing."""
    f, values = coloured("one_parameter", 0.5)
    values |= {"V": np.array([[0.3]]), "kappa": 3.0}
    gradient = pullback(f, values, 1.0)
    assert gradient == {"V": pytest.approx(0.5), "rho": pytest.approx(0.7), "kappa": 0.0}
    gradient = pullback(f, values | {"kappa": -1.0}, 1.0)
    assert gradient == {"V": pytest.approx(1.0), "rho": 0.0, "kappa": 0.0}
    gradient = pullback(f, values | {"kappa": 0.8, "V": np.array([[1.1]])}, 1.0)
    assert gradient["V"] == 0


@pytest.mark.parametrize("form", ["four_parameter", "one_parameter", "two_parameter", "sphere"])
def test_black_surroundings_have_the_derivative_of_the_fit(form):
    """At ρ = 0 all forms but the cubic meet both bounds: the derivative is the one toward larger albedos."""
    f, values = coloured(form, np.zeros((7, 8)))
    gradient = pullback(f, values, 1.0, ("rho",))["rho"]
    h = 1e-7
    up, here = (f({k: native(v) for k, v in (values | {"rho": np.full((7, 8), r)}).items()}).numpy() for r in (h, 0.0))
    # Rounding 1e-16 / 1e-7, curvature 1e-7.
    assert gradient == pytest.approx((up - here) / h, abs=1e-6)


def test_a_number_of_bounces_has_no_derivative():
    n = native(4)
    dr.enable_grad(n)
    fit = gtao.MultibounceFit(form="sphere_truncated", coefficients=(n,), bounces=4, source="test")
    with pytest.raises(gtao.ConfigError, match="no derivative"):
        gtao.multibounce(VISIBILITY, 0.5, fit)


def test_coefficients_have_width_one():
    with pytest.raises(gtao.ConfigError, match="width 1"):
        gtao.MultibounceFit(form="one_parameter", coefficients=(type(native(1.0))(1, 2),), bounces=4, source="test")


def test_single_precision_and_coefficients_of_another_one():
    f, values = coloured("linear_cubic")
    want, got = (pullback(f, values, np.ones(ALBEDO.shape), single=single) for single in (False, True))
    for name in values:
        # Cubics with coefficients up to 5 in single precision; sums of 168 of them.
        assert np.asarray(got[name]) == pytest.approx(np.asarray(want[name]), rel=1e-4, abs=1e-4), name
    coefficients = tuple(native(c, single=True) for c in FORMS["linear_cubic"])
    dr.enable_grad(coefficients)
    fit = gtao.MultibounceFit(form="linear_cubic", coefficients=coefficients, bounces=4, source="test")
    dr.backward(dr.sum(gtao.multibounce(native(VISIBILITY), native(ALBEDO), fit).array))
    assert [dr.grad(c)[0] for c in coefficients] == pytest.approx([want[n] for n in fit.names], rel=1e-6)


def test_a_backward_pass_is_one_kernel_for_everything():
    f, values = coloured("linear_cubic")
    values = {k: native(v, single=True) for k, v in values.items()}
    dr.enable_grad(values)
    # Dr.Jit calls a custom operation's adjoint with the flags of its forward pass.
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        result = f(values)
        dr.eval(result)
        dr.kernel_history_clear()
        dr.backward(dr.sum(result.array))
        dr.eval(dr.grad(values))
        dr.sync_thread()
        ops = [k["operation_count"] for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT]
    # The adjoint, and what adds up its gradients; plain reverse mode takes a pass for each coefficient.
    assert len([n for n in ops if n > 60]) == 1
    assert len(ops) <= 4
