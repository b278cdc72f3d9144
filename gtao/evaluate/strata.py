"""Errors by circumstance: how they depend on tilt, place in the image, openness and nearness to a depth edge."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import ndimage

from gtao.errors import ConfigError, ShapeError

from .metrics import bias, corrected_rmse, mae, noise_floor, rmse

__all__ = ["STRATA_EDGES", "Strata", "strata_of", "stratify"]

#: Edges of the bins of what :func:`strata_of` returns.
STRATA_EDGES: dict[str, tuple[float, ...]] = {
    "tilt": tuple(float(np.deg2rad(x)) for x in (0, 15, 30, 45, 60, 75, 90)),
    "image radius": (0.0, 0.2, 0.4, 0.6, 0.8, 1.0),
    "visibility": (0.0, 0.2, 0.4, 0.6, 0.8, 1.0),
    "depth edge": (0.0, 1.0, 2.0, 4.0, 8.0, 16.0, float("inf")),
}


@dataclass(frozen=True, repr=False)
class Strata:
    """Errors in bins of one quantity; n bins.

    Attributes:
        name: The quantity.
        edges: (n + 1,) edges; a bin holds its lower edge, the last one also its upper edge.
        count: (n,) pixels per bin.
        rmse: (n,) root of the mean squared error; like all that follow NaN in bins without pixels.
        corrected_rmse: (n,) the same without the noise of the reference; equal to ``rmse`` for a reference without.
        bias: (n,) mean error.
        mae: (n,) mean absolute error.
        noise: (n,) root of the reference's mean variance: what ``rmse`` would be for a perfect image.
    """

    name: str
    edges: np.ndarray = field(compare=False)
    count: np.ndarray = field(compare=False)
    rmse: np.ndarray = field(compare=False)
    corrected_rmse: np.ndarray = field(compare=False)
    bias: np.ndarray = field(compare=False)
    mae: np.ndarray = field(compare=False)
    noise: np.ndarray = field(compare=False)

    def to_dict(self) -> dict[str, Any]:
        """Everything in plain types that JSON can hold: None for a bin without pixels, "inf" for an infinite edge."""
        columns = ("rmse", "corrected_rmse", "bias", "mae", "noise")
        values = {c: [None if np.isnan(x) else float(x) for x in getattr(self, c)] for c in columns}
        edges = [float(x) if np.isfinite(x) else str(float(x)) for x in self.edges]
        return {"name": self.name, "edges": edges, "count": self.count.tolist(), **values}

    def __repr__(self) -> str:
        lines = [f"Strata of {self.name}", "        from         to    pixels      RMSE  corrected      bias     noise"]
        for i, n in enumerate(self.count):
            lines.append(
                f"  {self.edges[i]:10.4g} {self.edges[i + 1]:10.4g} {n:9d} {self.rmse[i]:9.4f} "
                f"{self.corrected_rmse[i]:10.4f} {self.bias[i]:+9.4f} {self.noise[i]:9.4f}"
            )
        return "\n".join(lines)


def stratify(
    image: ArrayLike,
    reference: ArrayLike,
    *,
    by: Mapping[str, ArrayLike],
    edges: Mapping[str, Sequence[float]] | None = None,
    mask: ArrayLike | None = None,
    variance: ArrayLike | None = None,
) -> dict[str, Strata]:
    """Errors of an image in bins of each of several quantities.

    Args:
        image: (H, W) image.
        reference: (H, W) image.
        by: Quantities by name, (H, W) each, for example from :func:`strata_of`. Pixels where one is NaN or outside
            its edges are in none of its bins.
        edges: At least two ascending edges by name. If left out, those of ``STRATA_EDGES``: tilt in steps of 15°, image
            radius and visibility in steps of 0.2, depth edges at 0, 1, 2, 4, 8, 16 and infinitely many pixels.
        mask: (H, W) bool, pixels that count; all if left out.
        variance: (H, W) variance of the reference's means; no noise if left out.

    Returns:
        A table per quantity, in the order given.

    Raises:
        ConfigError: A quantity without edges, or edges that do not ascend.
        ShapeError: The shapes differ or are not (H, W), a value that counts is not finite, or a variance is negative.
    """
    x, y = np.asarray(image, dtype=np.float64), np.asarray(reference, dtype=np.float64)
    keep = np.ones(x.shape, dtype=bool) if mask is None else np.asarray(mask).astype(bool)
    noise = np.zeros(x.shape) if variance is None else np.asarray(variance, dtype=np.float64)
    quantities = {name: np.asarray(values, dtype=np.float64) for name, values in by.items()}
    shapes = {"reference": y.shape, "mask": keep.shape, "variance": noise.shape}
    shapes |= {f"by[{name!r}]": values.shape for name, values in quantities.items()}
    for name, shape in shapes.items():
        if x.ndim != 2 or shape != x.shape:
            raise ShapeError(f"image has shape {x.shape} and {name} {shape}; both must be the same (H, W)")
    given = STRATA_EDGES | dict(edges or {})
    return {name: _strata(name, values, _edges(name, given), x, y, keep, noise) for name, values in quantities.items()}


def strata_of(
    position_v: ArrayLike,
    normal_v: ArrayLike,
    visibility: ArrayLike,
    *,
    view_dir: ArrayLike | None = None,
    edge_step: float = 0.05,
) -> dict[str, np.ndarray]:
    """The four quantities that a screen-space error depends on most.

    Args:
        position_v: (H, W, 3) points in the view frame; anything that is not in front of the camera (zero, NaN) is
            background.
        normal_v: (H, W, 3) unit normals in the view frame.
        visibility: (H, W) reference. Where it is noisy, its own bins mix: a point lands in a dark one the rather,
            the lower its noise has put it, and that looks like a positive bias.
        view_dir: (H, W, 3) or (3,) unit vectors from the surface to the camera, view frame: (0, 0, 1) in parallel
            projection. Those of a pinhole camera if left out.
        edge_step: Relative step in depth that makes an edge, positive: neighbours are torn apart where one lies
            farther than this share of their smaller view_z from the other's tangent plane. Slopes and creases are
            none, whatever their depth; the border to the background always is.

    Returns:
        (H, W) float64 arrays:

        - "tilt": angle between normal and view direction, radians, in [0, π]; NaN on the background;
        - "image radius": distance from the image centre, 0 there and 1 at the corners;
        - "visibility": the reference, clipped to [0, 1];
        - "depth edge": distance in pixels from the nearest pixel at a depth edge, 0 on it and infinite without any.

    Raises:
        ConfigError: The step is not a positive number.
        ShapeError: The shapes do not belong together.
    """
    if not (np.isfinite(edge_step) and edge_step > 0):
        raise ConfigError(f"edge_step must be a positive number, got {edge_step}; 0.05 is 5 % of the depth")
    V = np.asarray(visibility, dtype=np.float64)
    P, N = np.asarray(position_v, dtype=np.float64), np.asarray(normal_v, dtype=np.float64)
    if V.ndim != 2 or {P.shape, N.shape} != {(*V.shape, 3)} or np.shape(view_dir) not in ((), (3,), P.shape):
        raise ShapeError(
            f"got position_v {P.shape}, normal_v {N.shape}, visibility {V.shape} and view_dir {np.shape(view_dir)}; "
            f"they must be (H, W, 3), (H, W, 3), (H, W), and (H, W, 3) or (3,)"
        )
    surface = np.isfinite(P).all(axis=-1) & (P[..., 2] < 0)
    # A stand-in where there is no surface, so that nothing below divides by zero.
    P = np.where(surface[..., None], P, (0.0, 0.0, -1.0))
    N = np.where(surface[..., None], N, 0.0)
    view = -P / np.linalg.norm(P, axis=-1, keepdims=True) if view_dir is None else np.asarray(view_dir, np.float64)
    cosine = np.clip(np.sum(N * np.where(surface[..., None], view, 0.0), axis=-1), -1, 1)
    height, width = V.shape
    y, x = np.mgrid[:height, :width] + 0.5
    radius = np.hypot(x - width / 2, y - height / 2) / np.hypot(width / 2, height / 2)
    torn = _torn(P, N, surface, edge_step)
    return {
        "tilt": np.where(surface, np.arccos(cosine), np.nan),
        "image radius": radius,
        "visibility": np.clip(V, 0, 1),
        "depth edge": ndimage.distance_transform_edt(~torn) if torn.any() else np.full(V.shape, np.inf),
    }


def _torn(P: np.ndarray, N: np.ndarray, surface: np.ndarray, step: float) -> np.ndarray:
    """Pixels of which at least one of the four neighbours is on another surface."""
    torn = np.zeros(surface.shape, dtype=bool)
    for here, there in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        offset = P[there] - P[here]
        # The larger of both distances: at a round silhouette the near normal is at right angles to the gap.
        gap = np.maximum(np.abs(np.sum(N[here] * offset, -1)), np.abs(np.sum(N[there] * offset, -1)))
        near = np.minimum(-P[here][..., 2], -P[there][..., 2])
        both = surface[here] & surface[there]
        edge = (both & (gap > step * near)) | (surface[here] != surface[there])
        torn[here] |= edge
        torn[there] |= edge
    return torn


def _edges(name: str, edges: Mapping[str, Sequence[float]]) -> np.ndarray:
    if name not in edges:
        raise ConfigError(f"there are no edges for {name!r}; give edges={{{name!r}: (…)}}")
    values = np.asarray(edges[name], dtype=np.float64)
    if values.ndim != 1 or values.size < 2 or not np.all(np.diff(values) > 0):
        raise ConfigError(f"edges of {name!r} must be at least two ascending numbers, got {list(edges[name])}")
    return values


def _strata(
    name: str, values: np.ndarray, edges: np.ndarray, x: np.ndarray, y: np.ndarray, keep: np.ndarray, noise: np.ndarray
) -> Strata:
    n = len(edges) - 1
    bins = np.searchsorted(edges, values, side="right") - 1
    bins = np.where(values == edges[-1], n - 1, bins)
    count = np.zeros(n, dtype=np.int64)
    table = np.full((5, n), np.nan)
    for i in range(n):
        inside = keep & (bins == i)
        count[i] = inside.sum()
        if count[i]:
            table[:, i] = (
                rmse(x, y, mask=inside), corrected_rmse(x, y, noise, mask=inside), bias(x, y, mask=inside),
                mae(x, y, mask=inside), noise_floor(noise, mask=inside),
            )  # fmt: skip
    return Strata(name, edges, count, *table)
