"""The slice search written out directly, for what ray marching cannot define: attenuated and shortened searches.

Float64 NumPy, one pixel at a time: dense positions along each slice, bilinear surface, tangents by rotation, the inner
integral by quadrature. Shares the definition of a slice with the estimator and nothing else.
"""

import numpy as np

from . import slice_oracle
from .fields import Field


def visibility(field: Field, row: int, column: int, *, weight=None, max_px=np.inf, n_slices=32, step_px=0.02) -> float:
    """Cosine-weighted visibility of one pixel from equispaced slices at azimuths π(i + ½)/n about the view direction.

    Args:
        weight: distance -> weight in [0, 1] of a sample; its horizon cosine moves from the tangent plane of its side
            (weight 0) to its own (weight 1). None is weight 1.
        max_px: length of the search in pixels. It starts one pixel out and ends inside of the frame.
        step_px: spacing of the samples.
    """
    P = field.positions()[row, column]
    V = field.view_dirs()[row, column]
    N = field.normal_v[row, column]
    total = 0.0
    for i in range(n_slices):
        T = slice_oracle.tangent(V, np.pi * (i + 0.5) / n_slices)
        nV, nT = N @ V, N @ T
        gamma = np.arctan2(nT, nV)
        horizons = []
        for side in (-1.0, 1.0):
            low = np.cos(gamma + side * np.pi / 2)
            D = _samples(field, row, column, side * _direction(field, P, T), max_px, step_px) - P
            distance = np.linalg.norm(D, axis=1)
            cosine = D @ V / distance
            if weight is not None:
                cosine = low + weight(distance) * (cosine - low)
            horizons.append(side * np.arccos(np.max(cosine, initial=low)))
        total += slice_oracle.clamped_cosine(nV, nT, *horizons)
    return total / n_slices


def _direction(field, P, T) -> np.ndarray:
    """Unit pixel direction (x right, y down) in which the point moves when it follows ``T``."""
    fx, fy = field.scale
    if field.orthographic:
        return slice_oracle.unit([fx * T[0], -fy * T[1]])
    return slice_oracle.unit([1.0, -1.0] * slice_oracle.screen_direction(P, T, (fx, fy)))


def _samples(field, row, column, direction, max_px, step_px) -> np.ndarray:
    """Points of the surface along a pixel direction, from one pixel out to ``max_px`` or the frame's border."""
    height, width = field.view_z.shape
    t = np.arange(1.0, min(max_px, np.hypot(width, height)) + 1e-9, step_px)
    x, y = column + t * direction[0], row + t * direction[1]
    inside = (x > -0.5) & (x < width - 0.5) & (y > -0.5) & (y < height - 0.5)
    x, y = x[inside], y[inside]
    w = field.view_z if field.orthographic else 1 / field.view_z
    x0, y0 = np.clip(np.floor(x).astype(int), 0, width - 2), np.clip(np.floor(y).astype(int), 0, height - 2)
    u, v = x - x0, y - y0
    top = (1 - u) * w[y0, x0] + u * w[y0, x0 + 1]
    bottom = (1 - u) * w[y0 + 1, x0] + u * w[y0 + 1, x0 + 1]
    z = (1 - v) * top + v * bottom
    z = z if field.orthographic else 1 / z
    fx, fy = field.scale
    depth = 1.0 if field.orthographic else z
    X = (x + 0.5 - field.camera["cx"]) / fx * depth
    Y = -(y + 0.5 - field.camera["cy"]) / fy * depth
    return np.stack([X, Y, -z], axis=-1)
