"""Rotations and reflections of spherical harmonics, of any order, by exact projection of the rotated basis."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gtao.errors import ConfigError

from ._checks import as_coefficients, as_order, as_orthogonal
from .basis import basis
from .quadrature import sphere_nodes

__all__ = ["axes", "rotate", "rotation_matrix", "to_view"]


def rotation_matrix(rotation: ArrayLike, order: int) -> np.ndarray:
    """The matrix that turns coefficients along with the function that they describe; theory, eq. (99).

    Args:
        rotation: 3x3 rotation or reflection (or 4x4, whose translation is ignored), new direction = R · old.
        order: highest band.

    Returns:
        (n, n) orthogonal, block-diagonal by bands.

    Raises:
        ShapeError: the matrix is neither 3x3 nor 4x4.
        ConfigError: it is not orthogonal, or the order not an integer of at least 0.
    """
    r, order = as_orthogonal("rotation", rotation), as_order(order)
    directions, weights = sphere_nodes(2 * order)
    new, old = basis(directions, order) * weights[:, None], basis(directions @ r, order)
    out = np.zeros((new.shape[1], new.shape[1]))
    for band in range(order + 1):
        own = slice(band**2, (band + 1) ** 2)
        out[own, own] = new[:, own].T @ old[:, own]
    return out


def rotate(sh: ArrayLike, rotation: ArrayLike) -> np.ndarray:
    """Coefficients of the rotated function f'(R ω) = f(ω).

    Args:
        sh: (n,) or (n, C) coefficients.
        rotation: 3x3 rotation or reflection (or 4x4, whose translation is ignored), new direction = R · old.

    Returns:
        Coefficients shaped like ``sh``.

    Raises:
        ShapeError: the coefficients or the matrix have a wrong shape.
        ConfigError: the matrix is not orthogonal.
    """
    c, order = as_coefficients(sh)
    return rotation_matrix(rotation, order) @ c


def to_view(sh: ArrayLike, view_to_world: Any) -> np.ndarray:
    """World-frame coefficients in the view frame of a camera: +x right, +y up, looking along -z.

    Args:
        sh: (n,) or (n, C) coefficients, world frame.
        view_to_world: 4x4 or 3x3, view frame to world, as ``gtao.render.view_to_world`` gives it.

    Returns:
        Coefficients shaped like ``sh``.

    Raises:
        ShapeError: the coefficients or the matrix have a wrong shape.
        ConfigError: the matrix has scale or shear.
    """
    return rotate(sh, as_orthogonal("view_to_world", view_to_world).T)


def axes(text: str) -> np.ndarray:
    """The 3x3 matrix of a change of axes in words: ``axes("x z -y")`` has new x = old x, new y = old z, new z = -old y.

    ``rotate(sh, axes(…))`` then speaks of directions in the new axes: ``axes("x z -y")`` from z up to y up, both
    right-handed; ``axes("x y -z")`` from a left-handed frame to a right-handed one.

    Raises:
        ConfigError: the text does not name each of x, y and z once.
    """
    names = text.split()
    bare = [name.lstrip("+-") for name in names]
    if sorted(bare) != ["x", "y", "z"] or any(len(name) > 2 for name in names):
        raise ConfigError(f"axes must name x, y and z once each, like 'x z -y', got {text!r}")
    out = np.zeros((3, 3))
    for row, (name, axis) in enumerate(zip(names, bare, strict=True)):
        out[row, "xyz".index(axis)] = -1.0 if name[0] == "-" else 1.0
    return out
