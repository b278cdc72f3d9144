"""Windows against ringing: factors per band that trade sharpness for lobes without negative neighbours.

References:
    P.-P. Sloan, "Stupid Spherical Harmonics (SH) Tricks", Game Developers Conference 2008.
    P.-P. Sloan, "Deringing Spherical Harmonics", SIGGRAPH Asia Technical Briefs 2017.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gtao.errors import ConfigError, ShapeError

from ._checks import as_coefficients, as_order, as_positive
from .basis import basis
from .quadrature import sphere_nodes

__all__ = ["WINDOWS", "minimum", "non_negative", "window", "window_factors"]

WINDOWS = ("hanning", "lanczos", "gauss", "laplacian")

#: Halvings of the interval of widths: to a millionth of it.
N_HALVINGS = 20
#: Refinements about the lowest grid points; each narrows the neighbourhood to a third.
N_REFINEMENTS, N_STARTS = 14, 4


def window_factors(kind: str, order: int, width: float) -> np.ndarray:
    """Factors of the bands 0 … order; theory, eq. (107).

    Args:
        kind: "hanning", "lanczos": zero from band ``width`` on. "gauss": a blur by the heat kernel, whose standard
            deviation is about 1/width radians along each axis. "laplacian": the least-squares fit with a penalty on the
            squared Laplacian, which halves the band with l (l + 1) = width².
        order: highest band.
        width: the window's width in bands, positive.

    Returns:
        (order + 1,) factors in [0, 1]; the first is 1.

    Raises:
        ConfigError: the kind is unknown, or the order or width out of range.
    """
    band, width = np.arange(as_order(order) + 1.0), as_positive("width", width)
    if kind == "hanning":
        return np.where(band < width, (1 + np.cos(math.pi * band / width)) / 2, 0)
    if kind == "lanczos":
        return np.where(band < width, np.sinc(band / width), 0)
    if kind == "gauss":
        return np.exp(-band * (band + 1) / (2 * width**2))
    if kind == "laplacian":
        return 1 / (1 + (band * (band + 1) / width**2) ** 2)
    raise ConfigError(f"kind must be one of {', '.join(WINDOWS)}, got {kind!r}")


def window(sh: ArrayLike, kind: str = "hanning", width: float | None = None) -> np.ndarray:
    """Coefficients times a window.

    Args:
        sh: (n,) or (n, C) coefficients.
        kind: "hanning", "lanczos", "gauss" or "laplacian", see :func:`window_factors`.
        width: the window's width in bands, positive; order + 1 if left out.

    Returns:
        Coefficients shaped like ``sh``; their mean over the sphere is kept.

    Raises:
        ConfigError: the kind is unknown or the width not positive.
        ShapeError: the coefficients have a wrong shape or are not finite.
    """
    c, order = as_coefficients(sh)
    factors = window_factors(kind, order, order + 1 if width is None else width)
    per_coefficient = np.repeat(factors, 2 * np.arange(order + 1) + 1)
    return c * per_coefficient.reshape(-1, *[1] * (c.ndim - 1))


def minimum(sh: ArrayLike) -> Any:
    """The lowest value that the function of the coefficients takes anywhere on the sphere.

    Args:
        sh: (n,) or (n, C) coefficients.

    Returns:
        A float, or (C,).

    Raises:
        ShapeError: the coefficients have a wrong shape or are not finite.
    """
    c, order = as_coefficients(sh)
    lowest = [_minimum(column, order) for column in c.reshape(len(c), -1).T]
    return lowest[0] if c.ndim == 1 else np.array(lowest)


def _minimum(c: np.ndarray, order: int) -> float:
    degree = 8 * (order + 1)
    directions, _ = sphere_nodes(degree)
    values = basis(directions, order) @ c
    starts = directions[np.argsort(values)[:N_STARTS]]
    best, reach = float(values.min()), 2 * math.pi / degree
    steps = np.linspace(-1, 1, 7)
    u, v = (a.reshape(-1, 1) for a in np.meshgrid(steps, steps))
    for _ in range(N_REFINEMENTS):
        moved = []
        for d in starts:
            s = np.cross(d, np.eye(3)[np.argmin(np.abs(d))])
            s /= np.linalg.norm(s)
            near = d + reach * (u * s + v * np.cross(d, s))
            around = basis(near, order) @ c
            moved.append(near[np.argmin(around)] / np.linalg.norm(near[np.argmin(around)]))
            best = min(best, float(around.min()))
        starts, reach = np.array(moved), reach / 3
    return best


def non_negative(sh: ArrayLike, kind: str = "laplacian") -> tuple[np.ndarray, float]:
    """The widest window that leaves no negative value anywhere, the same for all channels.

    Args:
        sh: (n,) or (n, C) coefficients.
        kind: "hanning", "lanczos", "gauss" or "laplacian", see :func:`window_factors`.

    Returns:
        The windowed coefficients, and the window's width: ``inf`` where none was needed.

    Raises:
        ConfigError: the kind is unknown.
        ShapeError: a channel's mean is negative, so that no window helps; or the coefficients have a wrong shape or are
            not finite.
    """
    c, _ = as_coefficients(sh)
    if kind not in WINDOWS:
        raise ConfigError(f"kind must be one of {', '.join(WINDOWS)}, got {kind!r}")
    if (c[0] < 0).any():
        raise ShapeError("the mean over the sphere, the first coefficient, must not be negative: no window can help")
    if np.all(np.asarray(minimum(c)) >= 0):
        return c, math.inf
    # In 1/width: 0 is no window, 16 leaves of band 1 less than 1e-4 in all kinds.
    open_, closed = 0.0, 16.0
    for _ in range(N_HALVINGS):
        middle = (open_ + closed) / 2
        if np.all(np.asarray(minimum(window(c, kind, 1 / middle))) >= 0):
            closed = middle
        else:
            open_ = middle
    return window(c, kind, 1 / closed), 1 / closed
