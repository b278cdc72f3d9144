"""Code that looks tables up: compiled and run against the look-up of the package, in every language."""

import ctypes
import os
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from _compiled import SHIM, as_cpp, build
from drjit.auto.ad import Float64

import gtao
from gtao.data.specular import KINDS, SpecularTable
from gtao.errors import ConfigError
from gtao.io import table_code
from gtao.kernels.table_axes import AXES
from gtao.kernels.table_lookup import lookup

LANGUAGES = ("c", "hlsl", "glsl", "wgsl")
CONES = [("tilted", "cosine"), ("seed", "cosine"), ("tilted", "uniform")]
SIZE = (8, 6, 5, 4, 3)
#: Every parametrisation with one channel, and those of kinds that may have two with these too.
TABLES = [(kind, axes, n) for kind, axes in AXES for n in KINDS[kind][1]]
IDS = [f"{kind}-{axes}-{n}" for kind, axes, n in TABLES]
#: Where the cone comes from is the same for all of them.
CASES = [(of, cone) for of in TABLES for cone in CONES if cone == CONES[0] or of[1:] == ("linear", 1)]


def table(kind: str, axes: str, n_channels: int) -> SpecularTable:
    """Texels that all differ much from their neighbours, so that no mistake of place goes unseen."""
    shape = (*SIZE[: KINDS[kind][0]][::-1], n_channels)
    return SpecularTable(kind=kind, axes=axes, values=np.random.default_rng(1).random(shape).astype(np.float32))


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def surfaces(n: int, roughness: tuple[float, float], seed: int = 2) -> dict[str, np.ndarray]:
    """Random directions seen from above, wide and narrow cones, rough and smooth; float32."""
    rng = np.random.default_rng(seed)
    normal, view, bent = (unit(rng.normal(size=(n, 3))) for _ in range(3))
    view *= np.sign((normal * view).sum(-1, keepdims=True))
    bent = unit(bent + rng.choice([0.5, 2.0, 8.0], (n, 1)) * normal)
    given = {"normal": normal, "view": view, "bent_normal": bent}
    given |= {"visibility": rng.random(n), "roughness": rng.uniform(*roughness, n)}
    # Where nothing is visible there is no bent normal either.
    given["visibility"][::16] = 0
    given["bent_normal"][::32] = 0
    given["bent_normal"][16::32] = -normal[16::32]
    return {name: values.astype(np.float32) for name, values in given.items()}


def angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(-1))


def arguments(s: dict[str, np.ndarray], aperture: str, weighting: str) -> dict[str, np.ndarray]:
    """Angles and microfacet width of surfaces, in double precision from their definition."""
    n, v, b, A, roughness = (s[name].astype(np.float64) for name in s)
    reflected = 2 * (n * v).sum(-1, keepdims=True) * n - v
    n_b = (n * b).sum(-1)
    if weighting == "uniform":
        cosine = 1 - A
    elif aperture == "seed":
        cosine = np.sqrt(1 - A)
    else:
        cosine = np.sqrt(1 - np.divide(A, n_b, out=np.ones_like(A), where=n_b > A))
    w = unit(reflected)
    return {
        "alpha_v": np.arccos(cosine),
        "beta": angle(b, reflected),
        "alpha": roughness**2,
        "theta_o": angle(n, v),
        "chi": np.arctan2(np.abs((np.cross(w, n) * b).sum(-1)), (n * b).sum(-1) - (w * b).sum(-1) * (w * n).sum(-1)),
    }


def looked_up(t: SpecularTable, s: dict[str, np.ndarray], aperture: str, weighting: str) -> np.ndarray:
    """(n, C) by the package, in double precision."""
    axes = AXES[t.kind, t.axes]
    given = {name: Float64(values) for name, values in arguments(s, aperture, weighting).items()}
    values = lookup(Float64(t.values.ravel()), t.size, t.n_channels, axes.to_unit(**given))
    scale = axes.scale(**given)
    found = np.stack([np.broadcast_to((scale * v).numpy(), len(s["normal"])) for v in values], axis=-1)
    return found if t.kind == "environment-brdf" else np.where(s["visibility"][:, None] > 0, found, 0)


GIVEN = ("normal", "view", "bent_normal", "visibility", "roughness")


def function_of(code: str) -> tuple[str, list[str]]:
    """Name and parameters of the function that looks up."""
    heads = re.findall(r"(\w+)\(\s*((?:const float \*|Texture\dD<\w+> |sampler\dD |)table\b[^)]*)\)", code)
    (head,) = [head for head in heads if head[0][0].isupper() and not head[0].endswith(("Level", "Texels"))]
    return head[0], [p for p in GIVEN if re.search(rf"\b{p}\b", head[1])]


def entry(t: SpecularTable, language: str, code: str, space: str) -> str:
    """A function that C can call: texels, n, and (n, 11) numbers in, (n, C) out."""
    name, parameters = function_of(code)
    places = {"normal": 0, "view": 3, "bent_normal": 6, "visibility": 9, "roughness": 10}
    vector = "in + {0}" if language == "c" else "vec3(in[{0}], in[{0} + 1], in[{0} + 2])"
    given = [(vector if places[p] < 9 else "in[{0}]").format(places[p]) for p in parameters]
    if language == "c":
        called = ", ".join(["texels", *given])
        body = f"out[0] = {name}({called});" if t.n_channels == 1 else f"{name}({called}, out);"
        head = f"void {space}(const float *texels, int n, const float *in, float *out)"
    else:
        size = [*t.size[:2], int(np.prod(t.size[2:]))]
        texture = f"Texels{{texels, {{{', '.join(map(str, size))}}}, {t.n_channels}}}"
        called = ", ".join([texture, *(["SamplerState{}"] if language != "glsl" else []), *given])
        body = f"const auto r = {space}_code::{name}({called}); "
        body += "out[0] = r;" if t.n_channels == 1 else "out[0] = r.x; out[1] = r.y;"
        head = f'extern "C" void {space}(const float *texels, int n, const float *in, float *out)'
    return f"{head} {{ for (; n-- > 0; in += 11, out += {t.n_channels}) {{ {body} }} }}"


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """``run(language, (kind, axes, n_channels), (aperture, weighting), surfaces)``: (n, C) of compiled code."""
    folder = tmp_path_factory.mktemp("tables")
    libraries, cpp = {}, [SHIM]
    for i, (of, cone) in enumerate(CASES):
        t = table(*of)
        for language in LANGUAGES:
            space = f"{language}_{i}"
            code = table_code(t, language, aperture=cone[0], weighting=cone[1])
            if language == "c":
                libraries[space] = build(folder, f"{space}.c", f"{code}\n{entry(t, language, code, space)}")
            else:
                cpp += [f"namespace {space}_code {{\n{as_cpp(code, language)}}}", entry(t, language, code, space)]
    shared = build(folder, "a.cpp", "\n".join(cpp))

    def run(language, of, cone, s):
        space = f"{language}_{CASES.index((of, cone))}"
        numbers = np.concatenate([v.reshape(len(v), -1) for v in s.values()], axis=1).astype(np.float32)
        t = table(*of)
        out = np.full((len(numbers), t.n_channels), np.nan, np.float32)
        pointer = ctypes.POINTER(ctypes.c_float)
        texels, given, taken = (a.ctypes.data_as(pointer) for a in (t.values, np.ascontiguousarray(numbers), out))
        getattr(libraries.get(space, shared), space)(texels, len(numbers), given, taken)
        return out.astype(np.float64)

    return run


def test_every_parametrisation_has_code():
    from gtao.io.table_code_axes import COORDINATES

    assert set(COORDINATES) == set(AXES)


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize(("of", "cone"), CASES, ids=str)
def test_it_finds_what_the_package_finds(compiled, of, language, cone):
    """Coordinates are off by some roundings of single precision, 3e-7 in the angles, times 7 texels that differ by 1.

    The overlap of two cones divides them by the half angle of the smaller, 0.05 or more, of near mirrors 0.002.
    """
    for roughness, largest, rms in (((0.2, 1), 1e-4, 3e-6), ((0.03, 0.2), 3e-3, 1e-4)):
        s = surfaces(3000, roughness)
        difference = np.abs(compiled(language, of, cone, s) - looked_up(table(*of), s, *cone))
        assert difference.max() < largest
        assert np.sqrt(np.mean(difference**2)) < rms


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("of", TABLES, ids=IDS)
def test_the_ends_of_every_axis(compiled, of, language):
    """Closed and open, mirrors, views at and below the horizon, bent normals along and against the reflection."""
    z = np.array([0, 0, 1])
    views = np.array([z, *(unit(np.array([1, 0, height])) for height in (1, 1e-3, -1e-2))])
    bents = np.array([z, unit(np.array([-1, 0, 1])), unit(np.array([1, 0, 0.2])), [1, 0, 0]])
    grid = [(v, b, A, r) for v in views for b in bents for A in (0, 1e-4, 0.5, 1) for r in (0, 0.3, 1)]
    v, b, A, r = (np.array(column, np.float32) for column in zip(*grid, strict=True))
    s = {
        "normal": np.broadcast_to(z, v.shape).astype(np.float32),
        "view": v,
        "bent_normal": b,
        "visibility": A,
        "roughness": r,
    }
    got, cone = compiled(language, of, ("tilted", "cosine"), s), arguments(s, "tilted", "cosine")
    assert ((got >= 0) & (got <= 1 + 1e-6)).all()
    # Of cones that are next to nothing the overlap is next to anything.
    wide = (cone["alpha_v"] > 0.05) & (cone["alpha"] > 0.05)
    expected = looked_up(table(*of), s, "tilted", "cosine")
    assert wide.any()
    assert np.abs(got - expected)[wide].max() < 1e-4


@pytest.mark.parametrize("language", LANGUAGES)
def test_reflectance_and_occlusion_of_any_f0(tmp_path, language):
    of = next(of for of in TABLES if of[2] == 2 and of[0] != "environment-brdf")
    code = table_code(table(*of), language)
    assert "/" not in code[code.index("SpecularReflectance") : code.index("// S alone")]
    if language == "c":
        body = "result[0] = SpecularReflectance(s, e, f0); result[1] = SpecularOcclusion(s, e, f0);"
        source = code + f"void f(const float *s, const float *e, float f0, float *result) {{ {body} }}"
    else:
        given = "vec2(s[0], s[1]), vec2(e[0], e[1]), vec3(0.5f, f0, 0.25f)"
        body = f"result[0] = SpecularReflectance({given}).y; result[1] = SpecularOcclusion({given}).y;"
        head = 'extern "C" void f(const float *s, const float *e, float f0, float *result)'
        source = f"{SHIM}\n{as_cpp(code, language)}\n{head} {{ {body} }}"
    library = build(tmp_path, "a.c" if language == "c" else "a.cpp", source)
    pair = ctypes.c_float * 2
    for s, e, f0 in (((0.3, 0.7), (0.8, 0.05), 0.04), ((1, 1), (0.5, 0.01), 1.0), ((0, 1), (0.9, 0.1), 0.0)):
        out = pair()
        library.f(pair(*s), pair(*e), ctypes.c_float(f0), out)
        reflected = f0 * e[0] * s[0] + e[1] * s[1]
        assert out[0] == pytest.approx(reflected, rel=3e-7)
        assert out[1] == pytest.approx(reflected / (f0 * e[0] + e[1]), rel=5e-7)
    # A mirror without F0, seen straight on: the limit for F0 = 0, not 0 / 0.
    library.f(pair(0.3, 0.7), pair(1, 0), ctypes.c_float(0), out)
    assert out[1] == pytest.approx(0.7, rel=5e-7)


@pytest.mark.parametrize("language", ["hlsl", "glsl"])
@pytest.mark.parametrize("of", TABLES, ids=IDS)
def test_a_compiler_of_shaders_takes_it(tmp_path, of, language):
    beside = os.pathsep.join([os.environ.get("PATH", ""), os.path.dirname(sys.executable)])
    glslang = shutil.which("glslangValidator", path=beside)
    if not glslang:
        pytest.skip("glslang is not installed")
    code = table_code(table(*of), language)
    if language == "hlsl":
        code += "float4 main() : SV_Target { return float4(0, 0, 0, 0); }"
        options = ["-D", "-V", "-e", "main"]
    else:
        code, options = f"#version 330\n{code}void main() {{}}\n", []
    (tmp_path / "a.frag").write_text(code)
    command = [glslang, *options, "-S", "frag", "a.frag"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("of", TABLES, ids=IDS)
def test_what_the_comment_says(of, language):
    t = table(*of)
    code = table_code(t, language)
    comment = code[: code.index("\n\n")]
    assert all(line.startswith("//") for line in comment.splitlines())
    assert f"Table {t.kind} of {'x'.join(map(str, t.size))} texels, axes {t.axes}." in comment
    assert f"Written by gtao {gtao.__version__}." in comment
    assert code.isascii()
    assert max(map(len, code.splitlines())) <= 140
    # Each parameter is explained, and no other.
    explained = set(re.findall(r"^// (\w+): ", comment, re.M)) - {"returns", "Source"}
    assert explained == {"table", *function_of(code)[1]}
    for opening, closing in ("()", "[]", "{}"):
        assert code.count(opening) == code.count(closing)


def test_refused():
    t = table("cone-cone", "linear", 1)
    for call, words in (
        (lambda: table_code(t, "metal"), "language must be one of hlsl, glsl, wgsl, c, got 'metal'"),
        (lambda: table_code(t, aperture="matched"), "apertures 'seed' and 'tilted' .* got 'matched' and 'cosine'"),
        (lambda: table_code(t, weighting="both"), "got 'seed' and 'both'"),
        (
            lambda: table_code(table("cone-cone", "other", 1)),
            "no code for the axes 'other' of a table 'cone-cone'; there",
        ),
    ):
        with pytest.raises(ConfigError, match=words):
            call()


def test_the_source_is_told():
    t = table("cone-cone", "linear", 1)
    told = SpecularTable(kind=t.kind, axes=t.axes, values=t.values, source="a record")
    assert "// Source: a record\n" in table_code(told)
    assert "Source" not in table_code(t)
