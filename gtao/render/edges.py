"""Where one surface ends in front of another."""

from typing import Any

import numpy as np

__all__ = ["depth_edges"]

# A smooth surface leaves its own tangent plane by a fraction of the pixel spacing from one pixel to the next;
# a jump to another surface is seen from both tangent planes as many spacings.
JUMP_PX = 2.0


def depth_edges(hits: Any) -> np.ndarray:
    """(H, W) True where a 4-neighbour is background or lies off both tangent planes by two pixel spacings.

    Creases and tilted planes are no edges: there a neighbour lies on at least one of the two tangent planes.
    """
    camera = hits.camera
    height, width = camera.shape
    view_z = hits.view_z.numpy().reshape(height, width).astype(np.float64)
    surface = np.isfinite(view_z)
    z = np.where(surface, view_z, 1.0)
    scale = np.ones_like(z) if camera.is_orthographic else z
    x = (np.arange(width) + 0.5 - camera.cx) / camera.fx
    y = (camera.cy - np.arange(height) - 0.5) / camera.fy
    P = np.stack([x[None, :] * scale, y[:, None] * scale, -z], axis=-1)
    n = hits.normal_v.numpy().T.reshape(height, width, 3).astype(np.float64)
    spacing = scale / min(camera.fx, camera.fy)

    edge = np.zeros((height, width), dtype=bool)
    for axis in (0, 1):
        here = [slice(None), slice(None)]
        there = [slice(None), slice(None)]
        here[axis], there[axis] = slice(None, -1), slice(1, None)
        a, b = tuple(here), tuple(there)
        step = P[b] - P[a]
        off = np.minimum(np.abs((n[a] * step).sum(-1)), np.abs((n[b] * step).sum(-1)))
        jump = surface[a] & surface[b] & (off > JUMP_PX * np.minimum(spacing[a], spacing[b]))
        jump |= surface[a] != surface[b]
        edge[a] |= jump
        edge[b] |= jump
    return edge & surface
