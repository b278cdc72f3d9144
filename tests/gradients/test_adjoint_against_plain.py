"""The adjoint of winning samples against plain differentiation of the whole march, which takes every sample along."""

import numpy as np
import pytest
from gradients._attached import CAMERAS, DEPTH, NORMALS, WEIGHTS, problem, pullback
from gradients._methods import MAXIMA

from gtao.estimators import occlusion

NAMES = (
    "nine slices, one step, uniform",
    "sphere",
    "sphere uniform",
    "linear falloff toward nadir",
    "sample cut",
    "depth cut, screen, not normalised",
    "no cut, optical axis",
    "linear fetch",
    "hbao",
)


@pytest.mark.parametrize("name", NAMES)
def test_equal_to_rounding(monkeypatch, name):
    values = {"view_z": DEPTH, "normal_v": NORMALS} | CAMERAS["perspective"]
    build = problem(MAXIMA[name])
    adjoint = pullback(build, values, WEIGHTS)
    calls = []

    def plain(job, max_pixels):
        calls.append(job)
        return job.march().mean(job.accumulator)

    monkeypatch.setattr(occlusion, "estimate", plain)
    for number, expected in pullback(build, values, WEIGHTS).items():
        assert np.abs(adjoint[number] - expected).max() <= 1e-10 * np.abs(expected).max(), number
    assert len(calls) == 1
