"""G-buffers from what Mitsuba's stock ``aov`` integrator rendered."""

import os
from typing import Any

import mitsuba as mi
import numpy as np

from gtao.errors import ImageError, ShapeError
from gtao.gbuffer import GBuffer

from .sensor import camera_from_sensor
from .variant import ensure_variant

__all__ = ["gbuffer_from_aov"]

# What people call these outputs in the integrator's "name:type" list; only the name reaches the image.
_NORMAL_NAMES = ("sh_normal", "shading_normal", "normal", "normals", "nn", "n", "ns", "geo_normal", "ng")
_POSITION_NAMES = ("position", "positions", "pos", "p", "pp")
_ALBEDO_NAMES = ("albedo", "alb", "al")


def gbuffer_from_aov(
    image: Any,
    sensor: Any,
    *,
    depth: str | None = None,
    normal: str | None = None,
    position: str | None = None,
    albedo: str | None = None,
) -> GBuffer:
    """Take depth, normals and albedo out of a rendering with arbitrary output variables.

    Mitsuba's depth is the length of a ray that starts on the near plane, its normals are world space and face
    either way, its background is 0; all of that is undone here. A position, if there is one, is preferred to
    the depth. What cannot be undone is the filter: the integrator jitters its rays within the pixel and
    averages them, so a depth is off by up to half a pixel's slope, and pixels on silhouettes mix two
    surfaces. Render with a box filter and one sample per pixel, or use :func:`gtao.render.gbuffer`, which has
    neither problem.

    Args:
        image: ``mitsuba.Bitmap``, ``mitsuba.Film`` after a render, or the path of an image that Mitsuba
            reads. (The tensor that ``mitsuba.render`` returns has no channel names.)
        sensor: the ``mitsuba.Sensor`` that it was rendered with.
        depth, normal, position, albedo: names of the outputs, as before the colon in the integrator's
            ``aovs``. ``None`` finds them: depth by its type, the others by their usual names ("sh_normal",
            "nn", "position", "pos", "albedo" …).

    Returns:
        ``gtao.GBuffer`` in the view frame, background inf, with the pose of the sensor.

    Raises:
        ImageError: the file cannot be read, or an output is missing or ambiguous; the message lists what is
            there.
        ShapeError: the image has another size than the sensor.
        SceneError: the sensor is neither perspective nor orthographic.
        BackendError: there is no usable backend.
    """
    ensure_variant()
    camera, view_to_world = camera_from_sensor(sensor)
    outputs = _outputs(_bitmap(image))
    for values in outputs.values():
        if values[0].shape != camera.shape:
            (h, w), (ch, cw) = values[0].shape, camera.shape
            raise ShapeError(f"the image is {w}x{h} pixels, the sensor {cw}x{ch}")

    n_w = _pick(outputs, "XYZ", "normal", normal, _NORMAL_NAMES, required=True)
    P_w = _pick(outputs, "XYZ", "position", position, _POSITION_NAMES)
    t = _pick(outputs, "T", "depth", depth, (), required=P_w is None)
    colour = _pick(outputs, "RGB", "albedo", albedo, _ALBEDO_NAMES)

    length = np.linalg.norm(n_w, axis=-1)
    surface = np.isfinite(length) & (length > 0)
    direction = _view_directions(camera)
    if t is not None:
        surface &= np.isfinite(t[..., 0]) & (t[..., 0] > 0)
    if P_w is not None:
        view_z = (P_w - view_to_world[:3, 3]) @ -view_to_world[:3, 2]
    else:
        assert t is not None
        view_z = camera.near - t[..., 0] * direction[..., 2]
    surface &= np.isfinite(view_z) & (view_z > 0)

    normal_v = (n_w / np.where(surface, length, 1)[..., None]) @ view_to_world[:3, :3]
    away = (normal_v * direction).sum(-1) > 0
    normal_v = np.where(away[..., None], -normal_v, normal_v)
    return GBuffer(
        np.where(surface, view_z, np.inf).astype(np.float32),
        np.where(surface[..., None], normal_v, [0.0, 0.0, 1.0]).astype(np.float32),
        camera,
        albedo=None if colour is None else np.clip(colour, 0, 1).astype(np.float32),
        view_to_world=view_to_world,
    )


def _view_directions(camera: Any) -> np.ndarray:
    """(H, W, 3) unit directions from the camera through the pixel centres, view frame."""
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    if camera.is_orthographic:
        return np.broadcast_to([0.0, 0.0, -1.0], (*camera.shape, 3))
    d = np.stack([(x - camera.cx) / camera.fx, (camera.cy - y) / camera.fy, -np.ones_like(x)], axis=-1)
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def _bitmap(image: Any) -> Any:
    if isinstance(image, mi.Film):
        return image.bitmap()
    if isinstance(image, mi.Bitmap):
        return image
    if isinstance(image, str | os.PathLike):
        try:
            return mi.Bitmap(os.fspath(image))
        except Exception as error:
            raise ImageError(f"cannot read {os.fspath(image)}: {' '.join(str(error).split())}") from None
    raise ImageError(f"image must be a mitsuba.Bitmap, a mitsuba.Film or a path, got {type(image).__name__}")


def _outputs(bitmap: Any) -> dict[tuple[str, str], list[np.ndarray]]:
    """Channels grouped by output: ``("pos", "XYZ") -> [x, y, z]``. The order in the file says nothing."""
    pixels = np.array(bitmap)
    pixels = pixels.reshape(*pixels.shape[:2], -1).astype(np.float64)
    suffixes: dict[str, dict[str, np.ndarray]] = {}
    for i, field in enumerate(bitmap.struct_()):
        name, _, suffix = field.name.rpartition(".")
        suffixes.setdefault(name, {})[suffix] = pixels[..., i]
    return {
        (name, kind): [channels[s] for s in kind]
        for name, channels in suffixes.items()
        for kind in ("T", "XYZ", "RGB")
        if name and all(s in channels for s in kind)
    }


def _pick(
    outputs: dict[tuple[str, str], list[np.ndarray]],
    kind: str,
    what: str,
    name: str | None,
    usual: tuple[str, ...],
    required: bool = False,
) -> np.ndarray | None:
    """The output called ``name`` or, without a name, the one that is usually called so; (H, W, channels)."""
    there = [n for n, k in outputs if k == kind]
    if name is None:
        known = [n for u in usual for n in there if n.lower() == u] if usual else there
        name = known[0] if known else None
        if len(known) > 1 and not usual:
            raise ImageError(f"the image has several outputs for {what}: {', '.join(known)}; pass {what}=")
        if name is None and not required:
            return None
    if name not in there:
        wanted = f"called {name!r}" if name else "for it"
        have = ", ".join(sorted({n for n, _ in outputs})) or "nothing but colour"
        raise ImageError(f"the image has no {what} ({kind}) output {wanted}; it has: {have}")
    return np.stack(outputs[name, kind], axis=-1)
