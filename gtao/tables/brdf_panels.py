"""The angle t from the axis of a cone, cut where integrals over rings are not smooth; the scales of nodes there."""

from typing import NamedTuple

import numpy as np

__all__ = ["FIELDS", "Panels", "panels"]

#: Distance of poles, in radians, beyond which they leave no mark on the nodes.
FAR = 3.0
#: Least scale at a cut, in widths of the lobe: what varies over less is a jump at the cut, which does no harm.
LEAST = 1e-1
#: Keeps quotients of nothing finite.
TINY = 1e-300


class Panels(NamedTuple):
    """Stretches of t from ``start`` on over ``length``, which may be negative; nodes crowd towards the start.

    ``owner`` is the index of the cone, ascending; ``from_lobe`` is start - β without rounding; ``scale`` that of nodes.
    """

    owner: np.ndarray
    start: np.ndarray
    from_lobe: np.ndarray
    length: np.ndarray
    scale: np.ndarray


FIELDS = Panels._fields[1:]


def panels(
    alpha_v: np.ndarray, beta: np.ndarray, alpha: np.ndarray, theta_o: np.ndarray, chi: np.ndarray, in_plane: bool
) -> Panels:
    """Those of every cone that have something above the horizon; arguments (n,), widths above 0.

    Args:
        in_plane: every axis lies in the incidence plane.
    """
    cuts, scales, theta_b = _cuts(beta, alpha, theta_o, chi, in_plane)
    ends = np.minimum(cuts, alpha_v[:, None])
    from_lobe = np.where(ends == beta[:, None], 0.0, ends - beta[:, None])
    felt = _felt(ends, cuts, np.maximum(scales, LEAST * alpha[:, None]))
    order = np.argsort(ends, axis=-1, kind="stable")
    ends, from_lobe, felt = (np.take_along_axis(x, order, axis=-1) for x in (ends, from_lobe, felt))
    half = 0.5 * np.diff(ends, axis=-1)
    middle = ends[:, :-1] + half
    live = (half > 0) & (np.abs(middle - theta_b[:, None]) < 0.5 * np.pi)
    owner = np.nonzero(live)[0]
    sides = []
    for side, sign in ((slice(None, -1), 1), (slice(1, None), -1)):
        sides.append([x[live] for x in (ends[:, side], from_lobe[:, side], sign * half, felt[:, side])])
    return Panels(np.repeat(owner, 2), *(np.stack(pair, axis=-1).ravel() for pair in zip(*sides, strict=True)))


def _felt(ends, cuts, scales):
    """A cut is felt everywhere, from as far as its pole in the complex plane."""
    least = np.full_like(ends, FAR**2)
    for cut, scale in zip(cuts.T, scales.T, strict=True):
        np.minimum(least, (ends - cut[:, None]) ** 2 + scale[:, None] ** 2, out=least)
    return np.sqrt(least)


def _cuts(beta, alpha, theta_o, chi, in_plane):
    """Cuts and their scales, (n, k), and the angle between normal and axis, (n,)."""
    s, c = np.sin(theta_o), np.cos(theta_o)
    x = np.cos(beta) * s - np.sin(beta) * np.cos(chi) * c
    y = np.zeros_like(beta) if in_plane else np.sin(beta) * np.sin(chi)
    z = np.cos(beta) * c + np.sin(beta) * np.cos(chi) * s
    theta_b = np.arctan2(np.hypot(x, y), z)
    touch = np.abs(0.5 * np.pi - theta_b)
    # At grazing angles the lobe is a ridge in the incidence plane, as narrow across as it is steep.
    width = alpha * np.hypot(np.cos(chi), np.maximum(c, alpha) * np.sin(chi))
    zero, far = np.zeros_like(beta), np.full_like(beta, FAR)
    rows = [(zero, far), (beta, width), (touch, far), (np.pi - touch, far), (zero + np.pi, far)]
    if not in_plane:
        # Rings touch the ridge, and end on it at the horizon.
        flat = np.maximum(np.hypot(x, z), TINY)
        ridge, edge = np.arcsin(np.minimum(np.abs(y), 1)), np.arctan2(np.hypot(y, z), x)
        across = np.sqrt((x / flat - s) ** 2 + (alpha * (z / flat + c)) ** 2)
        rows += [(ridge, across), (edge, far)]
    cuts, scales = (np.stack(column, axis=-1) for column in zip(*rows, strict=True))
    return cuts, scales, theta_b
