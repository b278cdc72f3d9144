"""The multi-bounce refit: from path counts to coefficients with standard errors.

The published procedure (Jimenez et al. 2016) fits a cubic in V per albedo and then a line in the albedo
through each of its coefficients. As V does not depend on the albedo, all cubics share one normal matrix, and
the lines through their coefficients are exactly the direct least-squares fit over all albedos: the two
procedures differ only when inequalities bind. Both are here.
"""

import math
from typing import Any, Literal

import numpy as np

from gtao.data.multibounce import MultibounceFit
from gtao.errors import ConfigError, FitError

from .constraints import CONSTRAINTS
from .forms import Polynomial, fitted_form
from .moments import cluster_moments
from .resampling import WEIGHTINGS, resample, scene_weights
from .result import FitSettings, MultibounceResult
from .samples import Samples
from .scoring import score_fit
from .solver import UNDETERMINED, Solver

__all__ = ["REPORT_ALBEDOS", "multibounce"]

#: Albedos of ATVI-TR-19-01.
REPORT_ALBEDOS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 0.9)

PROCEDURES = ("joint", "two-step")


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
    scenes. Noise in V does not bias it (see :mod:`gtao.fit.moments`): exactly so for the polynomial forms, to
    second order in 1/paths for the rational ones.

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
    settings = _settings(
        samples, bounces=bounces, albedos=albedos, form=form, procedure=procedure, constraints=constraints,
        weighting=weighting, n_bootstrap=n_bootstrap, level=level, seed=seed,
    )  # fmt: skip
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


def _settings(samples: Samples, **given: Any) -> FitSettings:
    """Check the arguments of :func:`multibounce` against each other."""
    form = fitted_form(given["form"])
    albedos = samples.check(given["bounces"], given["albedos"])
    constraints = given["constraints"]
    if isinstance(constraints, str):
        raise ConfigError(f"constraints must be a tuple of names, got the string {constraints!r}")
    unknown = [name for name in constraints if name not in CONSTRAINTS]
    if unknown:
        raise ConfigError(
            f"unknown constraint {', '.join(map(repr, unknown))}; choose from {', '.join(CONSTRAINTS)}"
        )
    for name, choices in (("procedure", PROCEDURES), ("weighting", WEIGHTINGS)):
        if given[name] not in choices:
            raise ConfigError(f"unknown {name} {given[name]!r}; choose one of {', '.join(choices)}")
    if given["procedure"] == "two-step":
        if given["form"] != "linear_cubic":
            raise ConfigError(
                f"the two-step procedure fits 'linear_cubic' only, got {given['form']!r}; use 'joint'"
            )
        extra = sorted(set(constraints) - {"zero_at_zero", "unit_at_one"})
        if extra:
            raise ConfigError(f"the two-step procedure cannot hold {', '.join(extra)}; use procedure='joint'")
    if isinstance(form, Polynomial) and albedos.size < 2:
        raise ConfigError(f"form {given['form']!r} needs at least 2 albedos, got {albedos.tolist()}")
    if given["n_bootstrap"] < 0:
        raise ConfigError(f"n_bootstrap must not be negative, got {given['n_bootstrap']}; use 0 for none")
    if not 0 < given["level"] < 1:
        raise ConfigError(f"level must lie in (0, 1), got {given['level']}; 0.95 is usual")
    return FitSettings(
        **given
        | {
            "bounces": float(given["bounces"]),
            "albedos": tuple(albedos.tolist()),
            "constraints": tuple(constraints),
        }
    )
