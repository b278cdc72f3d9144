"""Functions on a few numbers, written once and spelled in every language."""

from dataclasses import dataclass

from .languages import Language, language_of

__all__ = ["Writer"]

#: Heads of the two functions; WGSL returns what the others are given to fill.
_HEADS = {
    "hlsl": {
        "texel": "float4 {name}(float4 texel)\n{{",
        "sh": "float4 {name}(float sh[9])\n{{",
        "expand": "void {name}(float4 moments, out float sh[9])\n{{",
    },
    "glsl": {
        "texel": "vec4 {name}(vec4 texel)\n{{",
        "sh": "vec4 {name}(float sh[9])\n{{",
        "expand": "void {name}(vec4 moments, out float sh[9])\n{{",
    },
    "wgsl": {
        "texel": "fn {name}(texel: vec4f) -> vec4f {{",
        "sh": "fn {name}(sh: array<f32, 9>) -> vec4f {{",
        "expand": "fn {name}(moments: vec4f) -> array<f32, 9> {{\n    var sh: array<f32, 9>;",
    },
    "c": {
        "texel": "static inline void {name}(const float texel[4], float result[4])\n{{",
        "sh": "static inline void {name}(const float sh[9], float result[4])\n{{",
        "expand": "static inline void {name}(const float moments[4], float sh[9])\n{{",
    },
}
_RETURNS = {
    "hlsl": ["return float4({}, {}, {}, {});"],
    "glsl": ["return vec4({}, {}, {}, {});"],
    "wgsl": ["return vec4f({}, {}, {}, {});"],
    "c": ["result[0] = {};", "result[1] = {};", "result[2] = {};", "result[3] = {};"],
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

    def let(self, name: str, value: str) -> str:
        return self.L.scalar(name, value)

    def result(self, *values: str) -> list[str]:
        lines = _RETURNS[self.language]
        if len(lines) == 1:
            return [lines[0].format(*values)]
        return [line.format(value) for line, value in zip(lines, values, strict=True)]

    def normalised(self) -> str:
        """1 / length of (x, y, z); where there is no length, 0 stays 0."""
        square = self.L.max("x * x + y * y + z * z", self.number(1e-30))
        return self.let("scale", f"{self.number(1)} / {self.L.call('root', square)}")

    def function(self, kind: str, name: str, body: list[str]) -> list[str]:
        """Of a "texel", of nine coefficients ("sh"), or of moments into coefficients ("expand")."""
        head = _HEADS[self.language][kind].format(name=name).split("\n")
        end = ["    return sh;"] if kind == "expand" and self.language == "wgsl" else []
        return ["", *head, *(f"    {line}" for line in body), *end, "}"]
