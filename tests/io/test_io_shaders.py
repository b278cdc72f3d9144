"""Shader code: compiled and run against the formulas, in every language that a C++ compiler can be talked into."""

import ctypes
import math
import re

import numpy as np
import pytest
from _compiled import SHIM, as_cpp, build
from oracles import golden

import gtao
from gtao.data.multibounce import FORM_PARAMETERS
from gtao.errors import ConfigError
from gtao.io import shader_code

COEFFICIENTS = {
    "linear_cubic": gtao.JIMENEZ2016.coefficients,
    "four_parameter": (0.826, -0.086, 1.746, -1.952),
    "one_parameter": (0.863,),
    "two_parameter": (1.043, -0.238),
    "sphere": (),
    "sphere_truncated": (4.0,),
}
#: Forms in float64, from their definition; fitted ones between V and the energy bound.
FORMULAS = {
    "linear_cubic": lambda k, V, p: (((k[0] * p + k[1]) * V + k[2] * p + k[3]) * V + k[4] * p + k[5]) * V,
    "four_parameter": lambda k, V, p: V + p * V * (1 - V) * (k[0] + k[1] * V + p * (k[2] + k[3] * V)),
    "one_parameter": lambda k, V, p: V / (1 - k[0] * p * (1 - V)),
    "two_parameter": lambda k, V, p: V / (1 - p * (1 - V) * (k[0] + k[1] * V)),
    "sphere": lambda k, V, p: V / (1 - p * (1 - V)),
    "sphere_truncated": lambda k, V, p: V * sum((p * (1 - V)) ** j for j in range(int(k[0]))),
}
FITTED = ("linear_cubic", "four_parameter", "one_parameter", "two_parameter")


def fit(form, coefficients=None, **changes):
    values = COEFFICIENTS[form] if coefficients is None else coefficients
    return gtao.MultibounceFit(**{"form": form, "coefficients": values, "bounces": 4.0, "source": "test", **changes})


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """``run(language, form, V, p)``: every form in every language, from one compilation each."""
    folder = tmp_path_factory.mktemp("shaders")
    entry = "    for (int i = 0; i < n; ++i)\n        out[i] = "
    c_source, cpp_source = [], [SHIM]
    for form in FORM_PARAMETERS:
        signature = f"_{form}(int n, const float *V, const float *p, float *out)\n{{\n"
        code = shader_code(fit(form), "c").replace("MultiBounce", f"f_{form}")
        c_source += [code, f"void c{signature}{entry}f_{form}(V[i], p[i]);\n}}"]
        for language in ("hlsl", "glsl", "wgsl"):
            code = as_cpp(shader_code(fit(form), language), language)
            body = f"{entry}{language}_{form}_::MultiBounce(V[i], vec3(0.5f, p[i], 0.25f)).y;\n}}"
            cpp_source += [
                f"namespace {language}_{form}_ {{\n{code}}}",
                f'extern "C" void {language}{signature}{body}',
            ]
    libraries = {name: build(folder, f"a.{name}", "\n".join(of)) for name, of in (("c", c_source), ("cpp", cpp_source))}

    def run(language, form, V, p):
        V, p = np.float32(V), np.float32(p)
        out = np.empty_like(V)
        function = libraries["c" if language == "c" else "cpp"][f"{language}_{form}"]
        pointer = ctypes.POINTER(ctypes.c_float)
        function(V.size, *(a.ctypes.data_as(pointer) for a in (V, p, out)))
        return out.astype(np.float64)

    return run


def expected(form, V, p):
    with np.errstate(invalid="ignore", divide="ignore"):
        value = FORMULAS[form](COEFFICIENTS[form], V, p)
    if form in FITTED:
        # Past the pole of a quotient there is no less light than before it.
        value = np.clip(np.where(value < 0, np.inf, value), V, V + p * (1 - V))
    return np.where(V == 0, 0, value)


V_GRID, P_GRID = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, 33), np.linspace(0, 1, 21)))
#: About ten float32 operations on numbers up to 5.
TOLERANCE = 4e-6


@pytest.mark.parametrize("form", sorted(FORM_PARAMETERS))
@pytest.mark.parametrize("language", ["c", "hlsl", "glsl", "wgsl"])
def test_it_computes_the_form(compiled, language, form):
    got = compiled(language, form, V_GRID, P_GRID)
    assert np.isfinite(got).all()
    V, p = np.float64(np.float32(V_GRID)), np.float64(np.float32(P_GRID))
    assert np.abs(got - expected(form, V, p)).max() < TOLERANCE


@pytest.mark.parametrize(
    ("form", "key"), [("linear_cubic", "clamped"), ("sphere", "sphere_inf"), ("one_parameter", None)]
)
@pytest.mark.parametrize("language", ["c", "hlsl", "glsl", "wgsl"])
def test_golden_values(compiled, language, form, key):
    cases = golden.cases("D.multibounce")
    V, p = (np.array([inputs[name] for inputs, _ in cases]) for name in ("V", "rho"))
    bound = np.array([outputs["upper_bound"] for _, outputs in cases])
    # The energy bound takes the published overshoot of 5e-5 at V = 1 away.
    value = expected(form, V, p) if key is None else np.minimum([o[key] for _, o in cases], bound)
    assert compiled(language, form, V, p) == pytest.approx(value, abs=golden.FLOAT32_TOLERANCE)


@pytest.mark.parametrize("form", sorted(FORM_PARAMETERS))
def test_tiny_visibility_and_white_albedo(compiled, form):
    """Where 1 - p (1 - V) cancels: the quotient must neither overflow nor exceed what energy allows."""
    V = np.float32([0, 1e-38, 1e-20, 1e-8, 1e-6, 1e-4])
    got = compiled("c", form, V, np.ones_like(V))
    assert got[0] == 0
    assert (got <= 1).all()
    assert (got >= V).all()
    if form == "sphere":
        assert got[1:] == pytest.approx(np.float32([1e-8, 1, 1, 1, 1]), rel=1e-6)


def test_the_published_cubic_keeps_the_energy_bound_but_for_its_overshoot():
    V, p = V_GRID, P_GRID
    raw = np.maximum(V, FORMULAS["linear_cubic"](COEFFICIENTS["linear_cubic"], V, p))
    assert 0 < (raw - (V + p * (1 - V))).max() <= 1.01e-4


@pytest.mark.parametrize("language", ["hlsl", "glsl", "wgsl", "c"])
class TestText:
    def test_coefficients_are_read_back_as_the_same_float32(self, language):
        values = tuple(np.random.default_rng(8).normal(size=6) * 10.0 ** np.array([-9, -4, -1, 0, 2, 7]))
        code = shader_code(fit("linear_cubic", values), language)
        body = code[code.index("MultiBounce(") :]
        numbers = re.findall(r"([+-]) ?(\d+\.\d+(?:e[+-]\d+)?)|(?<![\w.])(\d+\.\d+(?:e[+-]\d+)?)", body)
        found = {np.float32(float(sign + a if a else b)) for sign, a, b in numbers}
        assert {np.float32(v) for v in values} <= found

    def test_it_says_where_it_comes_from(self, language):
        told = fit(
            "two_parameter",
            bounces=math.inf,
            source="a record\n*/ of\ttwo lines",
            standard_errors=(0.01, 0.02),
            intervals=((1.0, 1.1), (-0.3, -0.2)),
            level=0.95,
        )
        code = shader_code(told, language)
        comment = code[: code.index("MultiBounce(")]
        assert "For infinitely many bounces" in comment
        assert "Source: a record */ of two lines" in comment
        assert "kappa0 = 1.043, standard error 0.01, 95 % interval 1 to 1.1" in comment
        assert f"Written by gtao {gtao.__version__}." in comment
        assert code == shader_code(told, language)
        assert code.isascii()

    @pytest.mark.parametrize("n", [0.0, -1.0, 2.5, 33.0])
    def test_a_sum_that_cannot_be_written_out(self, language, n):
        with pytest.raises(ConfigError, match="n must be an integer from 1 to 32"):
            shader_code(fit("sphere_truncated", (n,)), language)

    def test_a_coefficient_beyond_float32(self, language):
        with pytest.raises(ConfigError, match="does not fit into a 32-bit float"):
            shader_code(fit("one_parameter", (1e39,)), language)


def test_one_bounce_is_visibility():
    assert "return float3(visibility, visibility, visibility);" in shader_code(fit("sphere_truncated", (1.0,)))


def test_unknown_language():
    with pytest.raises(ConfigError, match="language must be one of hlsl, glsl, wgsl, c, got 'metal'"):
        shader_code(gtao.SPHERE, "metal")
