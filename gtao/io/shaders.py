"""Fitted multi-bounce functions as shader code: HLSL, GLSL, WGSL and C."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gtao._version import __version__
from gtao.data.multibounce import MultibounceFit
from gtao.errors import ConfigError

__all__ = ["LANGUAGES", "shader_code"]

#: Longest sum that is written out term by term.
MAX_UNROLLED = 32


@dataclass(frozen=True)
class _Language:
    """How a language spells what the forms need; ``albedo`` and results are colours, ``visibility`` is a number."""

    head: str
    colour_value: str
    number_value: str
    splat: str
    minimum: str
    maximum: str
    suffix: str = ""

    def number(self, x: float) -> str:
        """The shortest decimal that is read back as the same float32."""
        if abs(x) > float(np.finfo(np.float32).max):
            raise ConfigError(f"coefficient {x} does not fit into a 32-bit float")
        single = np.float32(x)
        plain = single == 0 or 1e-4 <= abs(single) < 1e6
        write = np.format_float_positional if plain else np.format_float_scientific
        return write(single, unique=True, trim="0") + self.suffix

    def plus(self, x: float) -> str:
        """``+ x`` or ``- |x|``."""
        return f"- {self.number(-x)}" if x < 0 else f"+ {self.number(x)}"

    def colour(self, name: str, value: str) -> str:
        return self.colour_value.format(name=name, value=value)

    def scalar(self, name: str, value: str) -> str:
        return self.number_value.format(name=name, value=value)

    def min(self, a: str, b: str) -> str:
        return f"{self.minimum}({a}, {b})"

    def max(self, a: str, b: str) -> str:
        return f"{self.maximum}({a}, {b})"


_GLSL_LIKE = {"minimum": "min", "maximum": "max"}

LANGUAGES: dict[str, _Language] = {
    "hlsl": _Language(
        head="float3 MultiBounce(float visibility, float3 albedo)\n{",
        colour_value="const float3 {name} = {value};",
        number_value="const float {name} = {value};",
        splat="float3({0}, {0}, {0})",
        **_GLSL_LIKE,
    ),
    "glsl": _Language(
        head="vec3 MultiBounce(float visibility, vec3 albedo)\n{",
        colour_value="vec3 {name} = {value};",
        number_value="float {name} = {value};",
        splat="vec3({0})",
        **_GLSL_LIKE,
    ),
    "wgsl": _Language(
        head="fn MultiBounce(visibility: f32, albedo: vec3f) -> vec3f {",
        colour_value="let {name} = {value};",
        number_value="let {name} = {value};",
        splat="vec3f({0})",
        **_GLSL_LIKE,
    ),
    "c": _Language(
        head="static inline float MultiBounce(float visibility, float albedo)\n{",
        colour_value="const float {name} = {value};",
        number_value="const float {name} = {value};",
        splat="{0}",
        minimum="fminf",
        maximum="fmaxf",
        suffix="f",
    ),
}


def _bounded(L: _Language, value: str) -> list[str]:
    """Between single-bounce visibility and the energy bound visibility + albedo (1 - visibility)."""
    one = L.number(1)
    return [
        L.colour("bounced", value),
        L.colour("bound", f"visibility + albedo * ({one} - visibility)"),
        f"return {L.min(L.max('bounced', L.splat.format('visibility')), 'bound')};",
    ]


def _linear_cubic(L: _Language, c: tuple[float, ...]) -> list[str]:
    a1, a0, b1, b0, c1, c0 = c
    return [
        L.colour("a", f"{L.number(a1)} * albedo {L.plus(a0)}"),
        L.colour("b", f"{L.number(b1)} * albedo {L.plus(b0)}"),
        L.colour("c", f"{L.number(c1)} * albedo {L.plus(c0)}"),
        *_bounded(L, "((a * visibility + b) * visibility + c) * visibility"),
    ]


def _four_parameter(L: _Language, c: tuple[float, ...]) -> list[str]:
    k0, k1, k2, k3 = c
    return [
        L.scalar("inner", f"{L.number(k0)} {L.plus(k1)} * visibility"),
        L.scalar("slope", f"{L.number(k2)} {L.plus(k3)} * visibility"),
        L.scalar("hump", f"visibility * ({L.number(1)} - visibility)"),
        *_bounded(L, "visibility + albedo * hump * (inner + albedo * slope)"),
    ]


def _quotient(L: _Language, kept: str) -> list[str]:
    """``kept`` is κ ρ. 1 - κ ρ (1 - V) is summed so that nothing cancels, and kept from 0 where V is 0."""
    return [
        L.colour("kept", kept),
        L.colour("denominator", f"({L.number(1)} - kept) + kept * visibility"),
    ]


def _divided(L: _Language) -> str:
    return f"visibility / {L.max('denominator', L.splat.format(L.number(1e-30)))}"


def _one_parameter(L: _Language, c: tuple[float, ...]) -> list[str]:
    return [*_quotient(L, f"{L.number(c[0])} * albedo"), *_bounded(L, _divided(L))]


def _two_parameter(L: _Language, c: tuple[float, ...]) -> list[str]:
    kappa = f"({L.number(c[0])} {L.plus(c[1])} * visibility)"
    return [*_quotient(L, f"{kappa} * albedo"), *_bounded(L, _divided(L))]


def _sphere(L: _Language, c: tuple[float, ...]) -> list[str]:
    return [L.colour("denominator", f"({L.number(1)} - albedo) + albedo * visibility"), f"return {_divided(L)};"]


def _sphere_truncated(L: _Language, c: tuple[float, ...]) -> list[str]:
    (n,) = c
    if n != int(n) or not 1 <= n <= MAX_UNROLLED:
        raise ConfigError(f"n must be an integer from 1 to {MAX_UNROLLED} to be written out, got {n}")
    one = L.number(1)
    series = one
    for _ in range(int(n) - 1):
        series = f"q + {one}" if series == one else f"({series}) * q + {one}"
    if n == 1:
        return [f"return {L.splat.format('visibility')};"]
    return [L.colour("q", f"albedo * ({one} - visibility)"), f"return visibility * ({series});"]


_FORMS: dict[str, tuple[str, Callable[[_Language, tuple[float, ...]], list[str]]]] = {
    "linear_cubic": ("((a V + b) V + c) V with a, b, c linear in the albedo", _linear_cubic),
    "four_parameter": ("V + p V (1 - V) (k0 + k1 V + p (k2 + k3 V))", _four_parameter),
    "one_parameter": ("V / (1 - kappa p (1 - V))", _one_parameter),
    "two_parameter": ("V / (1 - p (1 - V) (kappa0 + kappa1 V))", _two_parameter),
    "sphere": ("V / (1 - p (1 - V)), the integrating sphere", _sphere),
    "sphere_truncated": (
        "V sum over k < n of (p (1 - V))^k, the integrating sphere after n bounces",
        _sphere_truncated,
    ),
}


def _comment(fit: MultibounceFit, formula: str, bounded: bool) -> list[str]:
    bounces = "infinitely many bounces" if math.isinf(fit.bounces) else f"{fit.bounces:g} bounces"
    lines = [
        "Multi-bounce ambient visibility, per colour channel.",
        "",
        "visibility: cosine-weighted visibility (ambient occlusion), 0 to 1, 1 = open",
        "albedo:     linear diffuse reflectance of the surroundings, 0 to 1",
        "returns:    visibility with interreflection; multiply ambient light with it instead",
        "",
        f"Form: {formula}; V = visibility, p = albedo.",
    ]
    if bounded:
        lines.append("Kept between V and the energy bound V + p (1 - V).")
    lines.append(f"For {bounces}, counting the visible point. Source: {' '.join(fit.source.split())}")
    for i, (name, value) in enumerate(zip(fit.names, fit.numbers, strict=True)):
        line = f"  {name} = {value:.9g}"
        if fit.standard_errors is not None:
            line += f", standard error {fit.standard_errors[i]:.2g}"
        if fit.intervals is not None and fit.level is not None:
            low, high = fit.intervals[i]
            line += f", {100 * fit.level:g} % interval {low:.6g} to {high:.6g}"
        lines.append(line)
    lines.append(f"Written by gtao {__version__}.")
    return [f"// {line}".rstrip() for line in lines]


def shader_code(fit: MultibounceFit, language: str = "hlsl") -> str:
    """A documented function ``MultiBounce(visibility, albedo)``, ready to paste.

    In HLSL, GLSL and WGSL the albedo and the result are colours of three channels; in C (C99 and C++) they are one
    channel. Coefficients are written so that a compiler reads the nearest 32-bit float. Fitted forms are kept between
    V and V + ρ (1 - V): a surface under a white sky can be neither darker than single-bounce visibility nor brighter
    than its brightest surroundings allow; the published cubic exceeds that by up to 1e-4 near V = 1. At V = 0 the
    result is 0.

    Args:
        fit: the function and its coefficients.
        language: "hlsl", "glsl", "wgsl" or "c".

    Raises:
        ConfigError: the language is unknown, a coefficient exceeds 32-bit floats, or a sum is too long to be written
            out.
    """
    if language not in LANGUAGES:
        raise ConfigError(f"language must be one of {', '.join(LANGUAGES)}, got {language!r}")
    L = LANGUAGES[language]
    formula, write = _FORMS[fit.form]
    body = write(L, fit.numbers)
    lines = _comment(fit, formula, bounded=any("bound" in line for line in body))
    if language == "c":
        lines += ["", "#include <math.h>", ""]
    lines += [*L.head.split("\n"), *(f"    {line}" for line in body), "}"]
    return "\n".join(lines) + "\n"
