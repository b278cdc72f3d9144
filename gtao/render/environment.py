"""Environment light between Mitsuba's emitters and latitude-longitude maps."""

import math
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from gtao.errors import ConfigError, SceneError
from gtao.lighting import EnvironmentMap

from .loading import select_sensor
from .sensor import ORTHOGONALITY, camera_from_sensor
from .variant import ensure_variant

__all__ = ["environment", "environment_emitter", "light_density", "light_of", "view_to_world"]


def view_to_world(scene: Any, sensor: Any = 0) -> np.ndarray:
    """Where the view frame of a sensor stands: what :func:`gtao.lighting.to_view` turns light by.

    Args:
        scene: ``mitsuba.Scene``; see :func:`gtao.render.load_scene`.
        sensor: index of the sensor, or a ``mitsuba.Sensor``.

    Returns:
        4x4 row-major float64 matrix that takes points of the view frame (+x right, +y up, looking along -z) to the
        world; its upper left 3x3 is a rotation.

    Raises:
        SceneError: no such sensor, or one without a view frame (see :func:`gtao.render.camera_from_sensor`).
        BackendError: there is no usable backend.
    """
    ensure_variant()
    return camera_from_sensor(select_sensor(scene, sensor))[1]


def environment_emitter(environment: EnvironmentMap) -> dict:
    """Dictionary of a Mitsuba ``envmap`` emitter with the radiance of a map, for a scene of ``mitsuba.load_dict``.

    Mitsuba puts the first and the last row onto the poles. An image with a row for every centre, for every border
    between rows and for the poles makes its interpolation that of the map, up to rounding.

    Raises:
        ConfigError: ``environment`` is not a map.
        SceneError: the variant does not render in linear RGB.
        BackendError: there is no usable backend.
    """
    ensure_variant()
    if not isinstance(environment, EnvironmentMap):
        raise ConfigError(f"environment must be a gtao.lighting.EnvironmentMap, got {type(environment).__name__}")
    _check_colours()
    rows = environment.radiance
    image = np.empty((2 * len(rows) + 1, *rows.shape[1:]), dtype=np.float32)
    image[1::2] = rows
    image[2:-1:2] = 0.5 * (rows[:-1] + rows[1:])
    image[0], image[-1] = rows[0], rows[-1]
    to_world = np.eye(4)
    to_world[:3, :3] = environment.to_world
    return {"type": "envmap", "bitmap": mi.Bitmap(image), "to_world": mi.ScalarTransform4f(to_world)}


def light_of(scene: Any, environment: EnvironmentMap | None) -> Any:
    """Mitsuba emitter of a map, or, without one, the scene's own environment.

    Raises:
        SceneError: the scene has none, or the variant does not render in linear RGB.
        ConfigError: ``environment`` is neither.
    """
    if environment is not None:
        return mi.load_dict(environment_emitter(environment))
    _check_colours()
    emitter = scene.environment()
    if emitter is None:
        raise SceneError(
            "the scene has no environment light; add an emitter such as envmap, constant or sunsky, or pass a "
            "gtao.lighting.EnvironmentMap"
        )
    return emitter


def radiance(emitter: Any, direction: Any) -> Any:
    """Linear RGB radiance that arrives from unit directions in the world, as Color3f."""
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(direction))
    si.wi = -direction
    return mi.Color3f(emitter.eval(si))


def light_density(emitter: Any, direction: Any) -> Any:
    """Density per solid angle with which the emitter's own sampling draws unit directions; NaN of a black map."""
    sampled = dr.zeros(mi.DirectionSample3f)
    sampled.d = direction
    return emitter.pdf_direction(dr.zeros(mi.Interaction3f), sampled)


def environment(scene: Any, height: int = 256, *, samples: int = 8) -> EnvironmentMap:
    """The scene's environment light (``envmap``, ``constant``, ``sunsky``, …) as a map.

    Args:
        scene: ``mitsuba.Scene``; see :func:`gtao.render.load_scene`.
        height: rows of the map; it has twice as many columns.
        samples: directions along each side of a texel that its radiance is the mean of, in solid angle. A sun has
            half a degree: with fewer than 8 at the default height it may fall between them. With 1, texels are
            the radiance at their centres, which gives the map of an :func:`environment_emitter` back.

    Returns:
        :class:`gtao.lighting.EnvironmentMap` in linear RGB, as Mitsuba's emitters have it; its ``to_world`` is that of
        the emitter where that is a rotation or reflection, the identity elsewhere.

    Raises:
        SceneError: the scene has no such light, or the variant does not render in linear RGB.
        ConfigError: the height is below 2 or the number of samples below 1.
        BackendError: there is no usable backend.
    """
    ensure_variant()
    for name, value, least in (("height", height, 2), ("samples", samples, 1)):
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            raise ConfigError(f"{name} must be an integer of at least {least}, got {value!r}")
    emitter = light_of(_scene(scene), None)
    frame = _frame(emitter)
    total, weight = np.zeros((height, 2 * height, 3)), np.zeros((height, 1, 1))
    for a in (np.arange(samples) + 0.5) / samples:
        theta = math.pi * (np.arange(height) + a)[:, None] / height
        weight += np.sin(theta)[..., None]
        for b in (np.arange(samples) + 0.5) / samples:
            phi = math.pi * (np.arange(2 * height) + b) / height
            local = np.stack(
                np.broadcast_arrays(np.sin(phi) * np.sin(theta), np.cos(theta), -np.cos(phi) * np.sin(theta))
            )
            world = (frame @ local.reshape(3, -1)).astype(np.float32)
            values = np.broadcast_to(radiance(emitter, mi.Vector3f(world)).numpy(), world.shape)
            total += np.sin(theta)[..., None] * values.T.reshape(total.shape)
    return EnvironmentMap((total / (samples * weight)).astype(np.float32), frame)


def _scene(scene: Any) -> Any:
    if not isinstance(scene, mi.Scene):
        raise SceneError(f"expected a mitsuba.Scene (see gtao.render.load_scene), got {type(scene).__name__}")
    return scene


def _frame(emitter: Any) -> np.ndarray:
    """Local frame of an emitter, or the world's where its transform is more than a rotation or reflection."""
    matrix = np.array(emitter.world_transform().matrix, dtype=np.float64).reshape(4, 4, -1)[:3, :3, 0]
    return matrix if np.abs(matrix.T @ matrix - np.eye(3)).max() <= ORTHOGONALITY else np.eye(3)


def _check_colours() -> None:
    if not mi.is_rgb:
        raise SceneError(f"light in linear RGB needs an rgb variant of Mitsuba, not {mi.variant()}")
