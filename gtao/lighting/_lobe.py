"""The lobe that light is pre-filtered with, and how much of it falls on each texel of a latitude-longitude grid."""

import math

import numpy as np
from scipy.sparse import csr_array

__all__ = ["lobe", "texel_weights"]

#: Panels narrow toward the lobe's axis until they are as narrow as the lobe. Those nearer than FAR times their width
#: need four Gauss nodes for the lobe's integral over them to be right to 1e-5 of itself, the others two.
NEAR_NODES, FAR_NODES, FAR = 4, 2, 4.0
#: Panels from pole to pole at least: the lobe ends at a right angle to its axis, between two nodes.
MIN_PANELS = 128


def lobe(x: np.ndarray, alpha: float) -> np.ndarray:
    """D(cos t/2) ⟨cos t⟩₊ of GGX over D(1), from x = sin²(t/2); theory, eq. (138)."""
    square = alpha * alpha
    return np.where(x < 0.5, (square / (x + square * (1 - x))) ** 2 * (1 - 2 * x), 0)


def texel_weights(shape: tuple[int, int], theta: float, column: float, alpha: float) -> np.ndarray:
    """Share of the lobe that each texel's hat takes, (H, W), summing to 1; theory, eq. (139).

    Args:
        shape: (H, W) of the grid.
        theta: polar angle of the lobe's axis, local frame.
        column: position of its axis in columns, 0 at the centre of the first.
        alpha: microfacet width, positive.
    """
    height, width = shape
    row = theta / math.pi * height - 0.5
    angles, down = _hats(height, row, math.pi / height, alpha, periodic=False)
    turns, across = _hats(width, column, 2 * math.pi / width, alpha, periodic=True)
    near = np.abs(angles - theta) < math.pi / 2
    angles, down = angles[near], down[:, near]
    sines = np.sin(angles)
    x = np.sin((angles - theta) / 2)[:, None] ** 2 + np.outer(sines * math.sin(theta), np.sin(turns / 2) ** 2)
    values = lobe(x, alpha) * sines[:, None]
    weights = down @ (across @ values.T).T
    return weights / weights.sum()


def _hats(n: int, axis: float, step: float, alpha: float, periodic: bool) -> tuple[np.ndarray, csr_array]:
    """Nodes of one coordinate, and the hats of its n texels at them times the quadrature's weights, (n, nodes).

    Texels stand at the integers; ``axis`` is where the lobe is, ``step`` the angle between texels. Nodes of the
    periodic coordinate are angles from the axis; of the other one, polar angles.
    """
    ends = (axis - n / 2, axis + n / 2) if periodic else (-0.5, n - 0.5)
    cuts = max(1, math.ceil(MIN_PANELS * step / math.pi))
    depth = max(0, math.ceil(math.log2(step / (cuts * alpha)))) + 1
    graded = 0.5 ** np.arange(depth) / cuts
    inside = np.arange(math.ceil(ends[0] * cuts), math.floor(ends[1] * cuts) + 1) / cuts
    breaks = np.unique(np.concatenate([ends, inside, axis - graded, [axis], axis + graded]))
    breaks = breaks[(breaks >= ends[0]) & (breaks <= ends[1])]
    middle, half = (breaks[1:] + breaks[:-1]) / 2, np.diff(breaks) / 2
    far = np.abs(middle - axis) > 2 * FAR * half
    parts = [_gauss(middle[k], half[k], nodes) for k, nodes in ((~far, NEAR_NODES), (far, FAR_NODES))]
    at, weight = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    lower = np.floor(at)
    share, texel = at - lower, lower.astype(np.int64)
    pair = np.stack([texel, texel + 1])
    pair = pair % n if periodic else np.clip(pair, 0, n - 1)
    values = np.stack([(1 - share) * weight, share * weight])
    columns = np.broadcast_to(np.arange(len(at)), pair.shape)
    hats = csr_array((values.ravel(), (pair.ravel(), columns.ravel())), shape=(n, len(at)))
    return step * (at - axis if periodic else at + 0.5), hats


def _gauss(middle: np.ndarray, half: np.ndarray, n_nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss nodes and weights of intervals."""
    x, w = np.polynomial.legendre.leggauss(n_nodes)
    return (middle[:, None] + half[:, None] * x).ravel(), (half[:, None] * w).ravel()
