"""Cameras: round trips, conventions, ray distances, crops, bad arguments."""

import math

import numpy as np
import pytest

import gtao
from gtao import backend

import drjit as dr  # isort: skip

CAMERAS = [
    gtao.PerspectiveCamera(640, 360, 0.8),
    gtao.PerspectiveCamera(320, 200, fx=180.0, fy=260.0, cx=-40.0, cy=310.5),
    gtao.PerspectiveCamera(64, 64, 2.6),
    gtao.OrthographicCamera(300, 200, 4.0),
    gtao.OrthographicCamera(300, 200, 4.0, view_width=9.0, cx=10.0, cy=-20.0),
]
IDS = ["fov", "principal point", "wide", "orthographic", "stretched"]


def float_type(name):
    Float = backend.default_float()
    return dr.float64_array_t(Float) if name == "float64" else Float


@pytest.mark.parametrize("name", ["float64", "float32"])
@pytest.mark.parametrize("camera", CAMERAS, ids=IDS)
def test_project_inverts_unproject(camera, name):
    Float = float_type(name)
    rng = np.random.default_rng(0)
    x, y = rng.uniform(0, camera.width, 500), rng.uniform(0, camera.height, 500)
    z = 10 ** rng.uniform(-2, 4, 500)
    arrays = [Float(v.astype(name)) for v in (x, y, z)]
    back = camera.project(camera.unproject(*arrays))
    # Rounding of pixel coordinates up to the largest offset from the principal point, five operations deep.
    reach = max(camera.width, camera.height) + abs(camera.cx) + abs(camera.cy)
    limit = 5 * float(np.finfo(name).eps)
    assert np.array(back[0]) == pytest.approx(x.astype(name), abs=limit * reach)
    assert np.array(back[1]) == pytest.approx(y.astype(name), abs=limit * reach)
    assert np.array_equal(np.array(back[2]), z.astype(name))


@pytest.mark.parametrize("camera", CAMERAS, ids=IDS)
def test_unproject_is_the_pinhole_formula(camera):
    """Right-handed, +y up while y_px grows downwards, looking along -z."""
    Float = float_type("float64")
    x, y, z = 12.5, 7.25, 3.0
    point = np.array(camera.unproject(Float(x), Float(y), Float(z))).ravel()
    w = 1.0 if camera.is_orthographic else z
    want = [(x - camera.cx) / camera.fx * w, -(y - camera.cy) / camera.fy * w, -z]
    assert point == pytest.approx(want, rel=1e-14)


def test_corners_of_the_field_of_view():
    camera, Float = CAMERAS[0], float_type("float64")
    top = np.array(camera.unproject(Float(320.0), Float(0.0), Float(1.0))).ravel()
    assert top == pytest.approx([0.0, math.tan(0.4), -1.0], abs=1e-14)
    right = np.array(camera.unproject(Float(640.0), Float(180.0), Float(1.0))).ravel()
    assert right == pytest.approx([math.tan(0.4) * 640 / 360, 0.0, -1.0], abs=1e-14)
    assert camera.fov_y == pytest.approx(0.8)
    corner = np.array(CAMERAS[3].unproject(Float(0.0), Float(0.0), Float(2.0))).ravel()
    assert corner == pytest.approx([-3.0, 2.0, -2.0])


@pytest.mark.parametrize("camera", CAMERAS, ids=IDS)
def test_crop_sees_the_same_points(camera):
    Float = float_type("float64")
    window = camera.crop(30, 20, 50, 40)
    assert window.shape == (40, 50)
    full = camera.unproject(Float(37.5), Float(41.5), Float(2.0))
    part = window.unproject(Float(7.5), Float(21.5), Float(2.0))
    assert np.array(part).ravel() == pytest.approx(np.array(full).ravel(), rel=1e-14)


@pytest.mark.parametrize("camera", CAMERAS, ids=IDS)
def test_a_guard_band_leaves_everything_in_place(camera):
    Float = float_type("float64")
    wide = camera.padded(48)
    assert wide.shape == (camera.height + 96, camera.width + 96)
    here = camera.unproject(Float(37.5), Float(41.5), Float(2.0))
    there = wide.unproject(Float(37.5 + 48), Float(41.5 + 48), Float(2.0))
    assert np.array(there).ravel() == pytest.approx(np.array(here).ravel(), rel=1e-14)
    back = wide.crop(48, 48, camera.width, camera.height)
    # The orthographic camera keeps its extent, not its pixel size: a division and a product more.
    assert list(back.to_dict().values())[1:] == pytest.approx(list(camera.to_dict().values())[1:], rel=1e-15)
    assert camera.padded(0) == camera


def test_a_guard_band_that_makes_no_sense_is_refused():
    camera = gtao.PerspectiveCamera(64, 64, math.radians(170))
    assert camera.padded(60).fov_y > math.radians(176)
    with pytest.raises(
        gtao.ConfigError, match=r"band of 300 pixels widens the view to 89\.52 degrees from the optical"
    ):
        camera.padded(300)
    for pixels in (-1, 1.5, True, "8"):
        with pytest.raises(gtao.ConfigError, match="a guard band is a whole number of pixels from 0 on, got"):
            camera.padded(pixels)
    # Parallel rays have no widest angle, and a camera that is already wider stays as it is.
    gtao.OrthographicCamera(4, 4, 1.0).padded(10_000)
    almost = gtao.PerspectiveCamera(64, 64, math.radians(179.5))
    assert almost.padded(0) == almost


@pytest.mark.parametrize("camera", CAMERAS, ids=IDS)
def test_dictionary_round_trip(camera):
    assert gtao.camera_from_dict(camera.to_dict()) == camera


def test_view_z_from_ray_distance():
    """A point's distance from the eye, or from where its ray leaves the near plane."""
    Float = float_type("float64")
    camera = gtao.PerspectiveCamera(100, 80, 1.2, cx=30.0, near=0.25)
    x, y, z = 90.5, 3.5, 4.0
    P = np.array(camera.unproject(Float(x), Float(y), Float(z))).ravel()
    distance = np.linalg.norm(P)
    assert camera.view_z_from_ray_t(Float(x), Float(y), Float(distance))[0] == pytest.approx(z)
    beyond_near = distance * (1 - camera.near / z)
    assert camera.view_z_from_ray_t(Float(x), Float(y), Float(beyond_near), from_near=True)[0] == pytest.approx(z)
    flat = gtao.OrthographicCamera(10, 10, 1.0, near=0.25)
    assert flat.view_z_from_ray_t(Float(1.0), Float(1.0), Float(2.0))[0] == pytest.approx(2.0)
    assert flat.view_z_from_ray_t(Float(1.0), Float(1.0), Float(2.0), from_near=True)[0] == pytest.approx(2.25)


@pytest.mark.parametrize(
    "make",
    [
        lambda: gtao.PerspectiveCamera(0, 10, 1.0),
        lambda: gtao.PerspectiveCamera(10, 2.5, 1.0),
        lambda: gtao.PerspectiveCamera(10, 10),
        lambda: gtao.PerspectiveCamera(10, 10, 1.0, fx=3.0),
        lambda: gtao.PerspectiveCamera(10, 10, 0.0),
        lambda: gtao.PerspectiveCamera(10, 10, math.pi),
        lambda: gtao.PerspectiveCamera(10, 10, math.nan),
        lambda: gtao.PerspectiveCamera(10, 10, fx=-1.0),
        lambda: gtao.PerspectiveCamera(10, 10, fx=math.inf),
        lambda: gtao.PerspectiveCamera(10, 10, 1.0, cx=math.nan),
        lambda: gtao.PerspectiveCamera(10, 10, 1.0, near=-0.1),
        lambda: gtao.OrthographicCamera(10, 10, 0.0),
        lambda: gtao.OrthographicCamera(10, 10, 1.0, view_width=-1.0),
        lambda: gtao.camera_from_dict({"type": "fisheye"}),
        lambda: gtao.camera_from_dict({"type": "perspective", "width": 3}),
        lambda: gtao.camera_from_dict({"type": "orthographic", "width": 3, "height": 3, "view_height": 1.0, "fov": 1}),
    ],
)
def test_bad_arguments_are_named(make):
    with pytest.raises(gtao.ConfigError):
        make()
