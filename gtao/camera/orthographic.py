"""Parallel projection."""

from dataclasses import dataclass

from gtao.backend import types_of

from .base import BaseCamera, fill_in, finite, positive, size_of

__all__ = ["OrthographicCamera"]


@dataclass(frozen=True)
class OrthographicCamera(BaseCamera):
    """Parallel projection along -z.

    All numbers but the size may be Dr.Jit floats of width 1, which may carry gradients.

    Args:
        width, height: size of the image in pixels.
        view_height: height of the frame in scene units; pixels are square unless ``view_width`` is given.
        view_width: width of the frame in scene units.
        cx, cy: pixel coordinates of the optical axis; default is the centre of the frame.
        near: distance of the near plane, in scene units.

    Raises:
        ConfigError: a number is out of range.
    """

    width: int
    height: int
    view_height: float
    view_width: float
    cx: float
    cy: float
    near: float = 0.0

    kind = "orthographic"
    is_orthographic = True

    def __init__(
        self,
        width: int,
        height: int,
        view_height: float,
        *,
        view_width: float | None = None,
        cx: float | None = None,
        cy: float | None = None,
        near: float = 0.0,
    ):
        width, height = size_of("width", width), size_of("height", height)
        view_height = positive("view_height", view_height)
        fill_in(
            self,
            width=width,
            height=height,
            view_height=view_height,
            view_width=view_height * width / height if view_width is None else positive("view_width", view_width),
            cx=0.5 * width if cx is None else finite("cx", cx),
            cy=0.5 * height if cy is None else finite("cy", cy),
            near=finite("near", near),
        )

    @property
    def fx(self) -> float:
        """Pixels per scene unit along x."""
        return self.width / self.view_width

    @property
    def fy(self) -> float:
        """Pixels per scene unit along y."""
        return self.height / self.view_height

    def crop(self, x0: int, y0: int, width: int, height: int):
        return OrthographicCamera(
            width,
            height,
            height / self.fy,
            view_width=width / self.fx,
            cx=self.cx - x0,
            cy=self.cy - y0,
            near=self.near,
        )

    def reduced(self, factor: int):
        width, height = -(-self.width // factor), -(-self.height // factor)
        return OrthographicCamera(
            width,
            height,
            height * factor / self.fy,
            view_width=width * factor / self.fx,
            cx=self.cx / factor,
            cy=self.cy / factor,
            near=self.near,
        )

    def project(self, P):
        """Point(s) in the view frame to ``(x_px, y_px, view_z)``."""
        return self.cx + self.fx * P.x, self.cy - self.fy * P.y, -P.z

    def unproject(self, x_px, y_px, view_z):
        """Pixel coordinates and distance along the optical axis to points (Array3) in the view frame."""
        A3 = types_of(type(view_z)).Array3
        return A3((x_px - self.cx) / self.fx, (self.cy - y_px) / self.fy, -view_z)

    def view_z_from_ray_t(self, x_px, y_px, ray_t, *, from_near: bool = False):
        """As for the pinhole camera; all rays are parallel to the axis, so only the near plane matters."""
        return ray_t + self.near if from_near else ray_t
