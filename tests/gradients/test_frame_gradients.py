"""What an estimate is made from, depth, normals and camera, against differences: every path through the estimator."""

import numpy as np
import pytest
from gradients._attached import (
    CAMERAS,
    DEPTH,
    HEIGHT,
    NORMALS,
    SURFACE,
    WEIGHTS,
    WIDTH,
    along,
    check_numbers,
    check_pixels,
    directions,
    problem,
    pullback,
    pushforward,
    tensor,
)
from gradients._methods import CASES, IDS, METHODS, ao
from oracles import gradients as oracle

import gtao


def inputs(kind):
    return {"view_z": DEPTH, "normal_v": NORMALS} | CAMERAS[kind]


def shows(found):
    """Whether rounding leaves enough of derivatives for a comparison to say something."""
    return np.abs(found.value) > 1e4 * found.noise


@pytest.mark.parametrize(("name", "kind"), CASES, ids=IDS)
def test_every_input(name, kind):
    build, values = problem(METHODS[name], kind), inputs(kind)
    gradient = pullback(build, values)
    assert all(np.isfinite(g).all() for g in gradient.values())
    assert (gradient["view_z"][~SURFACE] == 0).all()
    assert (gradient["normal_v"][~SURFACE] == 0).all()
    found = check_pixels(build, values, "view_z", gradient["view_z"], 24)
    found += check_pixels(build, values, "normal_v", gradient["normal_v"], 16)
    assert np.mean([shows(d) for d in found]) > 0.6
    numbers = check_numbers(build, values, CAMERAS[kind])
    for number, derivative in numbers.items():
        # A parallel view does not change where its axis lies.
        assert shows(derivative).any() or (kind == "orthographic" and number in ("cx", "cy"))
    _check_transposes(build, values)


def _check_transposes(build, values, single=False, tolerance=1e-11):
    """⟨Jv, w⟩ = ⟨v, Jᵀw⟩ for a random v of all inputs and w = Jv: no cancellation in either of them."""
    rng = np.random.default_rng(5)
    v = {name: rng.normal(size=np.shape(value)) * 0.1 for name, value in values.items()}
    v["view_z"] = np.where(SURFACE, v["view_z"], 0)
    forward = pushforward(build, values, v, single).astype(float)
    reverse = pullback(build, values, forward, single)
    left, right = np.sum(forward**2), sum(np.sum(v[name] * reverse[name]) for name in values)
    assert left > 0
    assert right == pytest.approx(left, rel=tolerance)


@pytest.mark.parametrize("name", ["sphere", "linear falloff", "linear fetch", "running thickness"])
def test_the_modes_are_transposes_in_single_precision(name):
    _check_transposes(problem(METHODS[name]), inputs("perspective"), single=True, tolerance=1e-5)


@pytest.mark.parametrize("name", ["sphere", "linear falloff"])
def test_what_is_left_are_kinks(name):
    """What differences do not resolve is rare, and does not become any smoother the closer one looks."""
    build, values = problem(METHODS[name]), {"view_z": DEPTH}
    gradient = pullback(build, values)["view_z"]
    kinks = 0
    for _, direction in directions("view_z", values, 200, seed=9):
        image = along(build, values, "view_z", direction, scale=3.0)
        found = image.weighted(WEIGHTS)
        assert not oracle.disagreements(np.sum(gradient * direction), found)
        if not found.resolved:
            kinks += 1
            apart = np.abs(image.right - image.left)[~image.resolved]
            assert (apart > 10 * oracle.AGREEMENT * np.abs(image.value)[~image.resolved]).all()
    assert kinks <= 2


@pytest.mark.parametrize("name", ["sphere", "linear falloff", "linear fetch", "hbao"])
def test_forward_mode_pixel_by_pixel(name):
    build, values = problem(METHODS[name]), {"view_z": DEPTH, "normal_v": NORMALS}
    zeros = {number: np.zeros_like(value) for number, value in values.items()}
    for number in values:
        for pixel, direction in directions(number, values, 6, seed=7):
            found = along(build, values, number, direction, scale=3.0)
            forward = pushforward(build, values, zeros | {number: direction})
            assert not oracle.disagreements(forward, found), pixel
            assert found.resolved.all()


@pytest.mark.parametrize("n_steps", [3, 15, 16, 255, 256])
def test_the_number_of_a_winner_fits(n_steps):
    """Numbers of winners share bytes up to 15 steps, have one each up to 255, and words of 32 bits beyond."""
    build, values = problem(ao(radius=0.9, n_slices=1, n_steps=n_steps)), {"view_z": DEPTH}
    check_pixels(build, values, "view_z", pullback(build, values)["view_z"], 12)


@pytest.mark.parametrize("kind", CAMERAS)
def test_normals_that_are_derived_from_depth(kind):
    """They move with the depth and with the camera."""
    build, values = problem(ao(radius=0.9), kind, normal_v=None), {"view_z": DEPTH} | CAMERAS[kind]
    gradient = pullback(build, values)
    check_pixels(build, values, "view_z", gradient["view_z"], 40)
    check_numbers(build, values, CAMERAS[kind])


def test_the_field_of_view():
    def build(values):
        camera = gtao.PerspectiveCamera(WIDTH, HEIGHT, values["fov_y"])
        return gtao.GBuffer(tensor(DEPTH), tensor(NORMALS), camera), METHODS["linear fetch"]

    found = check_numbers(build, {"fov_y": 1.0})["fov_y"]
    assert shows(found).any()


def test_a_normal_does_not_move_along_itself():
    """The frame normalises, so that the length of a normal is no input; also of one that faces away."""
    for name in ("sphere", "linear falloff"):
        gradient = pullback(problem(METHODS[name]), {"normal_v": NORMALS})["normal_v"]
        assert np.abs(np.sum(gradient * NORMALS, axis=-1)).max() < 1e-12 * np.abs(gradient).max()
