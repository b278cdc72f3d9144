"""Numbers at the ends of what is allowed, and just beyond: an answer or an error in words, never a dead process."""

import numpy as np
import pytest

import gtao

SIZE = (8, 6)
CAMERAS = {
    "usual": lambda: gtao.PerspectiveCamera(*SIZE, 1.0),
    "almost 180 degrees": lambda: gtao.PerspectiveCamera(*SIZE, 3.1415),
    "telescope": lambda: gtao.PerspectiveCamera(*SIZE, fx=1e9),
    "principal point outside": lambda: gtao.PerspectiveCamera(*SIZE, fx=1e-5, cx=0, cy=-4),
    "microscope": lambda: gtao.OrthographicCamera(*SIZE, 1e-9),
    "satellite": lambda: gtao.OrthographicCamera(*SIZE, 1e11),
}
METHODS = {
    "unlimited": {},
    "linear": {"fetch": "linear"},
    "tiny radius": {"radius": 1e-30, "weighting": "uniform"},
    "huge radius": {"radius": 1e30},
    "published measure": {"slice_measure": "screen", "radius": 1.0},
    "falloff": {"radius": 1.0, "falloff": gtao.LinearFalloff(start=0.5, end=1.0)},
}


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("method", METHODS)
def test_every_allowed_number_gives_a_finite_visibility(camera, method):
    rng = np.random.default_rng(0)
    for low, high in ((-12, 12), (-12, -11), (11, 12)):
        z = (10.0 ** rng.uniform(low, high, SIZE[::-1])).clip(1.1e-12, 9e11).astype(np.float32)
        z[0, 0] = np.inf
        g = gtao.GBuffer(z, None, CAMERAS[camera]())
        v = gtao.ambient_occlusion(g, gtao.GTAO(**METHODS[method])).visibility.numpy()
        assert np.all(np.isfinite(v))
        # A slice of an unoccluded grazing surface holds at most π/2; rounding may leave a closed one just below 0.
        assert v.min() > -1e-3
        assert v.max() < np.pi / 2


@pytest.mark.parametrize("value", [1e-30, 1e-13, 1e13, 1e30, 3e38])
def test_depths_whose_squares_do_not_exist_are_refused(value):
    z = np.ones(SIZE[::-1], np.float32)
    z[2, 3] = value
    with pytest.raises(gtao.ShapeError, match="view_z must lie between"):
        gtao.GBuffer(z, None, CAMERAS["usual"]())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"width": "a"}, "width must be a positive integer"),
        ({"width": float("nan")}, "width must be a positive integer"),
        ({"height": 0}, "height must be a positive integer"),
        ({"fov_y": "x"}, "fov_y must be a finite number"),
        ({"fov_y": 1j}, "fov_y must be a finite number"),
        ({"cx": "q"}, "cx must be a finite number"),
        ({"cx": 1e25}, "check fx and cx"),
        ({"fov_y": None, "fx": 1e-30}, "check fx and cx"),
        ({"fov_y": None, "fx": 1e39}, "check fx and cx"),
    ],
)
def test_impossible_cameras(arguments, message):
    with pytest.raises(gtao.ConfigError, match=message):
        gtao.PerspectiveCamera(**({"width": 8, "height": 6, "fov_y": 1.0} | arguments))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: gtao.GTAO(radius="1"), "radius must be a number"),
        (lambda: gtao.LinearFalloff(start="a", end=2.0), "falloff start must be a number"),
        (lambda: gtao.method_from_dict(None), "described by an object"),
        (lambda: gtao.method_from_dict({"falloff": {"x": 1}}), "bad LinearFalloff options"),
        (lambda: gtao.camera_from_dict(None), "described by an object"),
    ],
)
def test_wrong_types_are_errors_in_words(make, message):
    with pytest.raises(gtao.ConfigError, match=message):
        make()


def test_no_array_is_an_error_in_words():
    with pytest.raises(gtao.ShapeError, match="view_z must be an array"):
        gtao.GBuffer(None, None, CAMERAS["usual"]())


def test_a_radius_that_holds_the_eye_reaches_across_a_wide_frame():
    """Eye rays more than 90° apart: a sphere about everything is no limit."""
    camera = gtao.PerspectiveCamera(96, 32, 2 * np.arctan(np.tan(np.radians(70)) / 3), cx=48.0, cy=16.0)
    x = np.abs(np.arange(96) + 0.5 - 48) / camera.fx
    # Walls at x = ±2 that end in a far one: each sees the other across the frame.
    z = np.broadcast_to(np.where(x > 0.25, 2 / x, 8.0), (32, 96)).astype(np.float32)
    g = gtao.GBuffer(z, None, camera)
    options = {"n_slices": 8, "n_steps": 32, "noise": "none", "step_exponent": 1.0}
    unlimited, huge = (
        gtao.ambient_occlusion(g, gtao.GTAO(radius=radius, **options)).visibility.numpy() for radius in (np.inf, 1e4)
    )
    # The cut's lower end, at the far side of a sphere of 1e4, is left out of an unlimited search.
    assert np.abs(huge - unlimited).max() < 1e-3
