"""Where the samples of a slice method lie, point by point, float64 NumPy.

A direction's samples lie at 1 + (ℓ - 1)((j + η)/n)^p pixels, j = 0 … n - 1, each moved to the centre of its texel; ℓ is
the projected radius or what the frame leaves of it.
"""

import numpy as np

from . import slice_oracle
from .fields import Field


def eye_ray(field: Field, row, column):
    """Origin and direction with view depth 1 of the ray through a point of the image (texel centres at integers)."""
    fx, fy = field.scale
    x, y = (column + 0.5 - field.camera["cx"]) / fx, -(row + 0.5 - field.camera["cy"]) / fy
    if field.orthographic:
        return np.array([x, y, 0.0]), np.array([0.0, 0.0, -1.0])
    return np.zeros(3), np.array([x, y, -1.0])


def point(field: Field, row, column, view_z=None) -> np.ndarray:
    """The surface point of a texel, or the one at another depth on its eye ray."""
    origin, ray = eye_ray(field, row, column)
    return origin + (field.view_z[row, column] if view_z is None else view_z) * ray


def view_dir(field: Field, row, column) -> np.ndarray:
    return -slice_oracle.unit(eye_ray(field, row, column)[1])


def texels(field: Field, row, column, phi, *, radius, n_steps, eta=0.5, exponent=1.0, measure="view"):
    """Rows and columns of the samples in direction ``phi``, nearest first, and the direction in pixels (y down).

    Args:
        phi: azimuth about the view vector (measure "view") or in the image plane ("screen").
        radius: in scene units; inf for the border of the frame.
    """
    direction, reach = _segment(field, point(field, row, column), view_dir(field, row, column), phi, radius, measure)
    reach = min(reach, _to_border(field, row, column, direction))
    if reach < 1:
        return [], direction
    distances = 1 + (reach - 1) * ((np.arange(n_steps) + eta) / n_steps) ** exponent
    return [(round(row + d * direction[1]), round(column + d * direction[0])) for d in distances], direction


def _segment(field, P, V, phi, radius, measure):
    """Unit pixel direction of an azimuth, and the length in pixels of the radius along it."""
    fx, fy = field.scale
    if measure == "screen":
        direction = np.array([fx * np.cos(phi), -fy * np.sin(phi)])
        length = np.linalg.norm(direction)
        return direction / length, length * (radius if field.orthographic else radius / -P[2])
    T = slice_oracle.tangent(V, phi)
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
    lengths = [
        (size - 1 + 0.499 - at) / d if d > 0 else (at + 0.499) / -d
        for d, at, size in ((direction[0], column, width), (direction[1], row, height))
        if d != 0
    ]
    return float(min(lengths))
