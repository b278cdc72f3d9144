"""Frames at the ends of what is allowed: every gradient is a number, and zero where there is no surface."""

import numpy as np
import pytest
from gradients._attached import CAMERAS, along, image, oracle, pullback, pushforward
from gradients._methods import ao, hbao, toward

import gtao

METHODS = {
    "unlimited": ao(),
    "sphere": ao(radius=0.9, power=0.7),
    "sphere uniform": ao(radius=0.9, weighting="uniform"),
    "linear falloff": ao(
        radius=1.2,
        falloff=gtao.LinearFalloff(start=0.0, end=1.0),
        thin_occluder_compensation=0.5,
        length_blend=0.5,
        small_radius_fade=True,
    ),
    "linear fetch": ao(radius=0.9, fetch="linear", step_exponent=1.7),
    "bilinear": ao(falloff=gtao.QuadraticFalloff(end=0.8), radius=0.9, fetch="bilinear"),
    "two-term": ao(radius=0.9, falloff=gtao.NoCut(), arccosine="two_term", zenith="optical_axis"),
    "bit trick": ao(radius=0.9, falloff=gtao.NoCut(), arccosine="bit_trick"),
    "running": toward("horizon", thickness=gtao.RunningThickness(blend=0.3)),
    "hbao by sample": hbao(attenuation="sample"),
    "hbao by horizon": hbao(attenuation="horizon", min_step_px=0.6),
    "floor": ao(radius=0.9, fetch="floor", noise="none"),
    "pyramid": ao(radius=0.9, pyramid=gtao.DepthPyramid(n_levels=3, level_offset=-1.0)),
}
RNG = np.random.default_rng(8)
SHAPE = (9, 11)


def silhouette():
    z = 3 + 0.3 * RNG.random(SHAPE)
    z[:, 5:7], z[2] = np.inf, np.inf
    z[4, 4] = 1.0
    return z


def single_pixel():
    z = np.full(SHAPE, np.inf)
    z[3, 4] = 2.0
    return z


# The size of a frame is part of the kernel: most are of one size.
FRAMES = {
    "all background": np.full(SHAPE, np.inf),
    "one surface pixel": single_pixel(),
    "silhouettes": silhouette(),
    "a wall that faces the camera": np.full(SHAPE, 3.0),
    "far and near": 10.0 ** RNG.uniform(-3, 3, SHAPE),
}
TINY = {
    "one row": 3 + 0.3 * RNG.random((1, 9)),
    "one column": 3 + 0.3 * RNG.random((7, 1)),
    "one pixel": np.full((1, 1), 2.0),
    "two by two": 3 + 0.3 * RNG.random((2, 2)),
}
NORMALS = {
    "frontal": lambda shape: np.broadcast_to([0.0, 0.0, 1.0], (*shape, 3)).copy(),
    "away": lambda shape: np.broadcast_to([0.0, 0.0, -1.0], (*shape, 3)).copy(),
    "derived": lambda shape: None,
}


def problem(z, method, kind):
    height, width = z.shape
    numbers = CAMERAS[kind] | {"cx": width / 2, "cy": height / 2}
    make = gtao.PerspectiveCamera if kind == "perspective" else gtao.OrthographicCamera

    def build(values):
        camera = make(width, height, **(numbers | {n: values[n] for n in numbers if n in values}))
        return gtao.GBuffer(values["view_z"], values.get("normal_v"), camera), method

    return build, numbers


def check(z, method, kind, facing, single, where):
    build, numbers = problem(z, method, kind)
    n = NORMALS[facing](z.shape)
    values = {"view_z": z} | ({} if n is None else {"normal_v": n}) | numbers
    gradient = pullback(build, values, np.ones(z.shape), single)
    for number, g in gradient.items():
        assert np.isfinite(g).all(), f"{number}: {where}"
    assert (gradient["view_z"][np.isinf(z)] == 0).all(), where
    tangent = pushforward(build, values, {k: np.ones(np.shape(v)) for k, v in values.items()}, single)
    assert np.isfinite(tangent).all(), where
    assert (tangent[np.isinf(z)] == 0).all(), where


KINDS = [(name, "perspective") for name in METHODS] + [
    (name, "orthographic") for name in ("sphere", "linear falloff", "linear fetch")
]


@pytest.mark.parametrize(("name", "kind"), KINDS)
def test_every_gradient_is_a_number(name, kind):
    for title, z in FRAMES.items():
        for facing in NORMALS:
            check(z, METHODS[name], kind, facing, True, f"{title}, {facing}")


@pytest.mark.parametrize("name", ["linear falloff"])
def test_every_gradient_is_a_number_in_double_precision(name):
    for title, z in FRAMES.items():
        check(z, METHODS[name], "perspective", "frontal", False, title)


@pytest.mark.parametrize("frame", TINY)
@pytest.mark.parametrize("name", ["sphere", "bilinear", "hbao by sample"])
def test_tiny_frames(name, frame):
    for facing in ("frontal", "derived"):
        check(TINY[frame], METHODS[name], "perspective", facing, True, facing)


def test_a_tie_takes_one_of_its_sides():
    """On a wall that faces the camera every sample is level with the tangent plane, up to rounding."""
    # One slice, and no pixel's own depth: what moves is one side of a slice.
    build, _ = problem(np.full((12, 13), 3.0), ao(n_slices=1, n_steps=3, weighting="uniform"), "orthographic")
    values = {"view_z": np.full((12, 13), 3.0), "normal_v": NORMALS["frontal"]((12, 13))}
    ties = 0
    for pixel in ((5, 6), (2, 3), (8, 9), (4, 10)):
        direction = np.zeros((12, 13))
        direction[pixel] = 1.0
        found = along(build, values, "view_z", direction)
        forward = pushforward(build, {"view_z": values["view_z"]}, {"view_z": direction})
        others = direction == 0
        low, high = np.minimum(found.left, found.right), np.maximum(found.left, found.right)
        slack = oracle.TOLERANCE * np.maximum(np.abs(low), np.abs(high)) + found.noise
        assert ((forward >= low - slack) & (forward <= high + slack))[others].all()
        ties += np.sum((high > low + slack)[others])
    assert ties > 10


OWN = {
    "nearest": ao(min_step_px=0.6),
    "sphere": ao(radius=0.9, min_step_px=0.6),
    "floor": ao(radius=0.9, fetch="floor"),
    "beyond, clamped": ao(radius=0.9, step_law="beyond", border="clamp"),
    # Beside a depth edge the linear fetch reads a texel, whatever else snaps.
    "linear": ao(min_step_px=0.6, fetch="linear"),
    "linear, not snapped": ao(min_step_px=0.6, fetch="linear", snap_to_texel=False),
    "bilinear, offset law": ao(min_step_px=0.0, step_law="offset", step_jitter="none", fetch="bilinear", radius=0.9),
    "not snapped, offset law": ao(
        min_step_px=0.0, step_law="offset", step_jitter="none", snap_to_texel=False, radius=1.0
    ),
    "running": ao(min_step_px=0.6, falloff=gtao.NoCut(), thickness=gtao.RunningThickness(blend=0.3)),
    "hbao": hbao(min_step_px=0.6, fetch="linear"),
}


@pytest.mark.parametrize("name", OWN)
def test_a_sample_on_the_pixel_itself_says_nothing(name):
    """It has no direction; what rounding leaves of one must not reach the image or a gradient."""
    z = 3 + 0.3 * np.random.default_rng(2).random(SHAPE)
    z[:, 4:] += 1.0
    z[5:] += 0.7
    build, _ = problem(z, OWN[name], "perspective")
    values = {"view_z": z, "normal_v": NORMALS["frontal"](SHAPE)}
    single = image(build, {k: v.astype(np.float32) for k, v in values.items()})
    # A direction made of rounding errors is another one in another precision.
    assert np.abs(single - image(build, values)).max() < 1e-4
    single, double = (pullback(build, values, np.ones(SHAPE), s)["view_z"] for s in (True, False))
    # Adjoint terms along a direction of rounding errors are as large as their reciprocals.
    assert np.abs(double).max() < 100
    assert np.abs(single - double).max() < 1e-3
