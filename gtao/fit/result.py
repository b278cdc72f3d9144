"""What a multi-bounce refit returns."""

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from gtao.data.multibounce import MultibounceFit

from .scoring import Score
from .settings import FitSettings

__all__ = ["MultibounceResult"]


@dataclass(frozen=True, kw_only=True, eq=False)
class MultibounceResult:
    """A refit and how far to trust it.

    Attributes:
        fit: Coefficients with standard errors and intervals.
        settings: What was asked for.
        scenes: Names of the scenes.
        residuals: Errors of the fit on its own scenes, per scene and albedo, noise taken out.
        naive: Coefficients that the same fit gives when noise in V is ignored.
        covariance: Of the coefficients, from the bootstrap, (P, P); None without bootstrap.
        cubics: a, b, c of the cubic of each albedo alone, (albedos, 3), under the same equations.
        cubic_errors: Their standard errors, or None.
        clusters: What the bootstrap resampled: "scenes", "pixel blocks", or "nothing".
        n_clusters: How many of them there are.
        n_failed: Bootstrap draws that did not determine the coefficients and were left out.
        active: Inequalities that bind.
        tail: Mean geometric tail beyond the counted bounces at the largest albedo, per scene; 0 for finite
            bounces.
    """

    fit: MultibounceFit
    settings: FitSettings
    scenes: tuple[str, ...]
    residuals: Score
    naive: tuple[float, ...]
    covariance: np.ndarray | None
    cubics: np.ndarray
    cubic_errors: np.ndarray | None
    clusters: str
    n_clusters: int
    n_failed: int
    active: tuple[str, ...]
    tail: tuple[float, ...]

    @property
    def rmse(self) -> float:
        """Root of the mean over scenes and albedos of the squared error on the scenes that were fitted."""
        return self.residuals.rmse

    def to_dict(self) -> dict[str, Any]:
        """All numbers as plain lists, ready for a record; ``inf`` bounces become the string "inf"."""
        settings = asdict(self.settings)
        settings["bounces"] = "inf" if math.isinf(self.settings.bounces) else int(self.settings.bounces)
        return {
            "settings": settings,
            "coefficients": dict(zip(self.fit.names, self.fit.coefficients, strict=True)),
            "standard_errors": _named(self.fit.names, self.fit.standard_errors),
            "intervals": _named(self.fit.names, self.fit.intervals),
            "covariance": None if self.covariance is None else self.covariance.tolist(),
            "naive_coefficients": _named(self.fit.names, self.naive),
            "cubics": self.cubics.tolist(),
            "cubic_standard_errors": None if self.cubic_errors is None else self.cubic_errors.tolist(),
            "resampled": self.clusters,
            "n_resampled": self.n_clusters,
            "n_failed_draws": self.n_failed,
            "active_constraints": list(self.active),
            "scenes": list(self.scenes),
            "rmse": self.rmse,
            "rmse_per_scene_and_albedo": np.sqrt(self.residuals.mse).tolist(),
            "bias_per_scene_and_albedo": self.residuals.bias.tolist(),
            "tail": dict(zip(self.scenes, self.tail, strict=True)),
        }

    def _repr_html_(self) -> str:
        return self.fit._repr_html_()


def _named(names: tuple[str, ...], values: Any) -> dict[str, Any] | None:
    return None if values is None else dict(zip(names, values, strict=True))
