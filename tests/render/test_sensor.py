"""The camera of a sensor against the rays that the sensor itself shoots."""

import numpy as np
import pytest

from gtao import SceneError
from gtao.render import camera_from_sensor

import drjit as dr  # isort: skip
import mitsuba as mi  # isort: skip

import _scenes as S

CROP = {"crop_offset_x": 10, "crop_offset_y": 5, "crop_width": 30, "crop_height": 21}


def _perspective(**extra):
    size = extra.pop("size", (60, 40))
    sensor = S.perspective((1, -7, 3), (0.2, 0.1, 0.4), fov=55.0, size=size)
    sensor["film"].update(extra.pop("film", {}))
    return {**sensor, **extra}


def _orthographic(scale=(1, 1, 1), film=None, near=0.5):
    to_world = S.look_at((1, -7, 3), (0.2, 0.1, 0.4)) @ S.transform().scale(list(scale))
    return {
        "type": "orthographic",
        "near_clip": near,
        "to_world": to_world,
        "film": {**S.film(60, 40), **(film or {})},
    }


SENSORS = {
    "perspective": lambda: _perspective(),
    "portrait": lambda: _perspective(size=(40, 60)),
    "fov over y": lambda: _perspective(fov_axis="y"),
    "near plane": lambda: _perspective(near_clip=2.5),
    "principal point": lambda: _perspective(principal_point_offset_x=0.13, principal_point_offset_y=-0.07),
    "crop": lambda: _perspective(film=CROP),
    "crop and principal point": lambda: _perspective(
        film=CROP, principal_point_offset_x=-0.2, principal_point_offset_y=0.11, near_clip=0.3
    ),
    "orthographic": lambda: _orthographic(),
    "orthographic, scaled": lambda: _orthographic(scale=(2.5, 2.5, 1)),
    "orthographic, uneven scale": lambda: _orthographic(scale=(2, 3, 1.5)),
    "orthographic, crop": lambda: _orthographic(scale=(2, 2, 1), film=CROP),
}

# Pixel coordinates up to 60 in float32, through a ray direction and a division: a few units in the last place.
PIXEL_TOLERANCE = 2e-4
# Points some 10 units away, after a rotation in float32.
RELATIVE_DISTANCE = 2e-6


@pytest.mark.parametrize("make", SENSORS.values(), ids=SENSORS.keys())
def test_points_on_the_sensors_rays_project_back_to_their_pixels(make):
    sensor = mi.load_dict(make())
    camera, view_to_world = camera_from_sensor(sensor)
    width, height = (int(v) for v in sensor.film().crop_size())
    assert camera.shape == (height, width)

    rng = np.random.default_rng(1)
    x, y = rng.uniform(0, width, 500), rng.uniform(0, height, 500)
    t = rng.uniform(1.0, 20.0, 500)
    film = mi.Point2f(x / width, y / height)
    ray, _ = sensor.sample_ray(0.0, 0.5, film, mi.Point2f(0.5))
    world = ray(mi.Float(t)).numpy().astype(np.float64)
    view = np.linalg.inv(view_to_world)[:3] @ np.vstack([world, np.ones(500)])
    x_px, y_px, view_z = camera.project(mi.Point3f(view.astype(np.float32)))
    assert np.abs(x_px.numpy() - x).max() < PIXEL_TOLERANCE
    assert np.abs(y_px.numpy() - y).max() < PIXEL_TOLERANCE
    assert np.all(view_z.numpy() >= camera.near * (1 - 1e-5))

    back = camera.unproject(x_px, y_px, view_z).numpy()
    assert np.abs(back - view).max() < RELATIVE_DISTANCE * np.abs(view).max() * 5

    # Ray lengths count from the near plane; the camera knows.
    z = camera.view_z_from_ray_t(x_px, y_px, mi.Float(t * _unit_t(sensor)), from_near=True)
    assert np.abs(z.numpy() - view_z.numpy()).max() < 1e-5 * 20


def _unit_t(sensor):
    """World length of a ray's direction: one, however the sensor is scaled."""
    ray, _ = sensor.sample_ray(0.0, 0.5, mi.Point2f(0.5), mi.Point2f(0.5))
    return float(dr.norm(ray.d)[0])


@pytest.mark.parametrize("make", SENSORS.values(), ids=SENSORS.keys())
def test_view_frame_is_right_handed_and_orthonormal(make):
    _, matrix = camera_from_sensor(mi.load_dict(make()))
    assert matrix.dtype == np.float64
    np.testing.assert_allclose(matrix[:3, :3].T @ matrix[:3, :3], np.eye(3), atol=1e-6)
    assert np.linalg.det(matrix) == pytest.approx(1, abs=1e-6)
    np.testing.assert_array_equal(matrix[3], [0, 0, 0, 1])
    np.testing.assert_allclose(matrix[:3, 3], [1, -7, 3], atol=1e-6)


def test_other_sensors_are_refused_by_name():
    lens = mi.load_dict({"type": "thinlens", "aperture_radius": 0.1})
    with pytest.raises(SceneError, match=r"ThinLensCamera.*supported are perspective and orthographic"):
        camera_from_sensor(lens)
    with pytest.raises(SceneError, match=r"expected a mitsuba.Sensor, got int"):
        camera_from_sensor(3)


def test_a_mirrored_image_is_refused():
    mirrored = S.perspective((0, 0, 5), (0, 0, 0), up=(0, 1, 0))
    mirrored["to_world"] = mirrored["to_world"] @ S.transform().scale([-1, 1, 1])
    with pytest.raises(SceneError, match="mirrors the image"):
        camera_from_sensor(mi.load_dict(mirrored))


def test_a_sheared_image_is_refused():
    shear = mi.ScalarTransform4f([[1, 0.3, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    with pytest.raises(SceneError, match="shears the image"):
        camera_from_sensor(mi.load_dict({"type": "orthographic", "to_world": shear}))
