"""Cosine and sine of a part of a half turn."""

import numpy as np

from gtao.kernels import turns


def test_half_turn_over_its_range(precision):
    lanes = precision.lanes(np.linspace(0, 1, 2001))
    x = np.pi * np.array(lanes, dtype=np.float64)
    cosine, sine = (np.array(v, dtype=np.float64) for v in turns.half_turn(lanes))
    # A few units in the last place of 1.
    limit = 3 * np.finfo(precision.name).eps
    assert np.abs(cosine - np.cos(x)).max() <= limit
    assert np.abs(sine - np.sin(x)).max() <= limit
