"""Shader code as C++, so that a compiler of this machine can run it, and the C code as it is."""

import ctypes
import re
import shutil
import subprocess

import pytest

STRICT = ["-O1", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-Wno-unused-function", "-shared", "-fPIC"]

#: Vectors, and textures as samplers filter them: linearly, clamped at the edges, texel centres at halves.
SHIM = r"""
#include <algorithm>
#include <cmath>
struct vec2 { float x, y; vec2(float a, float b) : x(a), y(b) {} };
struct vec3 {
    float x, y, z;
    vec3(float a, float b, float c) : x(a), y(b), z(c) {}
    explicit vec3(float a) : x(a), y(a), z(a) {}
};
struct vec4 {
    float x, y, z, w;
    vec2 xy;
    vec4(float a, float b, float c, float d) : x(a), y(b), z(c), w(d), xy(a, b) {}
};
typedef vec2 float2; typedef vec2 vec2f;
typedef vec3 float3; typedef vec3 vec3f;
typedef vec4 float4; typedef vec4 vec4f;
struct float9 { float a[9]; float &operator[](int i) { return a[i]; } };
#define EACH(op) \
    static vec2 operator op(vec2 a, vec2 b) { return vec2(a.x op b.x, a.y op b.y); } \
    static vec2 operator op(float a, vec2 b) { return vec2(a op b.x, a op b.y); } \
    static vec2 operator op(vec2 a, float b) { return vec2(a.x op b, a.y op b); } \
    static vec3 operator op(vec3 a, vec3 b) { return vec3(a.x op b.x, a.y op b.y, a.z op b.z); } \
    static vec3 operator op(float a, vec3 b) { return vec3(a) op b; } \
    static vec3 operator op(vec3 a, float b) { return a op vec3(b); }
EACH(+) EACH(-) EACH(*) EACH(/)
static vec3 min(vec3 a, vec3 b) { return vec3(std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)); }
static vec3 max(vec3 a, vec3 b) { return vec3(std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)); }
using std::abs; using std::floor; using std::max; using std::min; using std::sqrt; using std::exp; using std::sin;
using std::asin; using std::atan2;
static float atan(float y, float x) { return atan2(y, x); }
static float select(float otherwise, float then, bool condition) { return condition ? then : otherwise; }

struct Texels { const float *texels; int size[3]; int n_channels; };
static float filtered(const Texels &t, const float place[3], int channel) {
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
        double weight = 1;
        int index = 0;
        for (int axis = 2; axis >= 0; --axis) {
            const double p = (double)place[axis] * t.size[axis] - 0.5;
            const int low = (int)std::floor(p), i = std::clamp(low + (corner >> axis & 1), 0, t.size[axis] - 1);
            weight *= corner >> axis & 1 ? p - low : 1 - (p - low);
            index = index * t.size[axis] + i;
        }
        sum += weight * t.texels[index * t.n_channels + channel];
    }
    return (float)sum;
}
static vec4 sampled(const Texels &t, vec2 p) {
    const float place[3] = {p.x, p.y, 0.5f};
    return vec4(filtered(t, place, 0), t.n_channels > 1 ? filtered(t, place, 1) : 0, 0, 1);
}
static vec4 sampled(const Texels &t, vec3 p) {
    const float place[3] = {p.x, p.y, p.z};
    return vec4(filtered(t, place, 0), t.n_channels > 1 ? filtered(t, place, 1) : 0, 0, 1);
}
struct SamplerState {}; typedef SamplerState sampler;
static float as(vec4 v, const float *) { return v.x; }
static vec2 as(vec4 v, const vec2 *) { return v.xy; }
template <class T, class P> struct Texture : Texels {
    Texture(const Texels &t) : Texels(t) {}
    T SampleLevel(SamplerState, P place, float) const { return as(sampled(*this, place), (const T *)0); }
};
template <class T> using Texture2D = Texture<T, vec2>;
template <class T> using Texture3D = Texture<T, vec3>;
typedef Texels sampler2D; typedef Texels sampler3D; typedef Texels texture_2d; typedef Texels texture_3d;
template <class P> static vec4 textureLod(const Texels &t, P place, float) { return sampled(t, place); }
template <class P> static vec4 textureSampleLevel(const Texels &t, sampler, P p, float) { return sampled(t, p); }
"""

#: Types of WGSL, the longer ones first.
_TYPES = {
    "array<f32, 9>": "float9",
    "texture_2d<f32>": "texture_2d",
    "texture_3d<f32>": "texture_3d",
    "f32": "float",
}


def as_cpp(code: str, language: str) -> str:
    """The same statements as C++: only the way to declare and to hand over arrays is spelled differently."""
    code = re.sub(r"\bout float sh\[9\]", "float (&sh)[9]", code)
    if language != "wgsl":
        return code
    for theirs, ours in _TYPES.items():
        code = code.replace(theirs, ours)

    def head(match: re.Match) -> str:
        declared = ", ".join(f"{kind} {name}" for name, kind in re.findall(r"(\w+): (\w+)", match[2]))
        return f"{match[3]} {match[1]}({declared}) {{"

    code = re.sub(r"fn (\w+)\(([^)]*)\) -> (\w+) \{", head, code)
    code = re.sub(r"\blet (\w+) =", r"const auto \1 =", code)
    code = re.sub(r"\bvar (\w+): (\w+);", r"\2 \1;", code)
    assert not re.search(r"\bfn |\bvar |array<", re.sub(r"//.*", "", code))
    return code


def build(folder, name: str, code: str) -> ctypes.CDLL:
    """The library of a C99 or C++ file, which compiles without a warning; a skip where nothing can compile it."""
    c = name.endswith(".c")
    compiler = (shutil.which("gcc") or shutil.which("cc")) if c else (shutil.which("g++") or shutil.which("c++"))
    if not compiler:
        pytest.skip("no C and C++ compiler on this machine")
    (folder / name).write_text(code)
    # Literals of shaders are of single precision.
    standard = ["-std=c99"] if c else ["-std=c++17", "-fsingle-precision-constant"]
    library = folder / f"{name}.so"
    command = [compiler, *standard, *STRICT, name, "-o", str(library), "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return ctypes.CDLL(str(library))
