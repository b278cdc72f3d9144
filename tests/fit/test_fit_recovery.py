"""Known coefficients come back, noise in the regressor or not."""

import math

import numpy as np
import pytest
from fit import _synthetic as synthetic
from scipy import optimize

import gtao
from gtao import fit
from gtao.fit import Samples, multibounce

K = (0.8, -0.1, 0.9, -0.7)
#: The four-parameter truth without its ρ² part is a linear cubic: V + ρ V (1 - V)(k0 + k1 V).
CUBIC = (0.1, 0.0, -0.9, 0.0, 0.8, 1.0)

#: Counts of 2^24 paths round shares to 3e-8; normal matrices of nearly parallel cubics magnify that.
EXACT = 1e-4

#: Where SciPy's trust-region search stops: its gradient is numerical.
OPTIMUM = 2e-6


def scenes(make, n=3, pixels=512):
    """Shares of escape of scenes with different distributions of visibility."""
    shapes = [(1.0, 1.0), (0.8, 2.0), (2.0, 0.9), (1.5, 1.5)]
    return [make(np.random.default_rng(i).beta(*shapes[i % 4], pixels)) for i in range(n)]


def exact_samples(T, **kwargs):
    return Samples.from_transports([(f"s{i}", synthetic.exact(t, **kwargs)) for i, t in enumerate(T)])


def coarse_samples(T):
    """Exact counts of 512 paths a batch, whose visibilities lie on the lattice of the fit, and their shares."""
    s = exact_samples(T, paths=512)
    return s, [scene.escaped[0] / 512 for scene in s.scenes]


def noisy_samples(T, spp, seed, batches=8):
    return Samples.from_transports(
        [(f"s{i}", synthetic.transport(t, spp, batches, 1000 * seed + i)) for i, t in enumerate(T)]
    )


@pytest.mark.parametrize("constraints", [(), ("unit_at_one",)])
@pytest.mark.parametrize("procedure", ["joint", "two-step"])
def test_exact_cubic_comes_back(constraints, procedure):
    s = exact_samples(scenes(lambda V: synthetic.four_parameter(V, (*K[:2], 0, 0))))
    result = multibounce(s, bounces=3, constraints=constraints, procedure=procedure, n_bootstrap=0)
    assert result.fit.coefficients == pytest.approx(CUBIC, abs=EXACT)
    assert result.rmse == pytest.approx(0, abs=EXACT)
    assert result.fit.standard_errors is None


def test_exact_four_parameters_come_back():
    s = exact_samples(scenes(lambda V: synthetic.four_parameter(V, K)))
    result = multibounce(s, bounces=3, form="four_parameter", n_bootstrap=0)
    assert result.fit.coefficients == pytest.approx(K, abs=EXACT)
    assert result.fit.bounces == 3


@pytest.mark.parametrize(("form", "expected"), [("one_parameter", [1.0]), ("two_parameter", [1.0, 0.0])])
def test_integrating_sphere_gives_its_closed_form(form, expected):
    # Visibilities on the lattice of the fit. Beyond 40 bounces at most 0.7^40 = 6e-7 is left, most of it restored by
    # the tail.
    s = exact_samples(scenes(lambda V: synthetic.sphere(np.rint(np.clip(V, 0.3, 1) * 4096) / 4096, 40)))
    result = multibounce(s, bounces=math.inf, form=form, n_bootstrap=0)
    assert result.fit.coefficients == pytest.approx(expected, abs=1e-5)
    assert fit.compare_forms(s, math.inf)["sphere"].train_rmse == pytest.approx(0, abs=1e-5)
    assert fit.compare_forms(s, 4)["sphere, truncated"].train_rmse == pytest.approx(0, abs=1e-5)


def test_two_steps_and_one_are_the_same_fit():
    s = noisy_samples([synthetic.spread(i, 300, a=1 + i) for i in range(3)], 64, 0)
    for constraints in ((), ("unit_at_one",)):
        both = [
            multibounce(s, procedure=procedure, constraints=constraints, n_bootstrap=0).fit.coefficients
            for procedure in ("joint", "two-step")
        ]
        # Solutions of two linear systems with condition up to 1e5.
        assert both[0] == pytest.approx(both[1], abs=1e-9)


FORMULAS = {
    "linear_cubic": lambda k, V, p: (((k[0] * p + k[1]) * V + k[2] * p + k[3]) * V + k[4] * p + k[5]) * V,
    "four_parameter": lambda k, V, p: V + p * V * (1 - V) * (k[0] + k[1] * V + p * (k[2] + k[3] * V)),
    "one_parameter": lambda k, V, p: V / (1 - k[0] * p * (1 - V)),
    "two_parameter": lambda k, V, p: V / (1 - p * (1 - V) * (k[0] + k[1] * V)),
}


@pytest.mark.parametrize("form", sorted(FORMULAS))
@pytest.mark.parametrize("bounces", [2, 4])
def test_exact_data_give_scipys_least_squares(form, bounces):
    s, T = coarse_samples([synthetic.spread(i, 200, a=1 + i / 2, b=1.2) for i in range(3)])
    albedos = np.array([0.1, 0.4, 0.6, 0.9])
    result = multibounce(s, bounces=bounces, albedos=tuple(albedos), form=form, constraints=(), n_bootstrap=0)

    def residual(k):
        return np.concatenate(
            [
                (FORMULAS[form](k, t[0], p) - sum(p**j * t[j] for j in range(bounces))) / math.sqrt(t.shape[1])
                for t in T
                for p in albedos
            ]
        )

    oracle = optimize.least_squares(residual, 0.5 * np.ones(len(result.fit.coefficients)), xtol=1e-14, ftol=1e-14)
    assert result.fit.coefficients == pytest.approx(oracle.x, abs=OPTIMUM)
    if form != "linear_cubic":  # that one is scored with its max(V, …)
        assert result.rmse == pytest.approx(math.sqrt(2 * oracle.cost / 12), abs=1e-9)


def test_published_coefficients_are_scored_as_by_hand():
    s, T = coarse_samples([synthetic.spread(i, 200, a=1 + i / 2) for i in range(3)])
    albedos = (0.1, 0.5, 0.9)
    row = fit.compare_forms(s, 4, albedos=albedos)["published"]
    squares = np.zeros((3, 3))
    for i, t in enumerate(T):
        for r, p in enumerate(albedos):
            a, b, c = 2.0404 * p - 0.3324, -4.7951 * p + 0.6417, 2.7552 * p + 0.6903
            V = t[0]
            truth = t[0] + p * t[1] + p**2 * t[2] + p**3 * t[3]
            squares[i, r] = np.mean((np.maximum(V, ((a * V + b) * V + c) * V) - truth) ** 2)
    assert row.coefficients == gtao.JIMENEZ2016.coefficients
    assert row.train_rmse == row.loso_rmse == pytest.approx(math.sqrt(squares.mean()), abs=1e-12)
    assert row.rmse_per_scene == pytest.approx(np.sqrt(squares.mean(axis=1)), abs=1e-12)
    assert row.rmse_per_albedo == pytest.approx(np.sqrt(squares.mean(axis=0)), abs=1e-12)


def test_known_coefficients_within_their_standard_errors():
    # Eight batches of 16 paths; the bootstrap over scenes sees nothing but their noise, for they share one law.
    T = scenes(lambda V: synthetic.four_parameter(V, K), n=8, pixels=256)
    result = multibounce(noisy_samples(T, 128, 3), bounces=3, form="four_parameter")
    error = np.array(result.fit.coefficients) - K
    assert np.all(np.abs(error) < 3.5 * np.array(result.fit.standard_errors))
    assert np.all(np.array(result.fit.standard_errors) < 0.2)


@pytest.mark.parametrize(
    ("form", "spp"), [("linear_cubic", 16), ("linear_cubic", 128), ("four_parameter", 16), ("one_parameter", 128)]
)
def test_noise_in_visibility_does_not_bias(form, spp):
    T = [synthetic.spread(i, 1024, a=1 + i / 2) for i in range(3)]
    truth = np.array(multibounce(exact_samples(T), form=form, n_bootstrap=0).fit.coefficients)
    runs = [multibounce(noisy_samples(T, spp, seed), form=form, n_bootstrap=0) for seed in range(1, 25)]
    corrected = np.array([run.fit.coefficients for run in runs]) - truth
    naive = np.array([run.naive for run in runs]) - truth
    error = corrected.std(axis=0, ddof=1) / math.sqrt(len(runs))
    # The linear forms are unbiased exactly, the rational one to second order in 1/paths.
    assert np.all(np.abs(corrected.mean(axis=0)) < 4 * error)
    assert np.abs(naive.mean(axis=0) / error).max() > 8
