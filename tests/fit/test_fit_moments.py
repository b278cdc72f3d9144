"""Moments and scores are free of the noise of the samples; written out with explicit loops they are the same."""

import itertools
import math

import numpy as np
import pytest
from fit import _synthetic as synthetic

from gtao.errors import FitError
from gtao.fit import Samples
from gtao.fit.moments import MIN_BATCHES, cluster_moments
from gtao.fit.scoring import score

ALBEDOS = np.array([0.3, 0.8])


def samples(T, spp=64, batches=8, seed=0, **kwargs):
    return Samples.from_transports([("a", synthetic.transport(T, spp, batches, seed))], **kwargs)


def shares(t):
    """Per batch and pixel: V and V' of three bounces at both albedos."""
    T = t.escaped / (t.spp // t.n_batches)
    return T[:, 0], np.einsum("rk,bkn->brn", ALBEDOS[:, None] ** np.arange(3), T[:, :3])


def test_moments_are_means_over_choices_of_different_batches():
    T = synthetic.spread(3, 5, 4)
    t = synthetic.transport(T, 48, 6, 4)
    x, y = shares(t)
    moments = cluster_moments(Samples.from_transports([("a", t)]), 3, ALBEDOS)
    for p in range(7):
        products = [
            math.prod(x[b, i] for b in chosen) for chosen in itertools.combinations(range(6), p) for i in range(5)
        ]
        assert moments.powers[0, p] == pytest.approx(np.mean(products), abs=1e-13)
    for r, p in itertools.product(range(2), range(4)):
        products = [
            y[b, r, i] * math.prod(x[c, i] for c in chosen)
            for b in range(6)
            for chosen in itertools.combinations([c for c in range(6) if c != b], p)
            for i in range(5)
        ]
        assert moments.cross[0, r, p] == pytest.approx(np.mean(products), abs=1e-13)
    pairs = [y[b, :, i] * y[c, :, i] for b, c in itertools.permutations(range(6), 2) for i in range(5)]
    assert moments.square[0] == pytest.approx(np.mean(pairs, axis=0), abs=1e-13)


def test_moments_have_no_bias_where_naive_ones_do():
    # One pixel, repeated: the means over many copies estimate powers and products of its known shares.
    T = np.repeat(np.array([[0.3], [0.25], [0.2], [0.1]]), 40000, axis=1)
    moments = cluster_moments(samples(T, spp=16), 4, ALBEDOS)
    V, target = 0.3, ALBEDOS[:, None] ** np.arange(4) @ T[:, 0]
    assert moments.powers[0] == pytest.approx(V ** np.arange(7), abs=4 * 0.12 / 200)
    assert moments.cross[0] == pytest.approx(target[:, None] * V ** np.arange(4), abs=4 * 0.12 / 200)
    # Var(V̂) = V(1 - V)/16 = 0.013, five times the tolerance above.
    assert moments.naive_powers[0, 2] - V**2 == pytest.approx(V * (1 - V) / 16, rel=0.1)


def test_score_of_visibility_itself_is_the_product_of_different_batches():
    t = synthetic.transport(synthetic.spread(5, 40, 4), 48, 6, 6)
    x, y = shares(t)
    difference = y - x[:, None]
    pairs = [difference[b] * difference[c] for b, c in itertools.permutations(range(6), 2)]
    expected = np.mean(pairs, axis=(0, 2))
    got = score(cluster_moments(Samples.from_transports([("a", t)]), 3, ALBEDOS), lambda V, rho: V + 0 * rho)
    assert got.mse[0] == pytest.approx(expected, abs=1e-12)
    assert got.bias[0] == pytest.approx((x[:, None] - y).mean(axis=(0, 2)), abs=1e-12)


def test_score_takes_the_noise_out():
    T = synthetic.spread(7, 20000, 4)
    truth = np.einsum("rk,kn->rn", ALBEDOS[:, None] ** np.arange(4), T)

    def function(V, rho):
        return V / (1 - 0.8 * rho * (1 - V))

    expected = np.mean((function(T[0], ALBEDOS[:, None]) - truth) ** 2, axis=1)
    t = synthetic.transport(T, 64, 8, 8)
    noisy_V = t.escaped[:, 0].sum(axis=0) / 64
    noisy = np.einsum("rk,kn->rn", ALBEDOS[:, None] ** np.arange(4), t.escaped.sum(axis=0) / 64)
    naive = np.mean((function(noisy_V, ALBEDOS[:, None]) - noisy) ** 2, axis=1)
    got = score(cluster_moments(Samples.from_transports([("a", t)]), 4, ALBEDOS), function).mse[0]
    # What the jackknife leaves is of order 1/paths² and below the sampling error of 20000 pixels, about 1 %.
    assert got == pytest.approx(expected, rel=0.03)
    assert np.all(np.abs(naive / expected - 1) > 0.08)


def test_a_regressor_is_taken_as_it_is():
    T = synthetic.spread(9, 400, 4)
    given = np.random.default_rng(1).uniform(0, 1, 400)
    t = synthetic.transport(T, 16, 2, 0)
    moments = cluster_moments(Samples.from_transports([("a", t)], regressors={"a": given}), 3, ALBEDOS)
    _, y = shares(t)
    assert moments.powers[0] == pytest.approx((given ** np.arange(7)[:, None]).mean(axis=1), abs=1e-13)
    assert moments.cross[0, :, 2] == pytest.approx((y.mean(axis=0) * given**2).mean(axis=1), abs=1e-13)
    expected = np.mean([(given - y[0]) * (given - y[1])], axis=(0, 2))
    # The regressor is rounded to 1/4096: an error of at most 1/8192 times twice the difference.
    assert score(moments, lambda V, rho: V + 0 * rho).mse[0] == pytest.approx(expected, abs=1e-4)


def test_clusters_add_up_to_their_scene():
    t = synthetic.transport(synthetic.spread(11, 60, 4), 64, 8, 0)
    s = Samples.from_transports([("a", t), ("b", synthetic.transport(synthetic.spread(12, 20, 4), 64, 8, 1))])
    whole = cluster_moments(s, 3, ALBEDOS)
    parts = cluster_moments(s, 3, ALBEDOS, labels=[np.arange(60) % 3, np.arange(20) % 2])
    assert parts.scene.tolist() == [0, 0, 0, 1, 1]
    for name in ("powers", "cross", "square", "naive_powers", "naive_cross"):
        summed = np.array([getattr(parts, name)[parts.scene == i].sum(axis=0) for i in (0, 1)])
        assert summed == pytest.approx(getattr(whole, name), abs=1e-13)
    for a, b in zip(parts.lattices, whole.lattices, strict=True):
        assert a.target[:3].sum(axis=0) == pytest.approx(b.target[0], abs=1e-13)


def test_flat_weights_do_what_they_say():
    # Three quarters of the pixels see 0.8, one quarter 0.2: flat weights make them equal.
    V = np.where(np.arange(400) % 4 == 0, 0.2, 0.8)
    T = np.array([V, 0.5 * (1 - V)])
    s = Samples.from_transports([("a", synthetic.exact(T))])
    assert cluster_moments(s, 2, ALBEDOS).powers[0, 1] == pytest.approx(0.65, abs=1e-6)
    assert cluster_moments(s, 2, ALBEDOS, uniform=True).powers[0, 1] == pytest.approx(0.5, abs=1e-6)


def test_flat_weights_do_not_conspire_with_noise():
    # All pixels see 0.5. Were weights and moments made from the same batches, rare outliers would be raised.
    T = np.repeat(np.array([[0.5], [0.5]]), 20000, axis=1)
    moments = cluster_moments(samples(T, spp=64), 2, ALBEDOS, uniform=True)
    assert moments.powers[0, 2] == pytest.approx(0.25, abs=4 * 0.12 / 100)
    assert moments.powers[0, 6] == pytest.approx(0.5**6, abs=4 * 0.05 / 100)


@pytest.mark.parametrize(("uniform", "batches"), [(False, MIN_BATCHES - 1), (True, MIN_BATCHES)])
def test_too_few_batches(uniform, batches):
    few = samples(synthetic.spread(1, 10, 4), spp=8 * batches, batches=batches)
    with pytest.raises(FitError, match=rf"'a' has {batches} batches .* at least {batches + 1} .* n_batches=8"):
        cluster_moments(few, 3, ALBEDOS, uniform=uniform)
