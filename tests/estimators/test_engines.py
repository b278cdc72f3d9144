"""Presets of engines against their formulas, pixel by pixel; deviations switched on one by one."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from drjit.llvm.ad import TensorXf64
from oracles import engines as oracle

import gtao
from gtao.config import deviations, engines, faithful

HEIGHT, WIDTH = 96, 128
CAMERA = gtao.PerspectiveCamera(WIDTH, HEIGHT, 1.1)
# At the small one searches are a few pixels long and lengths in its ratio are those of the scene's steps; at the large
# one the longest searches read the fourth level of a pyramid and leave the frame.
RADII = (0.25, 2.0)


def scene():
    """A wavy, tilted surface with steps, posts in front of it and background behind, and normals of its own."""
    rng = np.random.default_rng(11)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(float)
    z = 4 + 0.01 * x - 0.02 * y + 0.15 * np.sin(0.2 * x) * np.cos(0.12 * y) + 0.002 * rng.random((HEIGHT, WIDTH))
    z[24:52, 40:68] -= 0.5
    z[:, 90:94] -= 1.1
    z[72:80, 10:60] -= 0.25
    z[4:18, 100:120] = np.inf
    normal = rng.normal(size=(HEIGHT, WIDTH, 3)) * 0.35 + [0, 0, 1]
    return z, normal / np.linalg.norm(normal, axis=-1, keepdims=True)


DEPTH, NORMAL = scene()
# Corners and edges, silhouettes, the border of the background, and some of everything.
PIXELS = [(0, 0), (127, 95), (0, 95), (1, 30), (67, 23), (68, 40), (89, 50), (91, 3), (94, 80), (99, 9), (105, 18)]
PIXELS += [(int(i), int(j)) for i, j in np.random.default_rng(5).integers(0, (WIDTH, HEIGHT), (40, 2))]
PIXELS = [(i, j) for i, j in PIXELS if np.isfinite(DEPTH[j, i])]

# Where the slides' frames rotate nothing: engines that have their pattern in space do not have it over time.
STILL = 5


def estimate(method, frame_index=STILL):
    g = gtao.GBuffer(TensorXf64(DEPTH), TensorXf64(NORMAL), CAMERA)
    return gtao.ambient_occlusion(g, method, frame_index=frame_index).visibility.numpy()


def compare(pipeline, formula, noise, tolerance, levels=(), frame_index=STILL):
    frame = oracle.Frame(DEPTH, NORMAL, CAMERA.fx, CAMERA.cx, CAMERA.cy, list(levels))
    mine = estimate(pipeline.occlusion, frame_index)
    theirs = [formula(frame, i, j, noise(i, j)) for i, j in PIXELS]
    assert [mine[j, i] for i, j in PIXELS] == pytest.approx(theirs, abs=tolerance)
    # A frame that says nothing would make anything equal.
    assert np.std(theirs) > 0.02


# The noise of a low-discrepancy sequence has 24 bits, the oracle's 53: 6e-8 of a step of a few pixels, and where a
# sample is moved to its texel nothing. The square root from float32 bits decides between neighbours 1e-7 apart, and
# the power that XeGTAO applies multiplies it by up to 10 where visibility is above 1.
EXACT, BITS = 1e-9, 3e-6


@pytest.mark.parametrize("radius", RADII)
@pytest.mark.parametrize("level", engines.LEVELS)
def test_xegtao(level, radius):
    levels = oracle.pyramid(DEPTH, lambda z: oracle.xegtao_level(z, radius), 5)
    compare(
        engines.xegtao(level, radius),
        lambda *at: oracle.xegtao(*at, quality=level, radius=radius),
        lambda i, j: oracle.hilbert_noise(i, j, STILL),
        BITS,
        levels,
    )


@pytest.mark.parametrize("radius", RADII)
def test_hdrp(radius):
    levels = oracle.pyramid(DEPTH, oracle.nearest_level, 2)
    compare(engines.hdrp(radius), lambda *at: oracle.hdrp(*at, radius=radius), oracle.gradient_noise, EXACT, levels, 0)


@pytest.mark.parametrize("radius", RADII)
def test_hdrp_accumulating(radius):
    """One direction per frame, rotated and offset over 24 frames."""
    levels = oracle.pyramid(DEPTH, oracle.nearest_level, 2)
    rotations, offsets = (60, 300, 180, 240, 120, 0), (0, 0.5, 0.25, 0.75)
    for frame_index in (0, 7, 22):
        angle, offset = rotations[frame_index % 6] / 360, offsets[frame_index // 6 % 4]

        def noise(i, j, offset=offset):
            direction, step = oracle.gradient_noise(i, j)
            return direction, (step + offset) % 1

        compare(
            engines.hdrp(radius, temporal=True),
            lambda *at, angle=angle: oracle.hdrp(*at, radius=radius, angles=(angle,)),
            noise,
            EXACT,
            levels,
            frame_index,
        )


@pytest.mark.parametrize("radius", RADII)
def test_filament(radius):
    levels = oracle.pyramid(DEPTH, oracle.rotated_grid_level, 5)
    # The angle of the normal is off by up to 0.009, its cosine by as much, and the arcs hold half of that.
    for exact_cosine, tolerance in ((True, EXACT), (False, 0.0045)):
        compare(
            engines.filament(radius),
            lambda *at, exact=exact_cosine: oracle.filament(*at, radius=radius, exact_cosine=exact),
            oracle.papers_noise,
            tolerance,
            levels,
        )


@pytest.mark.parametrize("radius", RADII)
def test_filament_bitmask(radius):
    levels = oracle.pyramid(DEPTH, oracle.rotated_grid_level, 5)
    compare(
        engines.filament_bitmask(radius),
        lambda *at: oracle.filament_bitmask(*at, radius=radius, thickness=radius / 0.6),
        oracle.papers_noise,
        EXACT,
        levels,
    )


@pytest.mark.parametrize("radius", RADII)
@pytest.mark.parametrize("level", engines.LEVELS)
def test_bevy(level, radius):
    levels = oracle.pyramid(DEPTH, oracle.harmonic_level, 5)
    compare(
        engines.bevy(level, radius),
        lambda *at: oracle.bevy(*at, quality=level, radius=radius, thickness=radius * 0.25 / 0.7285, bias=1e-4),
        lambda i, j: oracle.hilbert_noise(i, j, STILL),
        EXACT,
        levels,
    )


@pytest.mark.parametrize("radius", RADII)
def test_threejs_node(radius):
    compare(
        engines.threejs("node", radius),
        lambda *at: oracle.threejs_node(*at, radius=radius, thickness=4 * radius),
        lambda i, j: oracle.hilbert_noise(i, j, STILL),
        1e-6,
    )


@pytest.mark.parametrize("radius", RADII)
def test_threejs_webgl(radius):
    compare(
        engines.threejs("webgl", radius),
        lambda *at: oracle.threejs_webgl(*at, radius=radius, thickness=4 * radius),
        oracle.papers_noise,
        EXACT,
    )


PRESETS = {
    "xegtao": engines.xegtao,
    "hdrp": engines.hdrp,
    "filament": engines.filament,
    "filament_bitmask": engines.filament_bitmask,
    "bevy": engines.bevy,
    "threejs-node": engines.threejs,
    "threejs-webgl": lambda: engines.threejs("webgl"),
}


@pytest.mark.parametrize("name", PRESETS)
def test_deviations_lead_from_the_faithful_method_to_the_preset(name):
    method = PRESETS[name]().occlusion
    path, plain = deviations(method), faithful(method)
    assert deviations(plain) == ()
    assert (plain.radius, plain.n_slices, plain.n_steps) == (method.radius, method.n_slices, method.n_steps)
    for deviation in path:
        plain = replace(plain, **{deviation.option: deviation.value})
        before = estimate(plain)
        assert np.all(np.isfinite(before)), deviation.label
    assert plain == method


@pytest.mark.parametrize("name", PRESETS)
def test_records_of_presets_make_them_again(name):
    pipeline = PRESETS[name]()
    assert gtao.method_from_dict(pipeline.to_dict()) == pipeline


def test_preset_of_gtao_is_the_pipelines():
    assert gtao.GTAO.xegtao("low", radius=2.0) == engines.xegtao("low", 2.0).occlusion


@pytest.mark.parametrize("name", PRESETS)
def test_departures_list_every_deviation(name):
    """The tables of the page and the presets name the same options."""
    text = (Path(__file__).parents[2] / "docs" / "departures.md").read_text(encoding="utf-8")
    table = text.split(f"<!-- deviations: {name} -->")[1].split("\n\n")[0]
    listed = re.findall(r"^\| `(\w+)", table, re.MULTILINE)
    assert listed == [deviation.option for deviation in deviations(PRESETS[name]().occlusion)]


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: engines.xegtao("extreme"), "level must be one of 'low', 'medium', 'high', 'ultra', got 'extreme'"),
        (lambda: engines.bevy("none"), "level must be one of"),
        (lambda: engines.threejs("webgpu"), "variant must be 'node' or 'webgl', got 'webgpu'"),
        (lambda: engines.hdrp(-1.0), "radius must be positive"),
        (lambda: gtao.GTAO(border="replicate"), "needs a finite radius"),
        (lambda: gtao.GTAO(slice_angles=(0.1, 0.2)), "n_slices = 4"),
        (lambda: gtao.GTAO(slice_angles=0.1), "a tuple of numbers"),
        (lambda: gtao.GTAO(weighting="uniform", arccosine="two_term"), "needs no arc cosine"),
        (lambda: gtao.VisibilityBitmask(arccosine="two_term"), "needs weighting 'angle'"),
        (lambda: gtao.GTAO(ceiling=0.5), "ceiling must be at least 1"),
        (lambda: gtao.GTAO(min_step_px=0.0), r"min_step_px must lie in \[0.5, 64\]"),
    ],
)
def test_what_cannot_be_is_refused(make, words):
    with pytest.raises(gtao.ConfigError, match=words):
        make()
