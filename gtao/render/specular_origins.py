"""Where glossy reflections of a view begin: surface points, how they are seen, and how rough they are."""

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from gtao.errors import ShapeError
from gtao.kernels.shaded_point import edge_on

from .primary import PrimaryHits
from .sensor import pixel_centre_rays
from .walk import Origins

__all__ = ["Seen", "roughness_image", "seen"]


@dataclass
class Seen(Origins):
    """Start points with what their reflection depends on.

    Attributes:
        wo: unit vector to the viewer, in the frame of the normal.
        alpha: microfacet width.
        uv: texture coordinates.
        along: vector in the surface along which u changes, not of unit length; 0 where there is none.
    """

    wo: Any
    alpha: Any
    uv: Any
    along: Any

    @property
    def frame(self) -> Any:
        """Frame of the normal."""
        return mi.Frame3f(self.normal)

    @property
    def textured_frame(self) -> Any:
        """Frame of the normal whose first axis follows u, as that of anisotropic materials."""
        across = self.along - dr.dot(self.along, self.normal) * self.normal
        along = dr.select(dr.squared_norm(across) > 0, dr.normalize(across), self.frame.s)
        return mi.Frame3f(along, dr.cross(self.normal, along), self.normal)


def seen(hits: PrimaryHits, start: Origins, roughness: np.ndarray) -> Seen:
    """The start points with normals that are seen edge-on at most, and the roughness of their pixels, (H, W)."""
    if not len(start):
        return Seen(**vars(start), wo=mi.Vector3f(), alpha=mi.Float(), uv=mi.Point2f(), along=mi.Vector3f())
    pixels = math.prod(hits.camera.shape)
    towards = -pixel_centre_rays(hits.sensor).d + dr.zeros(mi.Vector3f, pixels)
    view = dr.gather(mi.Vector3f, towards, start.pixel)
    normal = mi.Normal3f(*edge_on(tuple(start.normal), tuple(view))[0])
    width = dr.square(mi.Float(np.ascontiguousarray(np.broadcast_to(roughness, hits.camera.shape).ravel())))
    points = Seen(
        **{**vars(start), "normal": normal},
        wo=mi.Frame3f(normal).to_local(view),
        alpha=dr.gather(mi.Float, width, start.pixel),
        uv=dr.gather(mi.Point2f, hits.si.uv, start.pixel),
        along=dr.gather(mi.Vector3f, hits.si.dp_du, start.pixel),
    )
    dr.eval(vars(points))
    return points


def roughness_image(value: Any, shape: tuple[int, int]) -> np.ndarray:
    """Perceptual roughness as float32, a number or an image.

    Raises:
        ShapeError: it has another shape, or values outside of [0, 1].
    """
    values = np.asarray(value.numpy() if hasattr(value, "numpy") else value)
    if values.dtype.kind not in "fiu" or values.shape not in ((), (1,), shape):
        raise ShapeError(
            f"roughness must be a number or an image of shape {shape}, got shape {values.shape} of {values.dtype}"
        )
    if not np.all((values >= 0) & (values <= 1)):
        raise ShapeError("roughness must be in [0, 1]")
    return values.astype(np.float32)
