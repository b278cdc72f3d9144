"""What cameras have in common: windows of their frames, and the ranges that their numbers must lie in."""

import math
import numbers
from dataclasses import fields, replace
from typing import Any

import drjit as dr

from gtao.config import plain
from gtao.errors import ConfigError

__all__ = ["BaseCamera", "fill_in", "finite", "positive", "size_of"]

#: Image-plane slopes and positions beyond these would overflow float32 when squared.
MAX_SLOPE = 1e6
MAX_EXTENT = 1e12
#: Widest angle from the optical axis, in degrees, that a guard band may reach: out there a pixel covers 3000 times less
#: of the view than on the axis.
WIDEST = 89


def size_of(name: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, numbers.Integral) or value < 1:
        raise ConfigError(f"camera {name} must be a positive integer, got {value!r}")
    return int(value)


def finite(name: str, value: Any) -> Any:
    """A Python float, or the Dr.Jit float of width 1 that came, which may carry a gradient."""
    array = dr.is_array_v(value)
    number = value[0] if array and not dr.is_tensor_v(value) and len(value) == 1 else value
    if isinstance(number, bool) or not isinstance(number, numbers.Real) or not math.isfinite(number):
        raise ConfigError(f"camera {name} must be a finite number or a Dr.Jit float of width 1, got {value!r}")
    return value if array else float(number)


def positive(name: str, value: Any) -> Any:
    value = finite(name, value)
    if plain(value) <= 0:
        raise ConfigError(f"camera {name} must be positive, got {plain(value)!r}")
    return value


def fill_in(camera: Any, **values: Any) -> None:
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


class BaseCamera:
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

    def reduced(self, factor: int):
        """The camera of the same view with pixels ``factor`` times as wide; sides that it does not divide grow."""
        width, height = -(-self.width // factor), -(-self.height // factor)
        scaled = {name: getattr(self, name) / factor for name in ("fx", "fy", "cx", "cy")}
        return replace(self, width=width, height=height, **scaled)

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
