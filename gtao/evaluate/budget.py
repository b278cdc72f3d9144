"""The error budget: what each step from the truth to an estimate costs."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gtao.errors import ConfigError, ShapeError

from .bootstrap import block_labels, bootstrap_counts, bootstrap_standard_error

__all__ = ["ErrorBudget", "error_budget"]


@dataclass(frozen=True, repr=False)
class ErrorBudget:
    """Shares of a mean squared error; made by :func:`error_budget`.

    Attributes:
        reference: Name of the first rung.
        names: Names of the K steps; the last is the estimate.
        images: K differences of neighbouring rungs, (H, W) float32 each, NaN outside the mask; noise included.
        gram: (K, K) mean products of the differences, without the part that noise contributes. Its sum is ``total``.
        biases: (K,) means of the differences.
        total: Mean squared error of the last rung against the first, without noise.
        noise: Mean squared error that noise adds to ``total``: the mean variance of the first and last rung.
        n_pixels: Number of pixels that count.
        gram_error: (K, K) standard errors of ``gram``, or None without a bootstrap.
        bias_error: (K,) standard errors of ``biases``, or None.
        total_error: Standard error of ``total``, or None.
    """

    reference: str
    names: tuple[str, ...]
    images: tuple[np.ndarray, ...] = field(compare=False)
    gram: np.ndarray = field(compare=False)
    biases: np.ndarray = field(compare=False)
    total: float
    noise: float
    n_pixels: int
    gram_error: np.ndarray | None = field(default=None, compare=False)
    bias_error: np.ndarray | None = field(default=None, compare=False)
    total_error: float | None = None

    @property
    def mean_squares(self) -> np.ndarray:
        """(K,) mean squares of the differences, the diagonal of ``gram``. Unbiased: within noise of 0 one can be
        negative.
        """
        return np.diag(self.gram)

    @property
    def cross_terms(self) -> float:
        """``total`` less the mean squares: positive where steps add up, negative where they undo each other."""
        return self.total - float(self.mean_squares.sum())

    @property
    def shares(self) -> np.ndarray:
        """(K,) row sums of ``gram``: each mean square with half of each cross term that it takes part in. They sum to
        ``total``; a step that cancels the error of others has a negative share.
        """
        return self.gram.sum(axis=1)

    @property
    def correlations(self) -> np.ndarray:
        """(K, K) mean products over the roots of the mean squares, about zero; NaN where a mean square is not above 0.

        Noise can carry an entry beyond ±1.
        """
        squares = np.where(self.mean_squares > 0, self.mean_squares, np.nan)
        return self.gram / np.sqrt(np.outer(squares, squares))

    def to_dict(self) -> dict[str, Any]:
        """Everything but the images, in plain types that JSON can hold."""

        def plain(value: np.ndarray | None) -> Any:
            return None if value is None else value.tolist()

        return {
            "reference": self.reference,
            "names": list(self.names),
            "gram": plain(self.gram),
            "gram_error": plain(self.gram_error),
            "biases": plain(self.biases),
            "bias_error": plain(self.bias_error),
            "total": self.total,
            "total_error": self.total_error,
            "noise": self.noise,
            "n_pixels": self.n_pixels,
        }

    def __repr__(self) -> str:
        width = max(map(len, (*self.names, "cross terms")))
        lines = [
            f"ErrorBudget against {self.reference}, {self.n_pixels} pixels, RMSE {max(self.total, 0.0) ** 0.5:.5f}",
            f"  {'':{width}}  mean square  std. error       bias",
        ]
        errors = [None] * len(self.names) if self.gram_error is None else list(np.diag(self.gram_error))
        for name, square, error, bias in zip(self.names, self.mean_squares, errors, self.biases, strict=True):
            lines.append(f"  {name:{width}}  {square:11.3e}  {_cell(error)}  {bias:+9.5f}")
        lines.append(f"  {'cross terms':{width}}  {self.cross_terms:11.3e}")
        lines.append(f"  {'total':{width}}  {self.total:11.3e}  {_cell(self.total_error)}  {self.biases.sum():+9.5f}")
        return "\n".join(lines)


def error_budget(
    rungs: Mapping[str, Any],
    *,
    variances: Mapping[str, Any] | None = None,
    mask: Any = None,
    block: int = 16,
    n_bootstrap: int = 200,
    seed: int = 0,
) -> ErrorBudget:
    """Split the error of an estimate along a ladder of images between it and the truth.

    With rungs V_0 … V_K and steps d_k = V_k - V_(k-1) the error V_K - V_0 is the sum of the steps, and its mean square
    the sum of all their mean products (theory, eq. (61)). Noise of a rung enters the mean squares of both steps beside
    it and, with the opposite sign, their mean product; it is taken out of each (theory, eq. (62)), so that the steps
    measure expectations. The noise of different rungs must be independent.

    Standard errors come from resampling square blocks of pixels: they say how the numbers would move with another
    noise and on another part of such an image.

    Args:
        rungs: At least two (H, W) images by name, in order: the reference first, the estimate last. Each later name
            stands for what is lost on the way to it.
        variances: Variance of the mean by name of the rung, (H, W) or one number; rungs left out, or None, have no
            noise.
        mask: (H, W) bool, pixels that count; all if left out.
        block: Side of a block in pixels, at least 1.
        n_bootstrap: Bootstrap samples, at least 2; 0 for no standard errors. There are none either where all pixels
            lie in one block.
        seed: Seed of the bootstrap.

    Returns:
        The budget.

    Raises:
        ConfigError: Fewer than two rungs, a variance for a rung that does not exist, or a bootstrap out of range.
        ShapeError: Shapes differ, no pixel is left, a value that counts is not finite, or a variance is negative.
    """
    names = tuple(rungs)
    variances = {} if variances is None else variances
    if len(names) < 2:
        raise ConfigError(f"a ladder needs at least two rungs, got {list(names)}; give the reference and an estimate")
    if unknown := set(variances) - set(names):
        raise ConfigError(f"variances are given for {sorted(unknown)}, which are not among the rungs {list(names)}")
    if block < 1 or n_bootstrap < 0 or n_bootstrap == 1:
        raise ConfigError(f"block must be at least 1 and n_bootstrap 0 or at least 2, got {block} and {n_bootstrap}")
    stack, keep = _images(rungs, mask)
    noise = np.stack([_variance(name, variances.get(name), keep) for name in names])
    labels = block_labels(np.flatnonzero(keep), keep.shape[1], block)
    counts, products, sums = _block_sums(np.diff(stack[:, keep], axis=0), noise, labels)
    n, k = int(counts.sum()), len(names) - 1
    gram = products.sum(axis=0) / n
    errors: list[Any] = [None, None, None]
    if n_bootstrap and len(counts) > 1:
        draws = bootstrap_counts(len(counts), n_bootstrap, seed)
        # Ratios of sums: blocks at the border hold fewer pixels.
        drawn = (draws @ products) / (draws @ counts)[:, None], (draws @ sums) / (draws @ counts)[:, None]
        values = drawn[0].reshape(-1, k, k), drawn[1], drawn[0].sum(axis=1)
        errors = [bootstrap_standard_error(value, len(counts)) for value in values]
    return ErrorBudget(
        reference=names[0],
        names=names[1:],
        images=tuple(np.diff(np.where(keep, stack, np.nan), axis=0).astype(np.float32)),
        gram=gram.reshape(k, k),
        biases=sums.sum(axis=0) / n,
        total=float(gram.sum()),
        noise=float((noise[0] + noise[-1]).mean()),
        n_pixels=n,
        gram_error=errors[0],
        bias_error=errors[1],
        total_error=None if errors[2] is None else float(errors[2]),
    )


def _images(rungs: Mapping[str, Any], mask: Any) -> tuple[np.ndarray, np.ndarray]:
    """All rungs, (K + 1, H, W) float64, and the pixels that count."""
    images = {name: np.asarray(image, dtype=np.float64) for name, image in rungs.items()}
    shape = next(iter(images.values())).shape
    for name, image in images.items():
        if image.ndim != 2 or image.shape != shape:
            raise ShapeError(
                f"rung {name!r} has shape {image.shape} and the first {shape}; all must be the same (H, W)"
            )
    keep = np.ones(shape, dtype=bool) if mask is None else np.asarray(mask).astype(bool)
    if keep.shape != shape:
        raise ShapeError(f"mask has shape {keep.shape}, the rungs {shape}; they must be equal")
    if not keep.any():
        raise ShapeError(f"no pixel of {shape} is left; check mask")
    for name, image in images.items():
        if broken := int((~np.isfinite(image[keep])).sum()):
            raise ShapeError(
                f"{broken} of {keep.sum()} values of rung {name!r} are NaN or infinite; leave them out with mask="
            )
    return np.stack(list(images.values())), keep


def _variance(name: str, variance: Any, keep: np.ndarray) -> np.ndarray:
    """Variance of a rung at the pixels that count."""
    if variance is None:
        return np.zeros(int(keep.sum()))
    values = np.asarray(variance, dtype=np.float64)
    if values.ndim and values.shape != keep.shape:
        raise ShapeError(f"the variance of {name!r} has shape {values.shape}; it must be {keep.shape} or a number")
    values = np.broadcast_to(values, keep.shape)[keep]
    if not np.all(np.isfinite(values)) or np.any(values < 0):
        raise ShapeError(f"the variance of {name!r} must be finite and not negative; give the variance of the mean")
    return values


def _block_sums(steps: np.ndarray, noise: np.ndarray, labels: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Per block: pixels (B,), sums of products without noise (B, K²), and sums of the steps (B, K)."""
    k = len(steps)

    def total(values: np.ndarray | None) -> np.ndarray:
        return np.bincount(labels, weights=values)

    counts = total(None)
    products = np.empty((len(counts), k, k))
    for i in range(k):
        for j in range(i, k):
            product = steps[i] * steps[j]
            if j == i:
                product -= noise[i] + noise[i + 1]
            elif j == i + 1:
                product += noise[j]
            products[:, i, j] = products[:, j, i] = total(product)
    return counts.astype(float), products.reshape(-1, k * k), np.stack([total(step) for step in steps], axis=1)


def _cell(error: float | None) -> str:
    return f"{'–':>10}" if error is None else f"{error:10.1e}"
