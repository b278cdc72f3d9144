"""Thickness heuristic: golden values and how the two readings differ."""

import numpy as np
import pytest
from oracles import golden

from gtao.kernels import thickness


def march(precision, cosines, tau, init, literal=False):
    """Horizon after a sequence of samples, each a float or one value per lane."""
    horizon, previous, tau = precision.Float(init), precision.Float(-1), precision.Float(tau)
    for c in cosines:
        c = precision.Float(c)
        horizon = thickness.from_previous(c, previous, horizon, tau) if literal else thickness.running(c, horizon, tau)
        previous = c
    return np.array(horizon, dtype=np.float64)


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("A.thickness"))
def test_thickness_golden(precision, inputs, outputs):
    assert march(precision, **inputs) == pytest.approx(outputs["running"], abs=precision.tolerance)
    literal = march(precision, **inputs, literal=True)
    assert literal == pytest.approx(outputs["eq9_previous_sample"], abs=precision.tolerance)
    for literal in (False, True):
        highest = march(precision, **(inputs | {"tau": 0.0}), literal=literal)
        assert highest == pytest.approx(outputs["no_heuristic"], abs=precision.tolerance)


def replay(cosines, tau, init):
    """Both readings in plain Python, with branches."""
    running = literal = init
    previous = -1.0
    for c in cosines:
        running = c if c >= running else (1 - tau) * running + tau * c
        literal = max(literal, c) if c >= previous else (1 - tau) * literal + tau * c
        previous = c
    return running, literal


def test_random_sequences_against_branches(precision):
    rng = np.random.default_rng(7)
    cosines, tau, init = rng.uniform(-1, 1, (12, 200)), rng.uniform(0, 1, 200), rng.uniform(-1, 1, 200)
    # Samples that float32 holds exactly: rounding must not choose another branch.
    cosines, init = np.float32(cosines).astype(np.float64), np.float32(init).astype(np.float64)
    want = np.array([replay(cosines[:, k], tau[k], init[k]) for k in range(200)])
    assert march(precision, cosines, tau, init) == pytest.approx(want[:, 0], abs=precision.tolerance)
    assert march(precision, cosines, tau, init, literal=True) == pytest.approx(want[:, 1], abs=precision.tolerance)
    assert (np.abs(want[:, 0] - want[:, 1]) > 0.1).sum() > 5


def test_a_low_sample_that_rises_from_its_predecessor_tells_the_readings_apart(precision):
    """0.9 and 0.1 leave both horizons at 0.5; 0.2 is below it but above 0.1."""
    sequence, tau = (0.9, 0.1, 0.2), 0.5
    assert march(precision, sequence, tau, -1.0) == pytest.approx(0.35, abs=precision.tolerance)
    assert march(precision, sequence, tau, -1.0, literal=True) == pytest.approx(0.5, abs=precision.tolerance)


def test_full_share_follows_the_last_sample(precision):
    assert march(precision, (0.9, 0.1, -0.4), 1.0, -1.0) == pytest.approx(-0.4, abs=precision.tolerance)
