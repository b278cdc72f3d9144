"""What the camera sees: the surface behind every pixel centre, in world space."""

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from gtao.errors import ConfigError, SceneError
from gtao.tensors import scalar

from .attached import attached_camera, rotation_to_view
from .sensor import camera_from_sensor, pixel_centre_rays, rotation

__all__ = ["PrimaryHits", "facing_normal", "match_gbuffer", "shoot"]

NORMALS = ("shading", "geometric")

# A buffer counts as one of this view when its depth agrees to RELATIVE_DEPTH at all but a share MISMATCHES of
# the pixels: half-float files lose 5e-4 of the depth, and jittered ones are off at silhouettes only.
RELATIVE_DEPTH = 0.02
MISMATCHES = 0.1


def check_normals(normals: str) -> None:
    if normals not in NORMALS:
        raise ConfigError(f"normals must be one of {', '.join(NORMALS)}, got {normals!r}")


def ray_flags(normals: str) -> int:
    """What an intersection has to compute; derivatives and texture coordinates are never needed."""
    minimal = int(mi.RayFlags.Minimal)
    return minimal | int(mi.RayFlags.ShadingFrame) if normals == "shading" else minimal


def facing_normal(si: Any, direction: Any, normals: str) -> Any:
    """Normal of a hit on the side that the ray came from, as a two-sided BSDF sees it.

    Meshes may carry zero-length vertex normals, which interpolate to NaN; the geometric normal stands in there.
    """
    n = mi.Normal3f(si.n)
    if normals == "shading":
        shading = mi.Normal3f(si.sh_frame.n)
        n = dr.select(dr.squared_norm(shading) > 0.5, shading, n)
    return dr.select(dr.dot(n, direction) > 0, -n, n)


@dataclass
class PrimaryHits:
    """Surfaces at the pixel centres of one sensor; every array has ``width * height`` entries.

    Attributes:
        sensor, camera, view_to_world: as in :func:`gtao.render.camera_from_sensor`.
        attached_camera: the camera with the derivatives of its sensor's numbers.
        si: Mitsuba's surface interaction.
        valid: where there is a surface.
        normal_w: unit world normal of the kind asked for, facing the camera.
        n_geo_w: the geometric one, facing the camera.
        to_view: Matrix3f that takes directions in the world to the view frame.
        view_z: distance along the optical axis, inf where there is no surface.

    What Mitsuba gives derivatives of, geometry and sensor, has them in ``normal_w``, ``n_geo_w``, ``to_view`` and
    ``view_z``: those of the point where the pixel's ray meets the surface.
    """

    sensor: Any
    camera: Any
    attached_camera: Any
    view_to_world: np.ndarray
    si: Any
    valid: Any
    normal_w: Any
    n_geo_w: Any
    to_view: Any
    view_z: Any

    @property
    def normal_v(self) -> Any:
        """Normals in the view frame."""
        return self.to_view @ mi.Vector3f(self.normal_w)


def shoot(scene: Any, sensor: Any, normals: str = "shading", guard_px: int = 0) -> PrimaryHits:
    """Trace the ray through every pixel centre, those of a guard band around the frame included."""
    check_normals(normals)
    camera, view_to_world = camera_from_sensor(sensor)
    camera = camera.padded(guard_px)
    ray = pixel_centre_rays(sensor, guard_px)
    si = scene.ray_intersect(ray, ray_flags=mi.RayFlags.All, coherent=True)
    valid = si.is_valid()
    to_view = rotation_to_view(sensor, view_to_world)
    attached = attached_camera(sensor, camera)
    view_z = scalar(attached.near, mi.Float) - si.t * (to_view @ ray.d).z
    return PrimaryHits(
        sensor=sensor,
        camera=camera,
        attached_camera=attached,
        view_to_world=view_to_world,
        si=si,
        valid=valid,
        normal_w=facing_normal(si, ray.d, normals),
        n_geo_w=facing_normal(si, ray.d, "geometric"),
        to_view=to_view,
        view_z=dr.select(valid, view_z, dr.inf),
    )


def match_gbuffer(hits: PrimaryHits, g: Any) -> tuple[Any, Any]:
    """World normals of a G-buffer and the pixels where both it and the scene have a surface.

    Raises:
        SceneError: the buffer has another size, or its depth is not that of this scene and sensor.
    """
    if g.shape != hits.camera.shape:
        raise SceneError(
            f"the G-buffer is {g.shape[1]}x{g.shape[0]} pixels, the sensor {hits.camera.width}x{hits.camera.height}"
        )
    view_z = np.asarray(g.view_z.numpy(), dtype=np.float32).ravel()
    expected = hits.view_z.numpy()
    surface = np.isfinite(view_z)
    with np.errstate(invalid="ignore"):  # inf - inf where both are background
        agree = np.abs(view_z - expected) <= RELATIVE_DEPTH * expected
    agree = np.where(np.isfinite(expected) & surface, agree, surface == np.isfinite(expected))
    share = 1 - agree.mean()
    if share > MISMATCHES:
        raise SceneError(
            f"the G-buffer is not of this scene and sensor: its depth differs at {share:.0%} of the pixels"
        )
    normal_v = mi.Vector3f(np.ascontiguousarray(g.normal_v.numpy().reshape(-1, 3).T.astype(np.float32)))
    normal_w = mi.Normal3f(rotation(hits.view_to_world) @ normal_v)
    return normal_w, hits.valid & mi.Bool(surface)
