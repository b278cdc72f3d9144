"""Pinhole and orthographic cameras in the view frame: +x right, +y up, looking along -z.

Pixel coordinates are continuous, (0, 0) is the top left corner of the top left pixel, centres lie at half-integers.
"""

import math
import numbers
from dataclasses import dataclass, fields, replace
from typing import Any

import drjit as dr

from .backend import types_of
from .config import plain
from .errors import ConfigError

__all__ = ["OrthographicCamera", "PerspectiveCamera", "camera_from_dict"]


#: Image-plane slopes and positions beyond these would overflow float32 when squared.
MAX_SLOPE = 1e6
MAX_EXTENT = 1e12
#: Widest angle from the optical axis, in degrees, that a guard band may reach: out there a pixel covers 3000 times less
#: of the view than on the axis.
WIDEST = 89


def _size(name: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, numbers.Integral) or value < 1:
        raise ConfigError(f"camera {name} must be a positive integer, got {value!r}")
    return int(value)


def _finite(name: str, value: Any) -> Any:
    """A Python float, or the Dr.Jit float of width 1 that came, which may carry a gradient."""
    array = dr.is_array_v(value)
    number = value[0] if array and not dr.is_tensor_v(value) and len(value) == 1 else value
    if isinstance(number, bool) or not isinstance(number, numbers.Real) or not math.isfinite(number):
        raise ConfigError(f"camera {name} must be a finite number or a Dr.Jit float of width 1, got {value!r}")
    return value if array else float(number)


def _positive(name: str, value: Any) -> Any:
    value = _finite(name, value)
    if plain(value) <= 0:
        raise ConfigError(f"camera {name} must be positive, got {plain(value)!r}")
    return value


def _set(camera: Any, **values: Any) -> None:
    """Fill in the fields of a frozen camera, checked for what its kernels can compute with."""
    for name, value in values.items():
        object.__setattr__(camera, name, value)
    if plain(camera.near) < 0:
        raise ConfigError(f"camera near must not be negative, got {plain(camera.near)}")
    limit = MAX_EXTENT if camera.is_orthographic else MAX_SLOPE
    for name, side, centre, focal in (
        ("x", camera.width, camera.cx, camera.fx),
        ("y", camera.height, camera.cy, camera.fy),
    ):
        centre, focal = plain(centre), plain(focal)
        if not (focal <= MAX_EXTENT and max(abs(centre), abs(side - centre)) <= limit * focal):
            raise ConfigError(
                f"the camera's pixels are too small, or its frame reaches further than {limit:g} along {name} (in"
                f" {'scene units' if camera.is_orthographic else 'units of the depth'}); check f{name} and c{name}"
            )


class _Camera:
    width: int
    height: int
    cx: float
    cy: float

    @property
    def shape(self) -> tuple[int, int]:
        """``(height, width)``, as images are indexed."""
        return self.height, self.width

    def crop(self, x0: int, y0: int, width: int, height: int):
        """The camera of the window whose top left pixel is ``(x0, y0)``; it may reach beyond the frame."""
        return replace(self, width=width, height=height, cx=self.cx - x0, cy=self.cy - y0)

    def padded(self, pixels: int):
        """The camera of the same view with a guard band: ``pixels`` more on every side, everything else in place.

        ``camera.padded(p).crop(p, p, camera.width, camera.height)`` is the camera again.

        Raises:
            ConfigError: ``pixels`` is not a whole number from 0, or the view would reach more than 89 degrees from
                the optical axis.
        """
        if isinstance(pixels, bool) or not isinstance(pixels, numbers.Integral) or pixels < 0:
            raise ConfigError(f"a guard band is a whole number of pixels from 0 on, got {pixels!r}")
        p = int(pixels)
        wide = self.crop(-p, -p, self.width + 2 * p, self.height + 2 * p)
        fx, fy, cx, cy = (plain(value) for value in (wide.fx, wide.fy, wide.cx, wide.cy))
        reach = max(cx / fx, (wide.width - cx) / fx, cy / fy, (wide.height - cy) / fy)
        if p and not self.is_orthographic and reach > math.tan(math.radians(WIDEST)):
            raise ConfigError(
                f"a guard band of {p} pixels widens the view to {math.degrees(math.atan(reach)):.2f} degrees from the"
                f" optical axis; at most {WIDEST} are allowed; take fewer pixels"
            )
        return wide

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers that :func:`camera_from_dict` turns back into the same camera."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return {"type": self.kind} | {k: v if isinstance(v, int) else plain(v) for k, v in values.items()}


@dataclass(frozen=True)
class PerspectiveCamera(_Camera):
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
        width, height = _size("width", width), _size("height", height)
        if (fov_y is None) == (fx is None):
            raise ConfigError("give either fov_y or fx (and fy), not both and not neither")
        if fov_y is not None:
            if not 0 < plain(_finite("fov_y", fov_y)) < math.pi:
                raise ConfigError(f"fov_y must be in (0, pi) radians, got {plain(fov_y)}")
            fx = fy = 0.5 * height / dr.tan(0.5 * fov_y)
        _set(
            self,
            width=width,
            height=height,
            fx=_positive("fx", fx),
            fy=_positive("fy", fx if fy is None else fy),
            cx=0.5 * width if cx is None else _finite("cx", cx),
            cy=0.5 * height if cy is None else _finite("cy", cy),
            near=_finite("near", near),
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


@dataclass(frozen=True)
class OrthographicCamera(_Camera):
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
        width, height = _size("width", width), _size("height", height)
        view_height = _positive("view_height", view_height)
        _set(
            self,
            width=width,
            height=height,
            view_height=view_height,
            view_width=view_height * width / height if view_width is None else _positive("view_width", view_width),
            cx=0.5 * width if cx is None else _finite("cx", cx),
            cy=0.5 * height if cy is None else _finite("cy", cy),
            near=_finite("near", near),
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


Camera = PerspectiveCamera | OrthographicCamera


def camera_from_dict(data: dict[str, Any]) -> Camera:
    """The camera that :meth:`PerspectiveCamera.to_dict` or :meth:`OrthographicCamera.to_dict` described.

    Raises:
        ConfigError: the type is unknown or a number is missing or out of range.
    """
    kinds = {c.kind: c for c in (PerspectiveCamera, OrthographicCamera)}
    if not isinstance(data, dict):
        raise ConfigError(f"a camera is described by an object of names and numbers, got {type(data).__name__}")
    data = dict(data)
    kind = data.pop("type", None)
    if not isinstance(kind, str) or kind not in kinds:
        raise ConfigError(f"camera type must be one of {', '.join(kinds)}, got {kind!r}")
    try:
        return kinds[kind](**data)
    except ConfigError:
        raise
    except (TypeError, ValueError, OverflowError) as error:
        raise ConfigError(f"bad {kind} camera: {error}") from None
