"""Code that reads packed directions back: compiled and run against NumPy, in every language that C++ can be made of."""

import ctypes

import numpy as np
import pytest
from _compiled import SHIM, as_cpp, build
from _directions import bent, cone, estimate, random_directions

import gtao
from gtao.errors import ConfigError
from gtao.io import PACKINGS, Directions, pack, packing_code, unpack

LANGUAGES = ("c", "hlsl", "glsl", "wgsl")
WEIGHTINGS = ("cosine", "uniform")
#: Packings with VisibilityHarmonics; that is all that zh16 needs.
MOMENTS = ("moments8", "zh16")


def calls(name, language):
    """(function, numbers in, numbers out, C++ that calls it with pointers ``in`` and ``out``)."""
    if name != "zh16":
        function = f"Unpack{name.capitalize()}"
        if name == "sh16":
            given = "float9 v; for (int j = 0; j < 9; ++j) v[j] = in[j];" if language == "wgsl" else ""
            given = given or "float v[9]; for (int j = 0; j < 9; ++j) v[j] = in[j];"
            n = 9
        else:
            given, n = "vec4 v(in[0], in[1], in[2], in[3]);", 4
        body = f"{given} vec4 r = NAME::{function}(v); out[0] = r.x; out[1] = r.y; out[2] = r.z; out[3] = r.w;"
        yield "unpack", n, 4, f"{function}(in, out);" if language == "c" else body
    if name in MOMENTS:
        given = "vec4 v(in[0], in[1], in[2], in[3]);"
        taken = "float9 r = NAME::VisibilityHarmonics(v);" if language == "wgsl" else "float r[9];"
        taken += "" if language == "wgsl" else " NAME::VisibilityHarmonics(v, r);"
        body = f"{given} {taken} for (int j = 0; j < 9; ++j) out[j] = r[j];"
        yield "expand", 4, 9, "VisibilityHarmonics(in, out);" if language == "c" else body


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """``run(language, name, weighting, what, numbers)``: "unpack" or "expand" of (n, 4) or (n, 9) numbers."""
    folder = tmp_path_factory.mktemp("packing")
    libraries, sizes, cpp = {}, {}, [SHIM]
    for name in PACKINGS:
        for weighting in WEIGHTINGS:
            for language in LANGUAGES:
                space = f"{language}_{name}_{weighting}"
                code = packing_code(name, language, weighting)
                entries = []
                for what, n_in, n_out, body in calls(name, language):
                    sizes[name, what] = n_in, n_out
                    head = f"void {what}_{space}(int n, const float *in, float *out)"
                    loop = f"{{ for (; n-- > 0; in += {n_in}, out += {n_out}) {{ {body.replace('NAME', space)} }} }}"
                    entries.append(f"{head} {loop}")
                if language == "c":  # the names of the functions meet only in one file each
                    libraries[space] = build(folder, f"{space}.c", "\n".join([code, *entries]))
                else:
                    cpp += [f"namespace {space} {{\n{as_cpp(code, language)}}}", *(f'extern "C" {e}' for e in entries)]
    shared = build(folder, "a.cpp", "\n".join(cpp))

    def run(language, name, weighting, what, numbers):
        space = f"{language}_{name}_{weighting}"
        n_in, n_out = sizes[name, what]
        numbers = np.ascontiguousarray(numbers, dtype=np.float32).reshape(-1, n_in)
        out = np.full((len(numbers), n_out), np.nan, np.float32)
        pointer = ctypes.POINTER(ctypes.c_float)
        function = getattr(libraries.get(space, shared), f"{what}_{space}")
        function(len(numbers), *(a.ctypes.data_as(pointer) for a in (numbers, out)))
        return out.astype(np.float64)

    return run


def some(name, weighting):
    """Texels of a frame and of directions all over the sphere, the axes and the folds among them."""
    d = np.concatenate([random_directions(3000), np.eye(3), -np.eye(3), random_directions(200) * (1, 1, 0)])
    visibility = np.random.default_rng(4).random(d.shape[0])
    ratio = np.random.default_rng(5).uniform(0.4, 1, d.shape[0])
    unit = d / np.linalg.norm(d, axis=-1, keepdims=True)
    sphere = Directions(
        visibility=visibility[None],
        bent_normal=unit[None],
        mean_direction=(unit * (ratio * visibility)[:, None])[None],
        visibility_sh=np.random.default_rng(6).uniform(-1, 1, (1, d.shape[0], 9)),
        weighting=weighting,
    )
    return [pack(ao, name) for ao in (sphere, estimate(weighting))]


def sampled(texels, name):
    """What a sampler hands to the shader: four numbers, integers divided by the largest, a missing alpha 1."""
    numbers = texels.reshape(-1, texels.shape[2]).astype(np.float32)
    if np.issubdtype(texels.dtype, np.integer):
        numbers /= np.float32(np.iinfo(texels.dtype).max)
    if numbers.shape[1] == 3:
        numbers = np.concatenate([numbers, np.ones_like(numbers[:, :1])], axis=1)
    return numbers


@pytest.mark.parametrize("weighting", WEIGHTINGS)
@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("name", [name for name in PACKINGS if name != "zh16"])
def test_it_reads_what_numpy_reads(compiled, name, language, weighting):
    for texels in some(name, weighting):
        got = compiled(language, name, weighting, "unpack", sampled(texels, name))
        expected = unpack(texels, name, weighting)
        vector = expected.bent_normal if PACKINGS[name].needs == "bent_normal" else expected.mean_direction
        # A few roundings of numbers up to 3 in single precision.
        assert np.abs(got[:, :3] - vector.reshape(-1, 3)).max() < 6e-7
        assert np.abs(got[:, 3] - expected.visibility.ravel()).max() < 3e-7


@pytest.mark.parametrize("weighting", WEIGHTINGS)
@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("name", MOMENTS)
def test_harmonics_of_cones(compiled, name, language, weighting):
    """Where a cone about the normal is visible, its mean direction says all: nine exact coefficients."""
    cases = [cone(axis, x, weighting) for axis in random_directions(40) for x in (0.0, 0.2, 0.5, 0.9, 0.99)]
    moments = [[*mean, visibility] for visibility, mean, _ in cases]
    got = compiled(language, name, weighting, "expand", moments)
    # Roundings of numbers up to 3; near the axis the cosine of the cone magnifies that of the ratio threefold.
    assert np.abs(got - np.array([sh for *_, sh in cases])).max() < 5e-6


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("name", MOMENTS)
def test_harmonics_of_nothing_are_nothing(compiled, name, language):
    assert np.array_equal(compiled(language, name, "cosine", "expand", np.zeros((1, 4))), np.zeros((1, 9)))


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_harmonics_keep_what_is_stored(compiled, weighting):
    """Bands 0 and 1 are those of the estimate, whatever its horizons; band 2 vanishes as the directions cancel."""
    ao = estimate(weighting)
    moments = np.concatenate([ao.mean_direction.numpy(), ao.visibility.numpy()[..., None]], axis=-1)
    seen = np.any(ao.mean_direction.numpy(), axis=-1)
    got = compiled("c", "zh16", weighting, "expand", moments[seen])
    # Single precision of sums over slices.
    assert np.abs(got[:, :4] - ao.visibility_sh.numpy()[seen][:, :4]).max() < 5e-6
    lost = compiled("c", "zh16", "uniform", "expand", [[0, 0, 1e-3, 0.5]])
    assert np.array_equal(lost[0, 4:], np.zeros(5))


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("name", PACKINGS)
def test_comment(name, language):
    code = packing_code(name, language)
    comment = code[: code.index("\n\n")]
    assert all(line.startswith("//") for line in comment.splitlines())
    assert f"from the packing {name}:" in comment
    assert PACKINGS[name].about in comment
    assert "+z toward the camera" in comment
    assert f"Written by gtao {gtao.__version__}." in comment
    assert ("linear filtering is fine" in comment) == (name in ("rgba8", "zh16", "sh16"))
    assert code.isascii()
    whole = PACKINGS[name].needs != "bent_normal"
    assert ("cosine weighting: its length is 2/3 in the open" in comment) == whole
    assert ("its length is 1/2" in packing_code(name, language, "uniform")) == whole


def test_filtering_rgba8_is_a_mean(compiled):
    """What "linear filtering is fine" means: between two texels comes the direction between."""
    a, b = sampled(pack(bent([[1, 0, 0], [0, 1, 0]]), "rgba8"), "rgba8")
    got = compiled("hlsl", "rgba8", "cosine", "unpack", 0.5 * a + 0.5 * b)[0, :3]
    assert got == pytest.approx(np.array([1, 1, 0]) / np.sqrt(2), abs=0.01)  # 128 is not quite the middle


def test_unknown():
    for arguments, words in (
        (("bc5",), "packing must be one of rgba8"),
        (("rgba8", "metal"), "language must be one of hlsl, glsl, wgsl, c, got 'metal'"),
        (("rgba8", "c", "both"), "weighting must be 'cosine' or 'uniform', got 'both'"),
    ):
        with pytest.raises(ConfigError, match=words):
            packing_code(*arguments)
