"""Depth peeling: where the bodies behind every pixel begin and end."""

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from gtao.errors import ConfigError, SceneError
from gtao.layers import DepthLayers

from .bodies import bodies
from .crossings import crossings
from .loading import select_sensor
from .primary import PrimaryHits, match_gbuffer, shoot
from .sensor import camera_from_sensor, pixel_centre_rays
from .traceable import Traceable
from .variant import ensure_variant

__all__ = ["layers", "thickness"]

#: Rays in one launch: the sorting of their crossings takes up to 4 kB each.
RAYS_PER_CHUNK = 1 << 16
#: Rounding between two ways to compute one hit point, relative to its depth and to its largest coordinate.
SAME_DEPTH, SAME_PLACE = 1e-5, 2.0**-20


def layers(scene: Any, g: Any = None, n_layers: int = 4, *, sensor: Any = 0) -> DepthLayers:
    """Where the ray through every pixel centre enters and leaves the bodies of the scene.

    The rays are those of :func:`gtao.render.gbuffer`, and go on through everything. A connected surface that a ray
    enters and leaves again is a body; bodies that overlap or touch, to 1.5e-5 of the largest coordinate, are one. What
    is crossed without being left again (a card, a leaf) is a sheet: its back is its front. But a surface of half the
    size of the scene or more (the ground, a backdrop) with nothing behind it is no sheet but the border of something
    unknown: its back is infinite.

    Triangles belong together that share edges, in one mesh or across shapes. On a closed surface the first crossing
    enters, whichever way its normals point; on an open one the side counts that the geometric normal points to: a ray
    enters at the front and leaves at the back. Shape groups count as one surface per instance. Of curves the tracer
    reports the front only: they are sheets.

    Args:
        scene: ``mitsuba.Scene``; see :func:`gtao.render.load_scene`.
        g: G-buffer of the same scene and sensor, with or without a guard band, whose ``view_z`` the first layer
            begins at. ``None`` takes that of the scene.
        n_layers: K, bodies to keep per pixel.
        sensor: index of the sensor, or a ``mitsuba.Sensor``.

    Returns:
        ``gtao.DepthLayers``: front and back, each (K, H, W), in ``view_z``.

    Raises:
        SceneError: no such sensor, or ``g`` is not of this scene and sensor.
        ConfigError: ``n_layers`` is out of range.
        BackendError: there is no usable backend.
    """
    ensure_variant()
    if isinstance(n_layers, bool) or not isinstance(n_layers, int) or n_layers < 1:
        raise ConfigError(f"n_layers must be a positive integer, got {n_layers!r}")
    chosen = select_sensor(scene, sensor)
    guard_px = 0 if g is None else _guard_band(g, chosen)
    hits = shoot(scene, chosen, "geometric", guard_px)
    valid = hits.valid if g is None else match_gbuffer(hits, g)[1]
    view_z = hits.view_z.numpy() if g is None else g.view_z.numpy().ravel()
    front, back = np.full((2, n_layers, len(view_z)), np.inf, dtype=view_z.dtype)
    pixel = np.flatnonzero(valid.numpy())
    ray = pixel_centre_rays(chosen, guard_px)
    traceable = Traceable(scene) if len(pixel) else None
    for start in range(0, len(pixel), RAYS_PER_CHUNK):
        part = pixel[start : start + RAYS_PER_CHUNK]
        front[:, part], back[:, part] = _peel(traceable, hits, ray, part, n_layers, view_z)
    shape = (n_layers, *hits.camera.shape)
    return DepthLayers(front.reshape(shape), back.reshape(shape))


def thickness(scene: Any, g: Any = None, *, sensor: Any = 0) -> Any:
    """How far it is from the first surface of every pixel to where its ray leaves the body behind it.

    Args:
        scene, g, sensor: as for :func:`gtao.render.layers`, which says what a body is.

    Returns:
        (H, W) tensor: the way along the optical axis, in scene units, as ``view_z`` is measured. Times the length of
        ``((x_px - cx) / fx, (y_px - cy) / fy, 1)`` it is the way along the ray of a pinhole camera. 0 on sheets and on
        the background, inf where the ray never leaves.

    Raises:
        SceneError: no such sensor, or ``g`` is not of this scene and sensor.
        BackendError: there is no usable backend.
    """
    return layers(scene, g, 1, sensor=sensor).thickness


def _guard_band(g: Any, sensor: Any) -> int:
    """Pixels that a G-buffer has on every side beyond its sensor's film."""
    camera, _ = camera_from_sensor(sensor)
    extra = {g.shape[0] - camera.height, g.shape[1] - camera.width}
    band = extra.pop()
    if extra or band < 0 or band % 2:
        raise SceneError(
            f"the G-buffer is {g.shape[1]}x{g.shape[0]} pixels, the sensor {camera.width}x{camera.height}: that is no"
            " guard band of equal width on all sides"
        )
    return band // 2


def _peel(
    traceable: Any, hits: PrimaryHits, ray: Any, pixel: np.ndarray, n_layers: int, view_z: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Front and back (K, N) of the pixels, the first front at their ``view_z``."""
    n_all = len(view_z)
    index = mi.UInt32(pixel.astype(np.uint32))
    # A direction common to all pixels has a single entry.
    origin, direction = (v + dr.zeros(type(v), n_all) for v in (ray.o, ray.d))
    origin, direction = (dr.gather(type(v), v, index) for v in (origin, direction))
    reach = np.abs(origin.numpy()).max(0).astype(np.float64)
    found = bodies(crossings(traceable, origin, direction), traceable.closed, traceable.large, n_layers, reach)
    along = direction.numpy().T.astype(np.float64) @ -hits.view_to_world[:3, 2]
    front, back = (hits.camera.near + t * along for t in found)
    seen = hits.view_z.numpy()[pixel]
    return _anchored(front, back, seen, view_z[pixel], SAME_DEPTH * seen + SAME_PLACE * reach)


def _anchored(
    front: np.ndarray, back: np.ndarray, seen: np.ndarray, view_z: np.ndarray, tolerance: np.ndarray
) -> tuple[Any, Any]:
    """Let the first body begin at ``view_z``, with the thickness that it has behind the surface ``seen`` there.

    Rounding lets a ray slip through an edge in one trace and not in the other. Bodies in front of what the frame shows
    are dropped, and a surface that the frame shows but the peeling missed is put in as a sheet.
    """
    none = np.full((1, len(seen)), np.inf)
    while (ahead := back[0] < seen - tolerance).any():
        front, back = (np.where(ahead, np.append(v[1:], none, axis=0), v) for v in (front, back))
    missed = front[0] > seen + tolerance
    front, back = (np.where(missed, np.append(seen[None], v[:-1], axis=0), v) for v in (front, back))
    ordered = np.stack([front, back], axis=1).reshape(-1, len(seen))
    ordered[1] += view_z - ordered[0]
    ordered[0] = view_z
    # Layers are in order up to the rounding of the frame's depth.
    ordered = np.maximum.accumulate(ordered.astype(view_z.dtype), axis=0)
    return ordered[0::2], ordered[1::2]
