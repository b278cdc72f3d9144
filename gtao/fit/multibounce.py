"""The multi-bounce refit: from path counts to coefficients with standard errors.

The published procedure (Jimenez et al. 2016) fits a cubic in V per albedo and then a line in the albedo
through each of its coefficients. As V does not depend on the albedo, all cubics share one normal matrix, and
the lines through their coefficients are exactly the direct least-squares fit over all albedos: the two
procedures differ only when inequalities bind. Both are here.
"""

import math
from typing import Literal

import numpy as np

from gtao.data.multibounce import MultibounceFit
from gtao.errors import FitError

from .moments import cluster_moments
from .quadratic import UNDETERMINED
from .resampling import resample, scene_weights
from .result import MultibounceResult
from .samples import Samples
from .scoring import score_fit
from .settings import REPORT_ALBEDOS, FitSettings, check
from .solver import Solver

__all__ = ["multibounce"]


def multibounce(
    samples: Samples,
    *,
    bounces: float = 4,
    albedos: tuple[float, ...] = REPORT_ALBEDOS,
    form: str = "linear_cubic",
    procedure: Literal["joint", "two-step"] = "joint",
    constraints: tuple[str, ...] = ("unit_at_one",),
    weighting: Literal["scene", "pixel", "uniform"] = "scene",
    n_bootstrap: int = 1000,
    level: float = 0.95,
    seed: int = 0,
) -> MultibounceResult:
    """Fit multi-bounce visibility V'(V, ρ) to path counts.

    The fit minimises the squared error of V', averaged over albedos and over the weighted pixels of all
    scenes (theory, eq. (44)). Noise in V does not bias it (see :mod:`gtao.fit.moments`): exactly so for the
    polynomial forms, to second order in 1/paths for the rational ones.

    Args:
        samples: Path counts of the scenes.
        bounces: Surface bounces, counting the visible point: 2, 3, 4, … or ``inf``. Four are the published
            "direct plus three".
        albedos: Albedos to fit, in (0, 1).
        form: "linear_cubic", "four_parameter", "one_parameter" or "two_parameter".
        procedure: "joint" for one least-squares problem over all albedos, "two-step" for a cubic per albedo
            and then lines through its coefficients (``linear_cubic`` only).
        constraints: Any of "zero_at_zero", "unit_at_one", "above_visibility", "monotone", "energy"; the
            inequalities hold for every visibility and albedo in [0, 1].
        weighting: "scene": every scene counts the same (times its weight), every pixel in it too. "pixel":
            every pixel of every scene counts the same. "uniform": within each scene the weights make the
            distribution of visibility flat over 20 bins, raising no pixel by more than 20 times; scenes count
            the same.
        n_bootstrap: Bootstrap draws; 0 for none.
        level: Confidence level of the intervals, in (0, 1).
        seed: Seed of the bootstrap.

    Returns:
        Coefficients, standard errors and intervals. They come from resampling whole scenes, which says how
        the coefficients would move with other scenes of the same kind; below three scenes blocks of pixels
        are resampled instead, which covers the noise but not the choice of scenes.

    Raises:
        ConfigError: An argument outside its range, or a combination that makes no sense.
        FitError: Too few batches, or data that do not determine the coefficients.
    """
    settings = check(
        samples,
        FitSettings(
            form=form,
            bounces=bounces,
            albedos=tuple(albedos),
            procedure=procedure,
            constraints=constraints,
            weighting=weighting,
            n_bootstrap=n_bootstrap,
            level=level,
            seed=seed,
        ),
    )
    values = np.array(settings.albedos)
    solver = Solver(form, settings.constraints, two_step=procedure == "two-step")
    naive = Solver(form, settings.constraints, two_step=procedure == "two-step", naive=True)
    moments = cluster_moments(samples, bounces, values, uniform=weighting == "uniform")
    weights = scene_weights(samples, weighting)[None]
    theta = solver.solve(moments, weights)[0]
    if not np.all(np.isfinite(theta)):
        raise FitError(UNDETERMINED)
    draws = resample(samples, settings, solver, moments, theta)
    fit = MultibounceFit(
        form=form,
        coefficients=tuple(theta.tolist()),
        bounces=float(bounces),
        source=f"refit on {len(samples.scenes)} scenes, {samples.scenes[0].spp} paths per pixel",
        standard_errors=draws.standard_errors,
        intervals=draws.intervals,
        level=level if draws.intervals else None,
    )
    return MultibounceResult(
        fit=fit,
        settings=settings,
        scenes=samples.names,
        residuals=score_fit(cluster_moments(samples, bounces, values), fit),
        naive=tuple(naive.solve(moments, weights)[0].tolist()),
        covariance=draws.covariance,
        cubics=solver.cubics(moments, weights)[0],
        cubic_errors=draws.cubic_errors,
        clusters=draws.clusters,
        n_clusters=draws.n_clusters,
        n_failed=draws.n_failed,
        active=() if solver.two_step else solver.constraints.active(theta),
        tail=tuple(s.tail(float(values.max())) if math.isinf(bounces) else 0.0 for s in samples.scenes),
    )
