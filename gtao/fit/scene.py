"""One scene of a multi-bounce fit: how many paths left each pixel after how many bounces.

With one albedo ρ everywhere and a white dome, the light that arrives after at most K surface bounces is

    V'_K(ρ) = Σ_{k=1..K} ρ^(k-1) T_k    (theory, eq. (35)),

where T_k is the share of paths that leave the scene after exactly k bounces, and V = T_1. One set of counts
therefore serves every albedo and every number of bounces. Infinitely many bounces add the geometric tail of
the paths that are still inside after the last counted bounce,

    tail(ρ) = R ρ^K (1 - λ) / (1 - λ ρ)    (theory, eq. (37)),

with R their share and λ the share of paths that survive one more bounce. λ is pooled over a scene and its
last bounces (per pixel there would be too few paths left to tell); V' is 1 at ρ = 1 whatever λ is.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gtao.errors import ConfigError, FitError, ShapeError

__all__ = ["SceneSamples", "scene_samples"]

#: λ is pooled over the last quarter of the counted bounces: late enough to be near its limit, enough paths to
#: count.
TAIL_SHARE = 0.25


@dataclass(frozen=True, eq=False)
class SceneSamples:
    """One scene.

    Attributes:
        name: Name of the scene.
        escaped: Paths that left after exactly k = 1…K bounces, (batches, K, N) unsigned integers.
        remaining: Paths still inside after K bounces, (batches, N).
        paths_per_batch: Paths of one batch at one pixel.
        pixel: Flat index y * width + x of each valid pixel, (N,).
        width: Image width in pixels.
        weight: Weight of the scene relative to the others.
        regressor: Visibility to fit on instead of V = T_1, (N,) in [0, 1]; None for V.
    """

    name: str
    escaped: np.ndarray
    remaining: np.ndarray
    paths_per_batch: int
    pixel: np.ndarray
    width: int
    weight: float = 1.0
    regressor: np.ndarray | None = None

    @property
    def n_pixels(self) -> int:
        """Number of valid pixels N."""
        return self.escaped.shape[2]

    @property
    def n_batches(self) -> int:
        """Number of independent batches."""
        return self.escaped.shape[0]

    @property
    def n_bounces(self) -> int:
        """Number of counted bounces K."""
        return self.escaped.shape[1]

    @property
    def spp(self) -> int:
        """Paths per pixel, all batches together."""
        return self.n_batches * self.paths_per_batch

    @property
    def visibility(self) -> np.ndarray:
        """What the fit regresses on, (N,) in [0, 1]: the given regressor, or the mean of T_1."""
        if self.regressor is not None:
            return self.regressor
        return self.escaped[:, 0].sum(axis=0, dtype=np.int64) / self.spp

    @property
    def survival(self) -> float:
        """λ: share of the paths inside that survive one more bounce, over all pixels and the last bounces."""
        escaped = self.escaped.sum(axis=(0, 2), dtype=np.int64)
        inside = self.remaining.sum(dtype=np.int64) + np.concatenate([np.cumsum(escaped[::-1])[::-1], [0]])
        first = self.n_bounces - max(1, round(TAIL_SHARE * self.n_bounces))
        tried = inside[first:-1].sum()
        return float(inside[first + 1 :].sum() / tried) if tried else 0.0

    def target_weights(self, bounces: float, albedos: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """V' as a weighted sum of shares: weights of T_1 … T_K, (albedos, K), and of the remainder,
        (albedos,).
        """
        powers = albedos[:, None] ** np.arange(self.n_bounces)
        if math.isinf(bounces):
            last, survival = albedos**self.n_bounces, self.survival
            # At ρ = λ = 1 the tail is the whole remainder: all of it gets out in the end.
            passed = np.where(albedos < 1, 1 - survival * albedos, 1.0)
            kept = np.where(albedos < 1, 1 - survival, 1.0)
            return powers, last * kept / passed
        counted = np.where(np.arange(self.n_bounces) < bounces, powers, 0.0)
        return counted, np.zeros(len(albedos))

    def batch_targets(self, bounces: float, albedos: np.ndarray) -> np.ndarray:
        """V' of each batch, (batches, albedos, N)."""
        counted, left = self.target_weights(bounces, albedos)
        used = int(np.flatnonzero(counted.any(axis=0))[-1]) + 1
        total = np.einsum("rk,bkn->brn", counted[:, :used], self.escaped[:, :used].astype(float), optimize=True)
        if left.any():
            total += left[:, None] * self.remaining[:, None, :]
        return total / self.paths_per_batch

    def target(self, bounces: float, albedos: ArrayLike) -> np.ndarray:
        """Mean V' of all batches, (albedos, N); arguments as in :meth:`Samples.check`."""
        return self.batch_targets(bounces, np.atleast_1d(np.asarray(albedos, float))).mean(axis=0)

    def tail(self, albedo: float) -> float:
        """Mean over the pixels of the geometric tail that infinite bounces add beyond the counted ones."""
        left = self.target_weights(math.inf, np.array([albedo]))[1][0]
        return float(left * self.remaining.mean() / self.paths_per_batch)


def scene_samples(name: str, t: Any, edges: str, weight: float, regressor: Any) -> SceneSamples:
    """Check one transport and bring it into the form of the fit."""
    escaped, remaining = np.asarray(t.escaped), np.asarray(t.remaining)
    pixel = np.asarray(t.pixel)
    if escaped.ndim != 3 or remaining.shape != (escaped.shape[0], escaped.shape[2]):
        raise ShapeError(
            f"scene {name!r}: escaped must be (batches, bounces, pixels) and remaining (batches, pixels), "
            f"got {escaped.shape} and {remaining.shape}"
        )
    n_batches, _, n_pixels = escaped.shape
    if n_pixels == 0:
        raise FitError(f"scene {name!r} has no valid pixel; does its camera see anything?")
    if pixel.shape != (n_pixels,):
        raise ShapeError(f"scene {name!r}: pixel has shape {pixel.shape}, expected ({n_pixels},)")
    paths = int(t.spp) // n_batches
    if paths < 1 or np.any(escaped.sum(axis=1, dtype=np.int64) + remaining != paths):
        raise ShapeError(f"scene {name!r}: escaped and remaining paths do not add up to {paths} in every batch")
    if not (math.isfinite(weight) and weight > 0):
        raise ConfigError(f"weight of scene {name!r} must be a positive number, got {weight}")
    values = None if regressor is None else _regressor(name, regressor, pixel)
    if edges == "drop":
        keep = ~np.asarray(t.edge, bool)
        if not keep.any():
            raise FitError(f"scene {name!r} has no pixel off depth edges; use edges='keep'")
        escaped, remaining, pixel = escaped[:, :, keep], remaining[:, keep], pixel[keep]
        values = None if values is None else values[keep]
    return SceneSamples(name, escaped, remaining, paths, pixel, int(t.width), float(weight), values)


def _regressor(name: str, given: Any, pixel: np.ndarray) -> np.ndarray:
    """Visibility of the valid pixels from a list or an image of it."""
    values = np.asarray(given, float)
    if values.ndim == 2 and values.size > pixel.max():
        values = values.ravel()[pixel]
    if values.shape != pixel.shape:
        raise ShapeError(f"scene {name!r}: regressor has shape {values.shape}, the scene {pixel.size} valid pixels")
    if not np.all(np.isfinite(values)):
        raise ShapeError(f"scene {name!r}: {int((~np.isfinite(values)).sum())} values of the regressor are NaN or inf")
    return np.clip(values, 0.0, 1.0)
