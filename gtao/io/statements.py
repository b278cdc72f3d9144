"""Functions on a few numbers, written once and spelled in every language."""

from collections.abc import Mapping
from dataclasses import dataclass

from .languages import Language, language_of

__all__ = ["Writer"]

#: Kinds of values -> how many numbers they are; a colour has three, except in C, where it is one.
_COUNTS = {"number": 1, "pair": 2, "direction": 3, "four": 4, "nine": 9}

_VECTORS = {
    "hlsl": {1: "float", 2: "float2", 3: "float3", 4: "float4"},
    "glsl": {1: "float", 2: "vec2", 3: "vec3", 4: "vec4"},
    "wgsl": {1: "f32", 2: "vec2f", 3: "vec3f", 4: "vec4f", 9: "array<f32, 9>"},
}

#: A texture and its sampler, of so many channels; in C the numbers of its texels.
_TEXTURES = {
    "hlsl": "Texture{dimensions}D<{type}> {name}, SamplerState {name}_sampler",
    "glsl": "sampler{dimensions}D {name}",
    "wgsl": "{name}: texture_{dimensions}d<f32>, {name}_sampler: sampler",
    "c": "const float *{name}",
}
_SAMPLES = {
    "hlsl": "{name}.SampleLevel({name}_sampler, {place}, 0.0)",
    "glsl": "textureLod({name}, {place}, 0.0){channels}",
    "wgsl": "textureSampleLevel({name}, {name}_sampler, {place}, 0.0){channels}",
}


@dataclass(frozen=True)
class Writer:
    """Statements on numbers, so that one text serves all languages; only C has no vectors."""

    language: str

    @property
    def L(self) -> Language:
        return language_of(self.language)

    def read(self, vector: str, i: int) -> str:
        return f"{vector}[{i}]" if self.language == "c" else f"{vector}.{'xyzw'[i]}"

    def number(self, x: float) -> str:
        return self.L.number(x)

    def let(self, name: str, value: str, n: int = 1) -> str:
        """A variable of n numbers; in C of one."""
        if n == 1 or self.language == "wgsl":
            return self.L.scalar(name, value)
        return f"{'const ' if self.language == 'hlsl' else ''}{_VECTORS[self.language][n]} {name} = {value};"

    def clamped(self, value: str, low: float = 0, high: float = 1) -> str:
        return self.L.min(self.L.max(value, self.number(low)), self.number(high))

    def dot(self, a: str, b: str) -> str:
        return " + ".join(f"{self.read(a, i)} * {self.read(b, i)}" for i in range(3))

    def vector(self, *values: str) -> str:
        """Not in C."""
        return f"{_VECTORS[self.language][len(values)]}({', '.join(values)})"

    def sample(self, texture: str, n_channels: int, *place: str) -> str:
        """Of the first level, filtered; not in C."""
        channels = "." + "xyzw"[:n_channels]
        return _SAMPLES[self.language].format(name=texture, place=self.vector(*place), channels=channels)

    def result(self, *values: str) -> list[str]:
        if len(values) == 1:
            return [f"return {values[0]};"]
        if self.language == "c":
            return [f"result[{i}] = {value};" for i, value in enumerate(values)]
        return [f"return {self.vector(*values)};"]

    def normalised(self) -> str:
        """1 / length of (x, y, z); where there is no length, 0 stays 0."""
        square = self.L.max("x * x + y * y + z * z", self.number(1e-30))
        return self.let("scale", f"{self.number(1)} / {self.L.call('root', square)}")

    def _count(self, kind: str) -> int:
        return _COUNTS.get(kind, 1 if self.language == "c" else 3)

    def _declared(self, name: str, kind: str) -> str:
        if kind.startswith("texture"):
            _, dimensions, n_channels = kind.split()
            scalar = _VECTORS["hlsl"][int(n_channels)]
            return _TEXTURES[self.language].format(name=name, dimensions=dimensions, type=scalar)
        n = self._count(kind)
        if self.language == "wgsl":
            return f"{name}: {_VECTORS['wgsl'][n]}"
        if self.language == "c":
            return f"const float {name}[{n}]" if n > 1 else f"float {name}"
        return f"float {name}[{n}]" if n > 4 else f"{_VECTORS[self.language][n]} {name}"

    def function(self, name: str, returns: str, parameters: Mapping[str, str], body: list[str]) -> list[str]:
        """A function of parameters, name -> kind.

        Kinds are "number", "pair", "direction", "four", "colour", "nine" and "texture D C" with D dimensions and C
        channels. Nine numbers are returned as the array ``sh``, which is there for the body to fill; what else C
        returns beside a number is ``result``.
        """
        declared = [self._declared(p, kind) for p, kind in parameters.items()]
        n = self._count(returns)
        if self.language == "wgsl":
            if returns == "nine":
                body = ["var sh: array<f32, 9>;", *body, "return sh;"]
            head = _wrapped(f"fn {name}(", declared, f") -> {_VECTORS['wgsl'][n]} {{")
            return ["", *head, *(f"    {line}" for line in body), "}"]
        kept, out = ("static inline ", "") if self.language == "c" else ("", "out ")
        if n == 9 or (self.language == "c" and n > 1):
            declared.append(f"{out}float {'sh' if returns == 'nine' else 'result'}[{n}]")
            returned = "void"
        else:
            returned = _VECTORS["glsl" if self.language == "glsl" else "hlsl"][n]
        return ["", *_wrapped(f"{kept}{returned} {name}(", declared, ")"), "{", *(f"    {b}" for b in body), "}"]


def _wrapped(start: str, words: list[str], end: str) -> list[str]:
    """In one line, or each word in its own."""
    line = start + ", ".join(words) + end
    if len(line) <= 120:
        return [line]
    return [start, *(f"    {word}," for word in words[:-1]), f"    {words[-1]}{end}"]
