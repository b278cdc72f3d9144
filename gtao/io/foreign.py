"""Depth and normals as other programs store them, turned into ours: view_z and unit view-frame normals."""

from typing import Any

import numpy as np

from gtao import backend
from gtao.camera import OrthographicCamera, PerspectiveCamera
from gtao.errors import ConfigError, ImageError, ShapeError
from gtao.gbuffer import ROUNDING, GBuffer

from .channels import Found

__all__ = [
    "check_agreement",
    "is_world",
    "looks_unit",
    "rotation_of",
    "to_view_z",
    "turn_to_camera",
    "unit_normals",
]

#: Blender writes this where nothing is hit; no scene is that deep.
BACKGROUND_FROM = 1e10
#: An average of unit vectors is never longer than 1; half floats and lossy compression add up to this much.
LONGEST_NORMAL = 1.02
#: Below it the direction of an averaged normal is only rounding.
SHORTEST_NORMAL = 1e-2
#: Averaging shortens normals at edges. If they are shorter than this in the median, they are something else.
MEDIAN_NORMAL = 0.8
#: Median cosine between stored and depth-derived normals. Right buffers reach 0.95 and more, thin rigging
#: too; transposed matrices, swapped axes and cameras that look along +z give less than 0.7 or go negative.
LEAST_AGREEMENT = 0.75
#: Camera frames of other programs, as signs of x, y, z. Floors fit several of them, hence their own test.
OTHER_FRAMES = {"along +z with +y up": (-1, 1, -1), "along +z with +y down": (1, -1, -1)}
#: Mean |cosine| that another frame must win by. A right frame always wins against these.
CLEARLY_BETTER = 0.05


def rotation_of(to_view: Any) -> np.ndarray:
    """The 3x3 rotation of a world-to-view matrix (3x3 or 4x4).

    Raises:
        ConfigError: it has another shape, is not finite, scales or mirrors.
    """
    try:
        matrix = np.asarray(to_view, dtype=np.float64)
    except (TypeError, ValueError):
        raise ConfigError("to_view must be a 3x3 or 4x4 matrix of numbers") from None
    if matrix.shape not in ((3, 3), (4, 4)) or not np.isfinite(matrix).all():
        raise ConfigError(f"to_view must be a finite 3x3 or 4x4 matrix, got shape {matrix.shape}")
    rotation = matrix[:3, :3]
    # 1e-3 leaves room for matrices written with four decimals.
    if np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-3 or np.linalg.det(rotation) < 0:
        raise ConfigError("to_view must be a rotation from world to view frame, without scale or mirror")
    return rotation


def to_view_z(
    path: Any, stored: np.ndarray, found: Found, kind: str, camera: PerspectiveCamera | OrthographicCamera
) -> np.ndarray:
    """Stored depth (H, W) to float32 view_z with an infinite background.

    Args:
        path: the file, for errors.
        stored: depth; 0, 1e10 and more, and infinity are background.
        found: what the channel names say.
        kind: "auto", "view_z" or "ray_t", see :func:`gtao.io.read_gbuffer`.
        camera: the camera of these pixels.

    Raises:
        ImageError: the distance starts on a near plane that the camera does not know.
    """
    distance = np.asarray(stored, dtype=np.float32)
    distance = np.where((distance == 0) | (distance >= BACKGROUND_FROM), np.float32(np.inf), distance)
    if kind == "view_z" or (kind == "auto" and not found.ray_t):
        return distance
    if kind == "auto" and camera.near == 0:
        raise ImageError(
            f"channel {found.depth} of {path} is measured from the near plane; give the camera its near="
            " (Mitsuba's near_clip, 0.01 unless set), or depth='ray_t' if it is 0"
        )
    Float = backend.default_float()
    y, x = np.indices(camera.shape, dtype=np.float32).reshape(2, -1) + np.float32(0.5)
    z = camera.view_z_from_ray_t(Float(x), Float(y), Float(distance.ravel()), from_near=found.ray_t)
    return z.numpy().reshape(camera.shape)


def looks_unit(n: np.ndarray) -> bool:
    """Whether vectors (H, W, 3) are unit vectors, or pixel averages of such, wherever they are not zero."""
    length = np.linalg.norm(n, axis=-1)
    length = length[length > 0]
    return length.size > 0 and bool(length.max() <= LONGEST_NORMAL and np.median(length) >= MEDIAN_NORMAL)


def unit_normals(path: Any, n: np.ndarray, surface: np.ndarray, layer: str) -> np.ndarray:
    """``n`` (H, W, 3) with unit length on the surface and zero elsewhere; pixel averages are stretched.

    Unit vectors keep their bits, so that a file that is read and written again does not drift.

    Raises:
        ShapeError: these are not normals: not finite, too long, too short in the median, or zero somewhere.
    """
    length = np.linalg.norm(n, axis=-1)
    on_surface = length[surface]
    if not np.isfinite(on_surface).all():
        n_bad = int((~np.isfinite(on_surface)).sum())
        raise ShapeError(f"normals {layer} of {path} are not finite at {n_bad} surface pixels; repair the image")
    if on_surface.size and (on_surface.max() > LONGEST_NORMAL or np.median(on_surface) < MEDIAN_NORMAL):
        raise ShapeError(
            f"{layer} of {path} does not hold unit normals (lengths {on_surface.min():.3g} to"
            f" {on_surface.max():.3g}); undo an encoding like n/2 + 1/2, or choose with normal_layer"
        )
    if (on_surface < SHORTEST_NORMAL).any():
        n_bad = int((on_surface < SHORTEST_NORMAL).sum())
        raise ShapeError(f"normals {layer} of {path} vanish at {n_bad} surface pixels; use normals='derive'")
    stretched = surface & (np.abs(length - 1) > ROUNDING)
    return np.where(surface[..., None], n / np.where(stretched, length, 1)[..., None], np.float32(0))


def is_world(path: Any, layer: str, stated: bool | None, frame: str, to_view: Any) -> bool:
    """Whether normals are in world space.

    Args:
        path: the file, for errors.
        layer: the layer of the normals, for errors.
        stated: what the file says, None if nothing.
        frame: "view" or "world", or "auto" to believe the file and, if it is silent, ``to_view`` being there.
        to_view: the matrix that world-space normals need.

    Raises:
        ImageError: nothing tells, or the matrix is missing.
    """
    world = {"view": False, "world": True, "auto": stated}[frame]
    if world is None and to_view is not None:
        world = True
    if world is None:
        raise ImageError(
            f"{path} does not say whether its normals {layer} are in view or world space; give"
            " normal_frame='view', or 'world' and to_view (--normal-frame and the to_view of the --camera file)"
        )
    if world and to_view is None:
        raise ImageError(
            f"normals {layer} of {path} are in world space; give to_view (3x3 or 4x4, world to view; a key of the"
            " --camera file), normal_frame='view' (--normal-frame) if they are not, or normals='derive'"
            " (--derive-normals)"
        )
    return world


def turn_to_camera(n: np.ndarray, plain: GBuffer) -> np.ndarray:
    """Turn the normals (H, W, 3) that point away from the camera: renderers see both sides of a surface."""
    toward = -plain.position_v.numpy()
    if plain.camera.is_orthographic:
        toward = np.array([0, 0, 1], dtype=np.float32)
    return np.where((n * toward).sum(-1, keepdims=True) < 0, -n, n)


def check_agreement(path: Any, n: np.ndarray, plain: GBuffer) -> None:
    """Compare normals with those derived from depth: in a wrong frame they look valid, and only depth knows.

    Raises:
        ShapeError: they contradict each other.
    """
    surface = plain.mask.numpy()
    if not surface.any():
        return
    products = (n * plain.normal_v.numpy())[surface]
    agreement = float(np.median(products.sum(-1)))
    mean = np.abs(products.sum(-1)).mean()
    for camera, signs in OTHER_FRAMES.items():
        if np.abs(products @ np.array(signs, dtype=np.float32)).mean() > mean + CLEARLY_BETTER:
            raise ShapeError(
                f"the normals of {path} would fit its depth with diag{signs} @ to_view: that camera looks {camera},"
                " ours along -z with +y up"
            )
    if agreement < LEAST_AGREEMENT:
        raise ShapeError(
            f"the normals of {path} contradict its depth (median cosine {agreement:.2f}); check to_view"
            " (world to view, +y up, the camera looking along -z), normal_frame and the camera, or use"
            " normals='derive'"
        )
