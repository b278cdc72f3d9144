"""From oracle fields to G-buffers, and the estimator's image back to float64 NumPy."""

import numpy as np
from oracles.fields import Field

import gtao


def frame(field, dtype=np.float32, normals=True):
    """G-buffer of an oracle field; ``normals=False`` lets gtao derive them."""
    camera = gtao.OrthographicCamera if field.orthographic else gtao.PerspectiveCamera
    normal_v = field.normal_v.astype(dtype) if normals else None
    return gtao.GBuffer(field.view_z.astype(dtype), normal_v, camera(**field.camera))


def occlusion(field, *, dtype=np.float32, frame_index=0, **options) -> np.ndarray:
    """Visibility (H, W) of an oracle field; the options are those of ``gtao.GTAO``."""
    result = gtao.ambient_occlusion(frame(field, dtype), gtao.GTAO(**options), frame_index=frame_index)
    return np.asarray(result.visibility, dtype=np.float64)


def image(field, method, dtype=np.float64, frame_index=0, layers=None) -> np.ndarray:
    """Visibility (H, W) of an oracle field by any method, with depth layers if they are given as (front, back)."""
    g = frame(field, dtype)
    if layers is not None:
        g = gtao.GBuffer(g.view_z, g.normal_v, g.camera, layers=gtao.DepthLayers(*layers))
    result = gtao.ambient_occlusion(g, method, frame_index=frame_index)
    return np.asarray(result.visibility, dtype=np.float64)


def holed(field):
    """The field with some background in it."""
    view_z = field.view_z.copy()
    view_z[10:14, 18:27] = np.inf
    return Field(view_z, field.normal_v, field.camera, field.orthographic)


def pixels(field, n=8, seed=6) -> np.ndarray:
    """Rows and columns of random pixels that show a surface."""
    surface = np.argwhere(np.isfinite(field.view_z))
    return surface[np.random.default_rng(seed).choice(len(surface), n, replace=False)]
