"""Image-space horizon-based ambient occlusion, written out from its sketch (Bavoil et al. 2008), float64 NumPy.

One pixel, one direction and one sample at a time, with the angles and arc tangents of the sketch. What it leaves open
is chosen as in the package: a direction's samples lie at 1 + (ℓ - 1)(j + η)/n pixels, ℓ being the projected radius or
what the frame leaves of it.
"""

import numpy as np

from . import slice_oracle
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
    P, N = _point(field, row, column), field.normal_v[row, column]
    V = -_eye_ray(field, row, column)[1]
    V /= np.linalg.norm(V)
    Z = V if zenith == "view" else np.array([0.0, 0.0, 1.0])
    pairs = n_directions // 2
    blocked = 0.0
    for k in range(n_directions):
        theta = 2 * np.pi * (k + rotation) / n_directions
        direction, reach = _segment(field, P, V, theta, radius, measure)
        reach = min(reach, _to_border(field, row, column, direction))
        eta = 0.5 if offsets is None else offsets[k % pairs]
        blocked += _one_direction(field, (row, column), direction, reach, P, N, Z, radius, n_steps, eta, attenuation)
    return 1.0 - blocked / n_directions


def _one_direction(field, pixel, direction, reach, P, N, Z, radius, n_steps, eta, attenuation) -> float:
    row, column = pixel
    t = _elevation(_on_tangent_plane(field, row, column, direction, P, N) - P, Z)
    if reach < 1:
        return 0.0
    h, single, per_sample = t, 0.0, 0.0
    for j in range(n_steps):
        distance = 1 + (reach - 1) * (j + eta) / n_steps
        x, y = round(column + distance * direction[0]), round(row + distance * direction[1])
        if not np.isfinite(field.view_z[y, x]):
            continue
        D = _point(field, y, x) - P
        r = np.linalg.norm(D)
        alpha = _elevation(D, Z)
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
    origin, ray = _eye_ray(field, row + 0.1 * direction[1], column + 0.1 * direction[0])
    return origin + ray * ((P - origin) @ N) / (ray @ N)


def _point(field, row, column) -> np.ndarray:
    origin, ray = _eye_ray(field, row, column)
    return origin + field.view_z[row, column] * ray


def _eye_ray(field, row, column):
    """Origin and direction with view depth 1 of the ray through a point of the image."""
    fx, fy = field.scale
    x, y = (column + 0.5 - field.camera["cx"]) / fx, -(row + 0.5 - field.camera["cy"]) / fy
    if field.orthographic:
        return np.array([x, y, 0.0]), np.array([0.0, 0.0, -1.0])
    return np.zeros(3), np.array([x, y, -1.0])


def _segment(field, P, V, theta, radius, measure):
    """Unit pixel direction (y down) of azimuth θ, and the length in pixels of the radius along it."""
    fx, fy = field.scale
    if measure == "screen":
        direction = np.array([fx * np.cos(theta), -fy * np.sin(theta)])
        length = np.linalg.norm(direction)
        return direction / length, length * (radius if field.orthographic else radius / -P[2])
    T = slice_oracle.tangent(V, theta)
    if field.orthographic:
        direction = np.array([fx * T[0], -fy * T[1]])
        length = np.linalg.norm(direction)
        return direction / length, length * radius
    direction = slice_oracle.unit([1.0, -1.0] * slice_oracle.screen_direction(P, T, (fx, fy)))
    # The eye ray that touches the sphere about P on this side.
    sine = radius / np.linalg.norm(P)
    if sine >= 1:
        return direction, np.inf
    touching = sine * T - np.sqrt(1 - sine * sine) * V
    if touching[2] >= 0:
        return direction, np.inf
    away = slice_oracle.project(touching, (fx, fy)) - slice_oracle.project(P, (fx, fy))
    return direction, float(np.linalg.norm(away))


def _to_border(field, row, column, direction) -> float:
    """Length to the border of the frame, a thousandth of a pixel inside of it."""
    height, width = field.view_z.shape
    with np.errstate(divide="ignore"):
        x, y = (
            np.where(d > 0, (size - 1 + 0.499 - at) / d, (at + 0.499) / -d)
            for d, at, size in ((direction[0], column, width), (direction[1], row, height))
        )
    return float(min(np.inf if np.isnan(x) else x, np.inf if np.isnan(y) else y))
