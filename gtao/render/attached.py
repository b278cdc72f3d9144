"""Derivatives of a frame with respect to the scene and the sensor that sees it.

Mitsuba differentiates where rays meet surfaces. The numbers of cameras are computed without it; here their derivatives
are added.
"""

import math
from dataclasses import replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from .sensor import rotation

__all__ = ["attached_camera", "keeping", "rotation_to_view"]


def attached_camera(sensor: Any, camera: Any) -> Any:
    """The camera of a frame, carrying derivatives with respect to the field of view, the principal point and the scale.

    Args:
        sensor: ``mitsuba.Sensor``.
        camera: of :func:`gtao.render.camera_from_sensor`, with or without a guard band.
    """
    parameters: Any = mi.traverse(sensor)
    film_width, film_height = (int(v) for v in parameters["film.size"])
    if camera.is_orthographic:
        matrix = sensor.world_transform().matrix
        if not dr.grad_enabled(matrix):
            return camera
        scale_x, scale_y, scale_z = (dr.norm(column) for column in _columns(matrix))
        pixel = 2.0 / film_width
        numbers = {
            "view_width": camera.width * pixel * scale_x,
            "view_height": camera.height * pixel * scale_y,
            "near": float(parameters["near_clip"]) * scale_z,
        }
    else:
        shift_x, shift_y = (parameters[f"principal_point_offset_{axis}"] for axis in "xy")
        fov_x = parameters["x_fov"]
        if not dr.grad_enabled(fov_x, shift_x, shift_y):
            return camera
        focal = 0.5 * film_width / dr.tan(math.radians(0.5) * fov_x)
        numbers = {"fx": focal, "fy": focal, "cx": -film_width * shift_x, "cy": -film_height * shift_y}
    attached = {
        name: dr.replace_grad(mi.Float(getattr(camera, name)), value)
        for name, value in numbers.items()
        if dr.grad_enabled(value)
    }
    return replace(camera, **attached)


def rotation_to_view(sensor: Any, view_to_world: np.ndarray) -> Any:
    """Matrix3f that takes directions in the world to the view frame, with derivatives if the sensor's place has any."""
    plain, matrix = rotation(view_to_world.T), sensor.world_transform().matrix
    if not dr.grad_enabled(matrix):
        return plain
    left, up, forward = (column / dr.norm(column) for column in _columns(matrix))
    return dr.replace_grad(plain, mi.Matrix3f(-left, up, -forward))


def _columns(matrix: Any) -> list[Any]:
    """Images of the sensor's axes in the world."""
    return [mi.Vector3f(matrix[0, i], matrix[1, i], matrix[2, i]) for i in range(3)]


class _Sealed:
    """Keeps Dr.Jit from looking into an argument."""

    def __init__(self, value: Any):
        self.value = value


class _Keeping(dr.CustomOp):
    """The identity, which holds on to a scene."""

    def eval(self, sealed: _Sealed, array: Any):
        self.sealed = sealed
        return array

    def forward(self):
        self.set_grad_out(self.grad_in("array"))

    def backward(self):
        self.set_grad_in("array", self.grad_out())


def keeping(scene: Any, array: Any) -> Any:
    """The array; if it is attached, its scene lives as long as the gradients.

    Mitsuba calls the shapes of the scene again when it goes through the derivatives of an intersection. If they are
    gone by then, those are zero, without an error.
    """
    return dr.custom(_Keeping, _Sealed(scene), array) if dr.grad_enabled(array) else array
