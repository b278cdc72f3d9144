"""The arrays behind the plots."""

import math

import numpy as np
import pytest
from fit import _synthetic as synthetic

import gtao
from gtao import fit


@pytest.fixture(scope="module")
def parts():
    shares = [synthetic.spread(i, 500, a=1 + 2 * i) for i in range(3)]
    s = fit.Samples.from_transports([(f"s{i}", synthetic.transport(t, 64, 8, i)) for i, t in enumerate(shares)])
    result = fit.multibounce(s, n_bootstrap=0, albedos=(0.3, 0.9))
    return s, result, fit.diagnose(s, result)


def test_curves_are_the_functions(parts):
    _, result, d = parts
    V = d.visibility
    assert (V[0], V[-1]) == (0, 1)
    assert d.curves["refit"][1] == pytest.approx(fit.evaluate(result.fit, V, 0.9))
    assert d.curves["published"][0] == pytest.approx(fit.evaluate(gtao.JIMENEZ2016, V, 0.3))
    assert d.curves["closed form"][1] == pytest.approx(V * sum((0.9 * (1 - V)) ** k for k in range(4)))


def test_closed_form_of_infinitely_many_bounces(parts):
    s, _, _ = parts
    d = fit.diagnose(s, fit.multibounce(s, bounces=math.inf, n_bootstrap=0))
    assert d.curves["closed form"][4] == pytest.approx(fit.evaluate(gtao.SPHERE, d.visibility, 0.5))


def test_shares_add_up(parts):
    s, _, d = parts
    assert d.density.sum(axis=(1, 2)) == pytest.approx([1, 1])
    assert d.coverage.sum(axis=1) == pytest.approx([1, 1, 1])
    # 64 paths: one cell of the density per level of V, the last holding two.
    V = s.scenes[0].visibility
    assert d.density.shape[1] == 64
    assert d.coverage[0, :4].sum() == pytest.approx(np.mean(V < 0.25))


def test_residuals_are_mean_errors_of_the_bins(parts):
    s, result, d = parts
    scene = s.scenes[1]
    V, target = scene.visibility, scene.target(4, [0.3, 0.9])
    inside = (d.bins[10] <= V) & (d.bins[11] > V)
    expected = (fit.evaluate(result.fit, V[inside], 0.9) - target[1, inside]).mean()
    assert d.residuals[1, 10, 1] == pytest.approx(expected)
    assert np.all(d.residuals.mask[..., 0] == (d.coverage < 0.002))
    assert d.residuals.mask.any()
    assert np.all(np.isfinite(d.residuals.data))
