"""Cameras, and the Mitsuba scene dict that puts a surface under a white sky."""

from collections.abc import Sequence
from dataclasses import dataclass

import mitsuba as mi

from gtao.errors import ConfigError
from gtao.render.variant import ensure_variant

from .mesh import Reflectance, mesh
from .surface import Surface

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Perspective:
    """Pinhole camera at ``origin`` looking at ``target``.

    ``fov`` is the full angle over the shorter side of the image, in degrees as in Mitsuba.
    """

    origin: Point
    target: Point
    fov: float
    up: Point = (0, 0, 1)
    near: float = 0.01


@dataclass(frozen=True)
class Orthographic:
    """Parallel camera on the plane through ``origin``; the image is ``view_height`` scene units high."""

    origin: Point
    target: Point
    view_height: float
    up: Point = (0, 1, 0)
    near: float = 0.01


def _sensor(view: Perspective | Orthographic, width: int, height: int) -> dict:
    frame = mi.ScalarTransform4f().look_at(origin=view.origin, target=view.target, up=view.up)
    if isinstance(view, Perspective):
        lens = {"type": "perspective", "fov": view.fov, "fov_axis": "smaller", "to_world": frame}
    else:
        # Mitsuba's film spans -1 .. 1 in x, and its height follows from the aspect ratio.
        scale = view.view_height * width / (2 * height)
        lens = {"type": "orthographic", "to_world": frame @ mi.ScalarTransform4f().scale([scale, scale, 1])}
    return {
        **lens,
        "near_clip": view.near,
        "far_clip": 1e5,
        "film": {
            "type": "hdrfilm",
            "width": width,
            "height": height,
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "independent", "sample_count": 64},
    }


def compose(
    surface: Surface,
    views: Sequence[Perspective | Orthographic],
    width: int,
    height: int,
    reflectance: Reflectance,
) -> dict:
    """Scene dict: the surface, a constant sky of radiance 1, and one sensor for each view.

    Mitsuba keeps the order of the dict, so that view i is sensor i: keys "sensor", "sensor_1", "sensor_2" …

    Args:
        surface: triangles in world space.
        views: cameras.
        width: of the image, in pixels.
        height: of the image, in pixels.
        reflectance: diffuse reflectance of the surface, grey or RGB, in [0, 1].

    Returns:
        A dict for ``mi.load_dict``.

    Raises:
        ConfigError: size or reflectance out of range.
        BackendError: there is no usable backend.
    """
    ensure_variant()
    for name, size in (("width", width), ("height", height)):
        if isinstance(size, bool) or not isinstance(size, int) or size < 1:
            raise ConfigError(f"{name} must be a whole number of pixels >= 1, got {size!r}")
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 5},
        "sky": {"type": "constant", "radiance": {"type": "rgb", "value": 1.0}},
        "surface": mesh(surface, reflectance),
    }
    for i, view in enumerate(views):
        scene[f"sensor_{i}" if i else "sensor"] = _sensor(view, width, height)
    return scene
