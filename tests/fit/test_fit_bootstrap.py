"""Standard errors and intervals say how the coefficients move with other scenes."""

import math

import numpy as np
import pytest
from fit import _synthetic as synthetic

from gtao import fit
from gtao.errors import FitError
from gtao.fit import Samples, multibounce
from gtao.fit.moments import cluster_moments
from gtao.fit.solver import Solver

#: Escapes after the second bounce of a population of scenes: V (1 - V)(k0 + k1 V) with k scattered about these.
MEAN, SPREAD = np.array([0.7, -0.1]), 0.08

V = np.linspace(0.01, 0.99, 99)


def population(seed, n_scenes):
    generator = np.random.default_rng(seed)
    k = MEAN + SPREAD * generator.standard_normal((n_scenes, 2))
    return Samples.from_transports(
        [(f"s{i}", synthetic.exact(synthetic.four_parameter(V, (*k_i, 0.1, 0.0)))) for i, k_i in enumerate(k)]
    )


def noisy(n_scenes, seed=0, pixels=400, a=1.0):
    shares = [synthetic.spread(i, pixels, a=a + i / 3) for i in range(n_scenes)]
    return Samples.from_transports([(f"s{i}", synthetic.transport(t, 64, 8, seed + i)) for i, t in enumerate(shares)])


def test_intervals_cover_the_population():
    # All scenes have the same visibilities, so that the fit to infinitely many is the fit to their mean.
    repeats, level = 150, 0.95
    results = [
        multibounce(population(seed, 12), bounces=2, form="four_parameter", albedos=(0.4, 0.8), n_bootstrap=400)
        for seed in range(repeats)
    ]
    # With two bounces V' is linear in ρ: k0, k1 are the population's, k2 and k3 vanish.
    hits = [low <= MEAN[0] <= high for low, high in (r.fit.intervals[0] for r in results)]
    # Four standard deviations of the binomial share.
    assert np.mean(hits) == pytest.approx(level, abs=4 * math.sqrt(level * (1 - level) / repeats))
    errors = np.mean([r.fit.standard_errors[0] for r in results])
    spread = np.std([r.fit.coefficients[0] for r in results], ddof=1)
    # A standard deviation from 150 repeats is known to 1/sqrt(300), four times that allowed.
    assert errors == pytest.approx(spread, rel=4 / math.sqrt(300))


def test_resampling_is_of_scenes_where_there_are_three():
    result = multibounce(noisy(3), n_bootstrap=50)
    assert (result.clusters, result.n_clusters) == ("scenes", 3)
    assert result.covariance.shape == (6, 6)
    assert np.sqrt(np.diag(result.covariance)) == pytest.approx(result.fit.standard_errors)
    assert result.cubic_errors.shape == (7, 3)
    for value, (low, high) in zip(result.fit.coefficients, result.fit.intervals, strict=True):
        assert low <= value <= high


@pytest.mark.parametrize("n_scenes", [1, 2])
def test_below_three_scenes_blocks_of_pixels_are_resampled(n_scenes):
    result = multibounce(noisy(n_scenes), n_bootstrap=50)
    # 20 x 20 pixels in blocks of 3: 7 x 7 of them.
    assert (result.clusters, result.n_clusters) == ("pixel blocks", 49 * n_scenes)
    assert all(0 < e < 1 for e in result.fit.standard_errors)


def test_block_errors_are_those_of_independent_pixels():
    # Pixels of these scenes are independent: resampling blocks must find the spread over realisations.
    result = multibounce(noisy(1, 1, 1600), form="four_parameter", n_bootstrap=200)
    runs = []
    for seed in range(60):
        t = synthetic.transport(synthetic.spread(seed, 1600), 64, 8, seed)
        runs.append(multibounce(Samples.from_transports([("a", t)]), form="four_parameter", n_bootstrap=0).fit)
    spread = np.std([run.coefficients for run in runs], axis=0, ddof=1)
    # Spread from 60 runs: 1/sqrt(120); errors from 49 blocks: 1/sqrt(98); four standard deviations of both.
    assert result.fit.standard_errors == pytest.approx(spread, rel=4 * math.hypot(120**-0.5, 98**-0.5))


def test_seed_decides():
    s = noisy(4)
    first, again, other = (multibounce(s, n_bootstrap=50, seed=seed).fit for seed in (1, 1, 2))
    assert first == again
    assert first.standard_errors != other.standard_errors
    assert first.coefficients == other.coefficients


def test_level_widens_intervals():
    s = noisy(6)
    narrow, wide = (multibounce(s, n_bootstrap=400, level=level).fit for level in (0.5, 0.9))
    assert narrow.level == 0.5
    for (a, b), (c, d) in zip(narrow.intervals, wide.intervals, strict=True):
        assert c < a < b < d


def test_without_bootstrap_there_are_no_errors():
    result = multibounce(noisy(3), n_bootstrap=0)
    assert result.fit.standard_errors is None
    assert result.fit.intervals is None
    assert result.fit.level is None
    assert (result.clusters, result.n_clusters, result.covariance, result.cubic_errors) == ("nothing", 0, None, None)


@pytest.mark.parametrize("form", ["one_parameter", "two_parameter"])
def test_one_newton_step_is_nearly_the_whole_refit(form):
    s = noisy(8)
    moments = cluster_moments(s, 4, np.array(fit.REPORT_ALBEDOS))
    solver = Solver(form, ())
    weights = np.random.default_rng(1).multinomial(8, np.full(8, 1 / 8), 40).astype(float)
    theta = solver.solve(moments, np.ones((1, 8)))[0]
    whole, step = solver.solve(moments, weights), solver.resolve(moments, weights, theta)
    # Of second order in the spread that is being measured: a few hundredths of it. Gauss and Newton's step misses more.
    assert np.all(np.sqrt(np.mean((whole - step) ** 2, axis=0)) < 0.04 * whole.std(axis=0))
    assert step.std(axis=0) == pytest.approx(whole.std(axis=0), rel=0.02)
    assert whole.std(axis=0).min() > 1e-3


def test_undetermined_draws_are_counted_and_left_out():
    # One visibility per scene: a draw must hold two scenes at least, and all the same one comes up in 3/27.
    shares = [np.repeat(synthetic.sphere(np.array([v]), 4), 50, axis=1) for v in (0.25, 0.5, 0.75)]
    s = Samples.from_transports([(f"s{i}", synthetic.exact(t)) for i, t in enumerate(shares)])
    with pytest.raises(FitError, match=r"of 300 bootstrap draws do not determine .* n_bootstrap=0"):
        multibounce(s, bounces=2, form="four_parameter", n_bootstrap=300)
    s = Samples.from_transports([(f"s{i}", synthetic.exact(t)) for i, t in enumerate(shares * 2)])
    # All six drawn from one pair of twins: 3/3^6, in 2000 draws 8.
    result = multibounce(s, bounces=2, form="four_parameter", n_bootstrap=2000)
    assert 0 < result.n_failed < 30
