"""From oracle fields to G-buffers, and the estimator's image back to float64 NumPy."""

import numpy as np

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
