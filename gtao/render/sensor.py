"""Mitsuba sensors as gtao cameras, and the rays through their pixel centres.

Mitsuba's camera frame is +x left, +y up, +z forward; the view frame is +x right, +y up, -z forward.
"""

import math
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from gtao.camera import OrthographicCamera, PerspectiveCamera
from gtao.errors import SceneError

__all__ = ["camera_from_sensor", "pixel_centre_rays", "pose_matrix", "rotation", "scale_of"]

# Mitsuba keeps transforms in single precision; products of a few rotations stay within this of orthogonal.
ORTHOGONALITY = 1e-4

_VIEW_FROM_LOCAL = np.array([-1.0, 1.0, -1.0])


def _frame(sensor: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Orthonormal axes of the sensor as columns, the scale along each, and the origin, in world space."""
    matrix = np.array(sensor.world_transform().matrix, dtype=np.float64).reshape(4, 4, -1)[:, :, 0]
    scale = np.linalg.norm(matrix[:3, :3], axis=0)
    if not np.all(scale > 0):
        raise SceneError("the sensor's to_world is singular")
    axes = matrix[:3, :3] / scale
    if np.abs(axes.T @ axes - np.eye(3)).max() > ORTHOGONALITY:
        raise SceneError("the sensor's to_world shears the image; use rotations, translations and (orthographic) scale")
    if np.linalg.det(axes) < 0:
        raise SceneError("the sensor's to_world mirrors the image (negative determinant); remove the negative scale")
    return axes, scale, matrix[:3, 3]


def camera_from_sensor(sensor: Any) -> tuple[PerspectiveCamera | OrthographicCamera, np.ndarray]:
    """The camera of a Mitsuba sensor, and where it stands.

    Args:
        sensor: ``perspective`` (field of view, principal point, crop window) or ``orthographic`` (scale in
            ``to_world``, crop window).

    Returns:
        The camera, whose image is the crop window of the film and whose ``near`` is in scene units, and the
        4x4 row-major float64 matrix that takes points of the view frame to the world. Its inverse takes world
        to view.

    Raises:
        SceneError: another kind of sensor, or a ``to_world`` that mirrors or shears.
    """
    if not isinstance(sensor, mi.Sensor):
        raise SceneError(f"expected a mitsuba.Sensor, got {type(sensor).__name__}")
    kind = sensor.class_name()
    if kind not in ("PerspectiveCamera", "OrthographicCamera"):
        raise SceneError(
            f"sensors of the kind {kind} have no G-buffer here; supported are perspective and orthographic"
        )
    axes, scale, origin = _frame(sensor)
    view_to_world = np.eye(4)
    view_to_world[:3, :3] = axes * _VIEW_FROM_LOCAL
    view_to_world[:3, 3] = origin

    parameters: Any = mi.traverse(sensor)
    film_width, film_height = (int(v) for v in parameters["film.size"])
    x0, y0 = (int(v) for v in parameters["film.crop_offset"])
    width, height = (int(v) for v in parameters["film.crop_size"])
    near = float(parameters["near_clip"]) * scale[2]
    if kind == "PerspectiveCamera":
        fov_x = math.radians(_scalar(parameters["x_fov"]))
        focal = 0.5 * film_width / math.tan(0.5 * fov_x)
        camera = PerspectiveCamera(
            width,
            height,
            fx=focal,
            cx=film_width * (0.5 - _scalar(parameters["principal_point_offset_x"])) - x0,
            cy=film_height * (0.5 - _scalar(parameters["principal_point_offset_y"])) - y0,
            near=near,
        )
    else:
        # The film spans -1..1 in x, and as much per pixel in y, before the scale in to_world.
        pixel = 2.0 / film_width
        camera = OrthographicCamera(
            width,
            height,
            height * pixel * scale[1],
            view_width=width * pixel * scale[0],
            cx=0.5 * film_width - x0,
            cy=0.5 * film_height - y0,
            near=near,
        )
    return camera, view_to_world


def _scalar(value: Any) -> float:
    return float(value) if isinstance(value, float | int) else float(value[0])


def rotation(matrix: np.ndarray) -> Any:
    """Upper left 3x3 block, opaque so that another camera does not mean another kernel."""
    result = mi.Matrix3f(np.asarray(matrix, dtype=np.float32)[:3, :3])
    dr.make_opaque(result)
    return result


def pixel_centre_rays(sensor: Any, guard_px: int = 0) -> Any:
    """The sensor's own rays through the centre of every pixel, row by row from the top left.

    They start on the near plane: lengths along them are not distances from the camera. With a guard band the rays
    within the frame keep their bits: those outside continue the same lattice over the film's edge.
    """
    width, height = (int(v) for v in sensor.film().crop_size())
    wide = width + 2 * guard_px
    index = dr.arange(mi.UInt32, wide * (height + 2 * guard_px))
    y = index // wide
    x = index - y * wide
    film = mi.Point2f((mi.Float(x) - guard_px + 0.5) / width, (mi.Float(y) - guard_px + 0.5) / height)
    ray, _ = sensor.sample_ray(0.0, 0.5, film, mi.Point2f(0.5))
    return ray


def scale_of(sensor: Any) -> np.ndarray:
    """Scale along the axes of a sensor's ``to_world``, which only that of an orthographic one may have."""
    return _frame(sensor)[1] if sensor.class_name() == "OrthographicCamera" else np.ones(3)


def pose_matrix(view_to_world: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """The ``to_world`` of a sensor in a pose."""
    result = np.array(view_to_world, dtype=np.float64)
    result[:3, :3] *= _VIEW_FROM_LOCAL * scale
    return result
