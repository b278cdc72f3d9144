"""Fitted multi-bounce functions as shader code: HLSL, GLSL, WGSL and C."""

import math
from collections.abc import Callable

from gtao._version import __version__
from gtao.data.multibounce import MultibounceFit
from gtao.errors import ConfigError

from .languages import Language, language_of

__all__ = ["shader_code"]

#: Longest sum that is written out term by term.
MAX_UNROLLED = 32


_HEADS = {
    "hlsl": "float3 MultiBounce(float visibility, float3 albedo)\n{",
    "glsl": "vec3 MultiBounce(float visibility, vec3 albedo)\n{",
    "wgsl": "fn MultiBounce(visibility: f32, albedo: vec3f) -> vec3f {",
    "c": "static inline float MultiBounce(float visibility, float albedo)\n{",
}


def _bounded(L: Language, value: str) -> list[str]:
    """Between single-bounce visibility and the energy bound visibility + albedo (1 - visibility)."""
    one = L.number(1)
    return [
        L.colour("bounced", value),
        L.colour("bound", f"visibility + albedo * ({one} - visibility)"),
        f"return {L.min(L.max('bounced', L.splat.format('visibility')), 'bound')};",
    ]


def _linear_cubic(L: Language, c: tuple[float, ...]) -> list[str]:
    a1, a0, b1, b0, c1, c0 = c
    return [
        L.colour("a", f"{L.number(a1)} * albedo {L.plus(a0)}"),
        L.colour("b", f"{L.number(b1)} * albedo {L.plus(b0)}"),
        L.colour("c", f"{L.number(c1)} * albedo {L.plus(c0)}"),
        *_bounded(L, "((a * visibility + b) * visibility + c) * visibility"),
    ]


def _four_parameter(L: Language, c: tuple[float, ...]) -> list[str]:
    k0, k1, k2, k3 = c
    return [
        L.scalar("inner", f"{L.number(k0)} {L.plus(k1)} * visibility"),
        L.scalar("slope", f"{L.number(k2)} {L.plus(k3)} * visibility"),
        L.scalar("hump", f"visibility * ({L.number(1)} - visibility)"),
        *_bounded(L, "visibility + albedo * hump * (inner + albedo * slope)"),
    ]


def _quotient(L: Language, kept: str) -> list[str]:
    """``kept`` is κ ρ. 1 - κ ρ (1 - V) is summed so that nothing cancels, and kept from 0 where V is 0."""
    return [
        L.colour("kept", kept),
        L.colour("denominator", f"({L.number(1)} - kept) + kept * visibility"),
    ]


def _divided(L: Language) -> str:
    return f"visibility / {L.max('denominator', L.splat.format(L.number(1e-30)))}"


def _one_parameter(L: Language, c: tuple[float, ...]) -> list[str]:
    return [*_quotient(L, f"{L.number(c[0])} * albedo"), *_bounded(L, _divided(L))]


def _two_parameter(L: Language, c: tuple[float, ...]) -> list[str]:
    kappa = f"({L.number(c[0])} {L.plus(c[1])} * visibility)"
    return [*_quotient(L, f"{kappa} * albedo"), *_bounded(L, _divided(L))]


def _sphere(L: Language, c: tuple[float, ...]) -> list[str]:
    return [L.colour("denominator", f"({L.number(1)} - albedo) + albedo * visibility"), f"return {_divided(L)};"]


def _sphere_truncated(L: Language, c: tuple[float, ...]) -> list[str]:
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


_FORMS: dict[str, tuple[str, Callable[[Language, tuple[float, ...]], list[str]]]] = {
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
    L = language_of(language)
    formula, write = _FORMS[fit.form]
    body = write(L, fit.numbers)
    lines = _comment(fit, formula, bounded=any("bound" in line for line in body))
    if language == "c":
        lines += ["", "#include <math.h>", ""]
    lines += [*_HEADS[language].split("\n"), *(f"    {line}" for line in body), "}"]
    return "\n".join(lines) + "\n"
