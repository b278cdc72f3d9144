"""Attenuated and shortened searches against the slice search written out in NumPy.

With 256 steps over at most 45 pixels the estimator's samples are 0.2 pixels apart; on these smooth fields a missed
maximum between two samples and the border (half a gap short) stay below 0.004 per pixel.
"""

import numpy as np
import pytest
from analytic._frames import occlusion
from analytic._tables import MARCHED
from oracles import dense_slices

import gtao

TOLERANCE = 0.004
FIELDS = ("bumps from above", "waves, stretched pixels, off-centre")
OPTIONS = {"n_slices": 32, "n_steps": 256, "fetch": "linear", "noise": "none", "step_exponent": 1.0}


def check(name, oracle, **options):
    field = MARCHED[name]()
    image = occlusion(field, **OPTIONS, **options)
    free = occlusion(field, **OPTIONS)
    changed = 0
    for row, column in np.random.default_rng(8).integers(0, field.view_z.shape[0], (12, 2)):
        want = dense_slices.visibility(field, row, column, **oracle)
        assert image[row, column] == pytest.approx(want, abs=TOLERANCE)
        changed += abs(free[row, column] - want) > 2 * TOLERANCE
    return changed


@pytest.mark.parametrize("name", FIELDS)
def test_plain_search(name):
    check(name, {})


@pytest.mark.parametrize("name", FIELDS)
def test_linear_falloff(name):
    """clamp((end - d)/(end - start)) moves each sample's cosine toward the tangent plane of its side."""
    start, end = 0.1, 0.9
    oracle = {"weight": lambda d: np.clip((end - d) / (end - start), 0, 1)}
    assert check(name, oracle, falloff=gtao.LinearFalloff(start=start, end=end)) >= 4


@pytest.mark.parametrize("name", FIELDS)
def test_search_limited_in_pixels(name):
    assert check(name, {"max_px": 5.0}, max_radius_px=5.0) >= 4
