"""G-buffers straight from the scene: no reconstruction filter, no jitter."""

from typing import Any

import drjit as dr
import mitsuba as mi

from gtao.errors import SceneError
from gtao.gbuffer import GBuffer

from .attached import keeping
from .loading import select_sensor
from .primary import PrimaryHits, shoot
from .variant import ensure_variant

__all__ = ["frame_of", "gbuffer"]


def gbuffer(
    scene: Any, sensor: Any = 0, *, normals: str = "shading", albedo: bool = True, guard_px: int = 0
) -> GBuffer:
    """Depth, normals and albedo at the pixel centres of one sensor.

    Args:
        scene: ``mitsuba.Scene``; see :func:`gtao.render.load_scene`.
        sensor: index of the sensor, or a ``mitsuba.Sensor``.
        normals: "shading" (interpolated vertex normals, bump and normal maps excepted) or "geometric". Either
            is flipped towards the camera.
        albedo: also evaluate the diffuse reflectance.
        guard_px: pixels more on every side than the sensor has: the surroundings that estimators otherwise lack at
            the edge of the frame. Within the frame nothing changes, and ``g.crop(guard_px, guard_px, width, height)``
            is the sensor's own frame; the same window of a result is its result.

    Returns:
        ``gtao.GBuffer``: ``view_z`` (H, W) in scene units, inf on the background; ``normal_v`` (H, W, 3)
        unit, view frame; ``albedo`` (H, W, 3) in [0, 1], linear sRGB, 0 on the background and where the BSDF
        has no diffuse part; ``view_to_world``, where the sensor stands, as plain numbers.

    Derivatives with respect to parameters of the scene that carry gradients (``mitsuba.traverse``; vertices,
    transforms, reflectances, the sensor's place, field of view and principal point) stay attached, those of the camera
    too. They are those of the point where a pixel's ray meets its surface (theory, eq. (95)). That a silhouette moves
    over a pixel has no derivative.

    Raises:
        SceneError: no such sensor, a sensor that is neither perspective nor orthographic, or albedo asked of
            a spectral or polarised variant.
        ConfigError: ``normals`` is neither of the two, or a guard band that makes no sense (see
            :meth:`gtao.PerspectiveCamera.padded`).
        BackendError: there is no usable backend.
    """
    ensure_variant()
    return frame_of(scene, shoot(scene, select_sensor(scene, sensor), normals, guard_px), albedo)


def frame_of(scene: Any, hits: PrimaryHits, albedo: bool) -> GBuffer:
    """What the camera sees, as a frame."""
    normal_v = dr.select(hits.valid, hits.normal_v, mi.Vector3f(0, 0, 1))
    height, width = hits.camera.shape
    return GBuffer(
        mi.TensorXf(keeping(scene, hits.view_z), (height, width)),
        mi.TensorXf(keeping(scene, dr.ravel(normal_v)), (height, width, 3)),
        hits.attached_camera,
        albedo=mi.TensorXf(keeping(scene, dr.ravel(_albedo(hits))), (height, width, 3)) if albedo else None,
        view_to_world=hits.view_to_world,
    )


def _albedo(hits: PrimaryHits) -> Any:
    if mi.is_spectral or mi.is_polarized:
        raise SceneError(f"albedo needs an rgb or mono variant, not {mi.variant()}; pass albedo=False")
    bsdf = hits.si.bsdf()
    # Without a diffuse lobe Mitsuba answers with the specular peak, which is no albedo.
    diffuse = hits.valid & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Diffuse)
    value = bsdf.eval_diffuse_reflectance(hits.si, diffuse)
    value = mi.Color3f(value[0]) if mi.is_monochromatic else mi.Color3f(value)
    return dr.select(diffuse, dr.clip(value, 0, 1), 0)
