"""Image-space horizon-based ambient occlusion, written out from its sketch (Bavoil et al. 2008), float64 NumPy.

One pixel, one direction and one sample at a time, with the angles and arc tangents of the sketch.
"""

import numpy as np

from . import slice_march
from .fields import Field


def visibility(
    field: Field,
    row: int,
    column: int,
    *,
    radius: float,
    n_directions: int,
    n_steps: int,
    attenuation: str,
    zenith: str = "optical_axis",
    measure: str = "screen",
    rotation: float = 0.5,
    offsets=None,
) -> float:
    """1 - (1/N_d) Σ_θ (sin h - sin t) W of one pixel.

    Args:
        radius: R in scene units; inf searches to the frame's border.
        attenuation: "sample": W = max(0, 1 - r/R) of every sample that raises the horizon, for the part by which it
            does; "horizon": W of the sample at the horizon, for the whole; "none": 1.
        zenith: elevations are measured from the plane orthogonal to the "view" vector or to the "optical_axis".
        measure: directions spaced evenly in the image ("screen") or about the view vector ("view").
        rotation: shift of the directions, as a share of their spacing.
        offsets: η of each pair of opposite directions; 0.5 if left out.
    """
    P, N = slice_march.point(field, row, column), field.normal_v[row, column]
    Z = slice_march.view_dir(field, row, column) if zenith == "view" else np.array([0.0, 0.0, 1.0])
    pairs = n_directions // 2
    blocked = 0.0
    for k in range(n_directions):
        texels, direction = slice_march.texels(
            field,
            row,
            column,
            2 * np.pi * (k + rotation) / n_directions,
            radius=radius,
            n_steps=n_steps,
            eta=0.5 if offsets is None else offsets[k % pairs],
            measure=measure,
        )
        t = _elevation(_on_tangent_plane(field, row, column, direction, P, N) - P, Z)
        offsets_v = [slice_march.point(field, *texel) - P for texel in texels if np.isfinite(field.view_z[texel])]
        blocked += _one_direction(t, offsets_v, Z, radius, attenuation)
    return 1.0 - blocked / n_directions


def _one_direction(t, offsets, Z, radius, attenuation) -> float:
    h, single, per_sample = t, 0.0, 0.0
    for D in offsets:
        r, alpha = np.linalg.norm(D), _elevation(D, Z)
        if r > radius or alpha <= h:
            continue
        W = 1.0 if attenuation == "none" else max(0.0, 1 - r / radius)
        per_sample += (np.sin(alpha) - np.sin(h)) * W
        h = alpha
        single = (np.sin(h) - np.sin(t)) * W
    return single if attenuation == "horizon" else per_sample


def _elevation(D, Z) -> float:
    """Angle of D above the plane orthogonal to Z."""
    rise = D @ Z
    return np.arctan2(rise, np.linalg.norm(D - rise * Z))


def _on_tangent_plane(field, row, column, direction, P, N) -> np.ndarray:
    """Where the eye ray a tenth of a pixel ahead meets the tangent plane."""
    origin, ray = slice_march.eye_ray(field, row + 0.1 * direction[1], column + 0.1 * direction[0])
    return origin + ray * ((P - origin) @ N) / (ray @ N)
