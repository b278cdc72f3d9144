"""Errors of a given function V'(V, ρ) on the samples, with the noise of the samples taken out.

The squared error of a noisy sample holds the noise of V' and that of V as well. What is reported here is the
error that would remain with infinitely many paths: the square of V' comes from pairs of different batches,
everything that involves the function from the jackknife (see :mod:`gtao.fit.moments`). A squared error that
noise makes negative counts as 0.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gtao.data.multibounce import MultibounceFit

from .forms import evaluate
from .moments import Moments

__all__ = ["Score", "score", "score_fit"]


@dataclass(frozen=True, eq=False)
class Score:
    """Errors per scene and albedo; pixels of a scene count alike.

    Attributes:
        mse: Mean squared error, (scenes, albedos).
        bias: Mean of function minus V', (scenes, albedos).
    """

    mse: np.ndarray
    bias: np.ndarray

    @property
    def rmse(self) -> float:
        """Root of the mean over scenes and albedos of the squared error."""
        return float(np.sqrt(self.mse.mean()))

    @property
    def rmse_per_scene(self) -> np.ndarray:
        """Root of the mean over albedos, (scenes,)."""
        return np.sqrt(self.mse.mean(axis=1))

    @property
    def rmse_per_albedo(self) -> np.ndarray:
        """Root of the mean over scenes, (albedos,)."""
        return np.sqrt(self.mse.mean(axis=0))


def score(moments: Moments, function: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Score:
    """Errors of a function.

    Args:
        moments: Of whole scenes, with every pixel weighing the same.
        function: Takes V (L, 1) and ρ (R,), returns V' (L, R).

    Returns:
        The errors.
    """
    mse = moments.square.copy()
    bias = np.zeros_like(mse)
    for lattice in moments.lattices:
        f = function(lattice.levels[:, None], moments.albedos)
        product = np.einsum("clr,lr->cr", lattice.target, f)
        mse += lattice.factor * (lattice.weight @ f**2 - 2 * product)
        bias += lattice.factor * (lattice.weight @ f - lattice.target.sum(axis=1))
    return Score(np.maximum(mse, 0.0), bias)


def score_fit(moments: Moments, fit: MultibounceFit) -> Score:
    """Errors of published or refitted coefficients; ``linear_cubic`` as it is used, with its max(V, …)."""
    return score(moments, lambda V, rho: evaluate(fit, V, rho))
