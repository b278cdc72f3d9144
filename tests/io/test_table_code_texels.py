"""Exported code finds texels: against linear interpolation by SciPy, up to five axes, with texels far apart."""

import ctypes

import numpy as np
import pytest
from _compiled import SHIM, as_cpp, build
from scipy.interpolate import RegularGridInterpolator

from gtao.data.specular import KINDS, SpecularTable
from gtao.io.statements import Writer
from gtao.io.table_code_texels import AXES, lookup_in_c, sampled, texture_kind

LANGUAGES = ("hlsl", "glsl", "wgsl", "c")
SIZE = (7, 6, 5, 4, 3)
CASES = [(kind, n) for kind, (_, channels) in KINDS.items() for n in channels]


def table(kind: str, n_channels: int) -> SpecularTable:
    shape = (*SIZE[: KINDS[kind][0]][::-1], n_channels)
    return SpecularTable(kind=kind, axes="any", values=np.random.default_rng(1).random(shape).astype(np.float32))


def program(t: SpecularTable, language: str) -> str:
    """C or C++ with a function ``run`` of texels, n, (n, axes) coordinates and (n, channels) to be filled."""
    letters = AXES[: len(t.size)]
    step = f"in += {len(letters)}, out += {t.n_channels}"
    head = "void run(const float *texels, int n, const float *in, float *out)"
    if language == "c":
        calls = " ".join(f"out[{i}] = Look(texels, in, {i});" for i in range(t.n_channels))
        return "\n".join([*lookup_in_c("Look", t), f"{head} {{ for (; n-- > 0; {step}) {{ {calls} }} }}"])
    w = Writer(language)
    lines, value = sampled(w, t)
    given = {"table": texture_kind(t), **dict.fromkeys(letters, "number")}
    code = w.function("Look", "pair" if t.n_channels == 2 else "number", given, [*lines, *w.result(value)])
    depth = int(np.prod(t.size[2:]))
    texture = f"Texels{{texels, {{{t.size[0]}, {t.size[1]}, {depth}}}, {t.n_channels}}}"
    called = [texture, *(["SamplerState{}"] if language != "glsl" else []), *(f"in[{i}]" for i in range(len(letters)))]
    stored = "out[0] = r.x; out[1] = r.y;" if t.n_channels == 2 else "out[0] = r;"
    body = f"{{ for (; n-- > 0; {step}) {{ const auto r = Look({', '.join(called)}); {stored} }} }}"
    return "\n".join([SHIM, as_cpp("\n".join(code), language), f'extern "C" {head} {body}'])


def looked_up(tmp_path, t: SpecularTable, language: str, unit: np.ndarray) -> np.ndarray:
    library = build(tmp_path, "a.c" if language == "c" else "a.cpp", program(t, language))
    given, out = np.ascontiguousarray(unit, np.float32), np.full((len(unit), t.n_channels), np.nan, np.float32)
    pointer = ctypes.POINTER(ctypes.c_float)
    library.run(*(a if isinstance(a, int) else a.ctypes.data_as(pointer) for a in (t.values, len(unit), given, out)))
    return out


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize(("kind", "n_channels"), CASES)
def test_linear_between_all_texels(tmp_path, kind, n_channels, language):
    t = table(kind, n_channels)
    rng, n_axes = np.random.default_rng(2), len(t.size)
    inside = rng.random((500, n_axes))
    # Also on the faces and at the corners, and on the texels themselves.
    ends = np.where(rng.random((500, n_axes)) < 0.5, rng.integers(0, 2, (500, n_axes)), inside)
    texels = np.stack([rng.integers(0, n, 200) / (n - 1) for n in t.size], axis=1)
    unit = np.concatenate([inside, ends, texels]).astype(np.float32)
    grid = [np.linspace(0, 1, n) for n in t.size[::-1]]
    expected = RegularGridInterpolator(grid, t.values.astype(np.float64))(np.minimum(unit[:, ::-1], 1))
    got = looked_up(tmp_path, t, language, unit)
    # A place among the 60 slices of five axes is rounded to 60 x 6e-8 twice, between texels that differ by up to 1.
    assert np.abs(got - expected).max() < 1e-5


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("kind", ["brdf-4d", "brdf-5d"])
def test_slabs_do_not_bleed(tmp_path, kind, language):
    """At the texels of w and v nothing is seen of the slabs beside, at either end of z: they are 1000 here."""
    n_axes = KINDS[kind][0]
    values = np.full((*SIZE[:n_axes][::-1], 1), 1000, np.float32)
    at = (1,) * (n_axes - 3)
    values[at] = 0
    t = SpecularTable(kind=kind, axes="any", values=values)
    w = [1 / (n - 1) for n in t.size[3:]]
    unit = np.array([(0.3, 0.6, z, *w) for z in (0, 0.5, 1)])
    # In single precision a place among 60 slices is off by 60 x 6e-8 of a slice.
    assert np.abs(looked_up(tmp_path, t, language, unit)).max() < 1000 * 4e-6
