"""How HLSL, GLSL, WGSL and C spell the little that exported code needs."""

from dataclasses import dataclass

import numpy as np

from gtao.errors import ConfigError

__all__ = ["LANGUAGES", "Language", "language_of"]


@dataclass(frozen=True)
class Language:
    """Declarations, literals and functions; a colour has three channels, except in C, where it is one number."""

    colour_value: str
    number_value: str
    splat: str
    minimum: str = "min"
    maximum: str = "max"
    absolute: str = "abs"
    floor: str = "floor"
    root: str = "sqrt"
    exponential: str = "exp"
    sine: str = "sin"
    arcsine: str = "asin"
    arctangent: str = "atan2"
    choice: str = "({condition} ? {then} : {otherwise})"
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

    def call(self, function: str, value: str) -> str:
        """``absolute``, ``floor``, ``root``, ``exponential``, ``sine`` or ``arcsine`` of a value."""
        return f"{getattr(self, function)}({value})"

    def angle(self, y: str, x: str) -> str:
        """Of (x, y) from the first axis."""
        return f"{self.arctangent}({y}, {x})"

    def select(self, condition: str, then: str, otherwise: str) -> str:
        """One of two numbers, both of which are computed."""
        return self.choice.format(condition=condition, then=then, otherwise=otherwise)


LANGUAGES: dict[str, Language] = {
    "hlsl": Language(
        colour_value="const float3 {name} = {value};",
        number_value="const float {name} = {value};",
        splat="float3({0}, {0}, {0})",
    ),
    "glsl": Language(
        colour_value="vec3 {name} = {value};",
        number_value="float {name} = {value};",
        splat="vec3({0})",
        arctangent="atan",
    ),
    "wgsl": Language(
        colour_value="let {name} = {value};",
        number_value="let {name} = {value};",
        splat="vec3f({0})",
        choice="select({otherwise}, {then}, {condition})",
    ),
    "c": Language(
        colour_value="const float {name} = {value};",
        number_value="const float {name} = {value};",
        splat="{0}",
        minimum="fminf",
        maximum="fmaxf",
        absolute="fabsf",
        floor="floorf",
        root="sqrtf",
        exponential="expf",
        sine="sinf",
        arcsine="asinf",
        arctangent="atan2f",
        suffix="f",
    ),
}


def language_of(name: str) -> Language:
    """The language of that name.

    Raises:
        ConfigError: there is none.
    """
    if name not in LANGUAGES:
        raise ConfigError(f"language must be one of {', '.join(LANGUAGES)}, got {name!r}")
    return LANGUAGES[name]
