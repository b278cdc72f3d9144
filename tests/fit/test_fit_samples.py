"""Path counts become visibility and multi-bounce visibility, and bad ones are refused in words."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from fit import _synthetic as synthetic

from gtao.errors import ConfigError, FitError, ShapeError
from gtao.fit import Samples

ALBEDOS = np.array([0.2, 0.9])


def counts(**changes):
    t = synthetic.transport(synthetic.spread(1, 30, 6), 64, 8, 2, width=6)
    return SimpleNamespace(**(vars(t) | changes))


def scene(**changes):
    return Samples.from_transports([("a", counts(**changes))]).scenes[0]


def test_visibility_is_the_share_of_paths_that_escape_at_once():
    t = counts()
    expected = [sum(int(t.escaped[b, 0, i]) for b in range(8)) / 64 for i in range(30)]
    assert scene().visibility == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize("bounces", [2, 4, 6])
def test_target_is_the_sum_over_bounces(bounces):
    t, got = counts(), scene().target(bounces, ALBEDOS)
    for r, rho in enumerate(ALBEDOS):
        for i in (0, 7, 29):
            expected = sum(rho ** (k - 1) * t.escaped[:, k - 1, i].sum() / 64 for k in range(1, bounces + 1))
            assert got[r, i] == pytest.approx(expected, abs=1e-14)


def test_batches_average_to_the_target():
    s = scene()
    assert s.batch_targets(math.inf, ALBEDOS).mean(axis=0) == pytest.approx(s.target(math.inf, ALBEDOS), abs=1e-14)


def test_without_absorption_all_light_arrives():
    assert scene().target(math.inf, [1.0]) == pytest.approx(np.ones((1, 30)), abs=1e-14)
    # Nothing at all gets out: the limit is still 1.
    closed = counts(escaped=np.zeros((8, 6, 30), int), remaining=np.full((8, 30), 8))
    trapped = Samples.from_transports([("a", closed)]).scenes[0]
    assert trapped.survival == 1
    assert trapped.target(math.inf, [1.0]) == pytest.approx(np.ones((1, 30)))
    assert trapped.target(math.inf, [0.9]) == pytest.approx(np.zeros((1, 30)))


def test_tail_is_exact_where_survival_is_geometric():
    # In an integrating sphere the tail is geometric from the start, with λ = 1 - V.
    V = np.full(4, 0.3)
    s = Samples.from_transports([("a", synthetic.exact(synthetic.sphere(V, 6)))]).scenes[0]
    rounding = 1 / synthetic.MANY
    assert s.survival == pytest.approx(0.7, abs=20 * rounding)
    expected = V / (1 - ALBEDOS[:, None] * (1 - V))
    assert s.target(math.inf, ALBEDOS) == pytest.approx(expected, abs=20 * rounding)
    assert s.tail(0.9) == pytest.approx((expected[1] - s.target(6, [0.9])[0])[0], abs=20 * rounding)
    assert s.tail(0.9) > 0.03


def test_survival_is_pooled_over_the_last_bounces():
    t = counts()
    inside = [int(t.escaped[:, k:].sum() + t.remaining.sum()) for k in range(7)]
    # A quarter of six bounces is two, to the nearest.
    assert scene().survival == pytest.approx((inside[5] + inside[6]) / (inside[4] + inside[5]))


def test_edges_can_be_dropped():
    t = counts()
    dropped = Samples.from_transports([("a", t)], edges="drop").scenes[0]
    assert dropped.pixel.tolist() == [i for i in range(30) if i % 3]
    assert dropped.visibility == pytest.approx(scene().visibility[~t.edge])


def test_regressor_by_pixel_and_as_an_image():
    pixel = np.array([1, 3, 4, *range(6, 33)])
    image = np.random.default_rng(3).uniform(-0.1, 1.1, (6, 6))
    flat = np.clip(image.ravel()[pixel], 0, 1)
    by_image = Samples.from_transports([("a", counts(pixel=pixel))], regressors={"a": image}).scenes[0]
    by_pixel = Samples.from_transports([("a", counts(pixel=pixel))], regressors={"a": flat}, edges="drop").scenes[0]
    assert by_image.visibility == pytest.approx(flat)
    assert by_pixel.visibility == pytest.approx(flat[np.arange(30) % 3 != 0])


@pytest.mark.parametrize(
    ("transports", "kwargs", "error", "message"),
    [
        ([], {}, FitError, "no scene"),
        ([("a", counts()), ("a", counts())], {}, ConfigError, "a came more than once"),
        ([("a", counts())], {"edges": "maybe"}, ConfigError, "'keep' or 'drop'"),
        ([("a", counts())], {"weights": {"b": 1}}, ConfigError, "no such scene: b; there are a"),
        ([("a", counts())], {"weights": {"a": 0}}, ConfigError, "weight of scene 'a' must be a positive"),
        ([("a", counts())], {"regressors": {}}, ConfigError, "regressors miss the scenes a"),
        ([("a", counts())], {"regressors": {"a": np.zeros(29)}}, ShapeError, r"shape \(29,\).* 30 valid pixels"),
        ([("a", counts())], {"regressors": {"a": np.full(30, np.nan)}}, ShapeError, "30 values .* NaN"),
        ([("a", counts(pixel=np.arange(29)))], {}, ShapeError, "pixel has shape"),
        ([("a", counts(remaining=np.zeros((8, 30), int)))], {}, ShapeError, "do not add up to 8"),
        ([("a", counts(escaped=np.zeros((8, 30), int)))], {}, ShapeError, r"escaped must be \(batches, bounces"),
        ([("a", counts(edge=np.ones(30, bool)))], {"edges": "drop"}, FitError, "no pixel off depth edges"),
        (
            [("a", counts(escaped=np.zeros((8, 6, 0)), remaining=np.zeros((8, 0)), pixel=np.zeros(0)))],
            {},
            FitError,
            "'a' has no valid pixel",
        ),
        (
            [("a", counts()), ("b", synthetic.transport(synthetic.spread(1, 30, 6), 128, 8, 2))],
            {},
            ConfigError,
            "same batches x paths, got 8 x 8, 8 x 16",
        ),
    ],
)
def test_refusals(transports, kwargs, error, message):
    with pytest.raises(error, match=message):
        Samples.from_transports(transports, **kwargs)
