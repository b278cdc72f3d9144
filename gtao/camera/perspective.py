"""The pinhole camera."""

import math
from dataclasses import dataclass

import drjit as dr

from gtao.backend import types_of
from gtao.config import plain
from gtao.errors import ConfigError

from .base import BaseCamera, fill_in, finite, positive, size_of

__all__ = ["PerspectiveCamera"]


@dataclass(frozen=True)
class PerspectiveCamera(BaseCamera):
    """Pinhole camera.

    Give either ``fov_y`` or the focal lengths. The principal point ``(cx, cy)`` is in pixels and defaults to the
    centre of the frame. All numbers but the size may be Dr.Jit floats of width 1, which may carry gradients.

    Args:
        width, height: size of the image in pixels.
        fov_y: vertical field of view in radians, in (0, π); pixels are then square.
        fx, fy: focal lengths in pixels; ``fy`` defaults to ``fx``.
        cx, cy: principal point in pixels.
        near: distance of the near plane, in scene units; only ray distances that start there need it.

    Raises:
        ConfigError: a number is out of range, or the focal length is given twice or not at all.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    near: float = 0.0

    kind = "perspective"
    is_orthographic = False

    def __init__(
        self,
        width: int,
        height: int,
        fov_y: float | None = None,
        *,
        fx: float | None = None,
        fy: float | None = None,
        cx: float | None = None,
        cy: float | None = None,
        near: float = 0.0,
    ):
        width, height = size_of("width", width), size_of("height", height)
        if (fov_y is None) == (fx is None):
            raise ConfigError("give either fov_y or fx (and fy), not both and not neither")
        if fov_y is not None:
            if not 0 < plain(finite("fov_y", fov_y)) < math.pi:
                raise ConfigError(f"fov_y must be in (0, pi) radians, got {plain(fov_y)}")
            fx = fy = 0.5 * height / dr.tan(0.5 * fov_y)
        fill_in(
            self,
            width=width,
            height=height,
            fx=positive("fx", fx),
            fy=positive("fy", fx if fy is None else fy),
            cx=0.5 * width if cx is None else finite("cx", cx),
            cy=0.5 * height if cy is None else finite("cy", cy),
            near=finite("near", near),
        )

    @property
    def fov_y(self) -> float:
        """Vertical field of view in radians."""
        return dr.atan((self.height - self.cy) / self.fy) + dr.atan(self.cy / self.fy)

    def project(self, P):
        """Point(s) in the view frame to ``(x_px, y_px, view_z)``; meaningful only in front of the camera."""
        view_z = -P.z
        return self.cx + self.fx * P.x / view_z, self.cy - self.fy * P.y / view_z, view_z

    def unproject(self, x_px, y_px, view_z):
        """Pixel coordinates and distance along the optical axis to points (Array3) in the view frame."""
        A3 = types_of(type(view_z)).Array3
        return A3((x_px - self.cx) / self.fx * view_z, (self.cy - y_px) / self.fy * view_z, -view_z)

    def view_z_from_ray_t(self, x_px, y_px, ray_t, *, from_near: bool = False):
        """Distance along the unit ray to distance along the optical axis.

        Args:
            x_px, y_px: pixel coordinates.
            ray_t: distance along the ray, in scene units.
            from_near: the ray starts on the near plane (as Mitsuba's do) instead of in the camera.
        """
        x, y = (x_px - self.cx) / self.fx, (y_px - self.cy) / self.fy
        z = ray_t / dr.sqrt(x * x + y * y + 1)
        return z + self.near if from_near else z
