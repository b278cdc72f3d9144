"""How the coefficients would vary: bootstrap over scenes, or over blocks of pixels of one or two scenes."""

from dataclasses import dataclass

import numpy as np

from gtao.errors import FitError
from gtao.evaluate import block_labels, bootstrap_counts, bootstrap_interval, bootstrap_standard_error

from .forms import Polynomial
from .moments import Moments, cluster_moments
from .samples import Samples
from .settings import FitSettings
from .solver import Solver

__all__ = ["Draws", "resample", "scene_weights"]

#: Fewer scenes than this cannot tell how much scenes differ; blocks of pixels stand in for them.
MIN_SCENES = 3

#: Blocks across an image when blocks of pixels are resampled: large against the correlation of neighbours,
#: and still dozens of them.
BLOCKS_ACROSS = 8

#: Share of draws that may leave the coefficients undetermined before the bootstrap is called a failure.
MAX_FAILED = 0.1


@dataclass(frozen=True, kw_only=True, eq=False)
class Draws:
    """Spread of the bootstrap draws; every number is None where no bootstrap was asked for."""

    clusters: str
    n_clusters: int
    n_failed: int = 0
    standard_errors: tuple[float, ...] | None = None
    intervals: tuple[tuple[float, float], ...] | None = None
    covariance: np.ndarray | None = None
    cubic_errors: np.ndarray | None = None


def scene_weights(samples: Samples, weighting: str) -> np.ndarray:
    """Weight of each scene, (scenes,), summing to 1."""
    weight = np.array([scene.weight for scene in samples.scenes])
    if weighting == "pixel":
        weight = weight * [scene.n_pixels for scene in samples.scenes]
    return weight / weight.sum()


def resample(samples: Samples, settings: FitSettings, solver: Solver, moments: Moments, theta: np.ndarray) -> Draws:
    """Fit again to bootstrap samples.

    Args:
        samples: The samples.
        settings: Draws, seed, level and weighting.
        solver: What to fit.
        moments: Of whole scenes.
        theta: Coefficients of the fit to all of them.

    Returns:
        Standard errors, intervals and covariance.

    Raises:
        FitError: There is a single block of pixels, or too many draws leave the coefficients undetermined.
    """
    if settings.n_bootstrap == 0:
        return Draws(clusters="nothing", n_clusters=0)
    by_scene = len(samples.scenes) >= MIN_SCENES
    clusters = "scenes" if by_scene else "pixel blocks"
    if not by_scene:
        moments = _block_moments(samples, settings)
    n = len(moments.scene)
    strata = None if by_scene else moments.scene
    if n < 2 or (strata is not None and np.bincount(strata).min() < 2):
        raise FitError("a scene is too small to be cut into blocks for the bootstrap; use n_bootstrap=0")
    counts = bootstrap_counts(n, settings.n_bootstrap, settings.seed, strata=strata)
    weights = counts * scene_weights(samples, settings.weighting)[moments.scene]
    draws = solver.resolve(moments, weights, theta)
    good = np.all(np.isfinite(draws), axis=1)
    n_failed = int((~good).sum())
    if n_failed > MAX_FAILED * len(draws):
        raise FitError(
            f"{n_failed} of {len(draws)} bootstrap draws do not determine the coefficients; add scenes, or "
            "use n_bootstrap=0"
        )
    draws = draws[good]
    low, high = bootstrap_interval(draws, n, settings.level)
    cubic_errors = None
    if isinstance(solver.form, Polynomial):
        cubics = solver.cubics(moments, weights[good])
        cubic_errors = bootstrap_standard_error(cubics, n)
    return Draws(
        clusters=clusters,
        n_clusters=n,
        n_failed=n_failed,
        standard_errors=tuple(bootstrap_standard_error(draws, n).tolist()),
        intervals=tuple(zip(low.tolist(), high.tolist(), strict=True)),
        covariance=np.atleast_2d(np.cov(draws.T)) * n / (n - 1),
        cubic_errors=cubic_errors,
    )


def _block_moments(samples: Samples, settings: FitSettings) -> Moments:
    labels = [
        block_labels(scene.pixel, scene.width, max(1, -(-scene.width // BLOCKS_ACROSS))) for scene in samples.scenes
    ]
    uniform = settings.weighting == "uniform"
    return cluster_moments(samples, settings.bounces, np.array(settings.albedos), uniform=uniform, labels=labels)
