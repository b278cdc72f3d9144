"""The comparison of forms: left-out errors by hand, wins, floors, and what single scenes leave."""

import json
import math

import numpy as np
import pytest
from fit import _synthetic as synthetic

from gtao import fit
from gtao.errors import FitError
from gtao.fit import FitSettings, Samples, compare_forms, multibounce
from gtao.fit.moments import cluster_moments
from gtao.fit.scoring import score_fit
from gtao.fit.validation import CANDIDATES

ALBEDOS = (0.2, 0.6, 0.9)


def transports(n=4, pixels=400):
    shapes = [(1.0, 1.0), (0.7, 2.0), (2.5, 0.8), (1.5, 1.5)]
    return [
        (f"s{i}", synthetic.transport(synthetic.spread(i, pixels, a=shapes[i % 4][0], b=shapes[i % 4][1]), 64, 8, i))
        for i in range(n)
    ]


@pytest.fixture(scope="module")
def table():
    return compare_forms(Samples.from_transports(transports()), 4, albedos=ALBEDOS)


def test_rows(table):
    labels = [row.label for row in table.rows]
    assert labels[0] == fit.PUBLISHED
    assert labels[-1] == fit.FLOOR
    assert labels[1 : 1 + len(CANDIDATES)] == [
        "linear cubic, f(1) = 1",
        "linear cubic, f(1) = 1, two-step",
        "linear cubic, free",
        "linear cubic, free, two-step",
        "four parameters",
        "one parameter",
        "two parameters",
    ]
    assert [table[label].n_parameters for label in labels] == [0, 4, 4, 6, 6, 4, 1, 2, 0, 0, 96]
    assert labels[8:10] == ["sphere, truncated", "sphere"]
    assert table["sphere, truncated"].coefficients == (4.0,)


@pytest.mark.parametrize(
    ("label", "form", "procedure"),
    [
        ("linear cubic, f(1) = 1", "linear_cubic", "joint"),
        ("linear cubic, f(1) = 1, two-step", "linear_cubic", "two-step"),
        ("two parameters", "two_parameter", "joint"),
    ],
)
def test_left_out_errors_by_hand(table, label, form, procedure):
    every = transports()
    settings = {"albedos": ALBEDOS, "form": form, "procedure": procedure, "n_bootstrap": 0}
    mse, biases = [], []
    for left in range(4):
        rest = Samples.from_transports([t for i, t in enumerate(every) if i != left])
        alone = Samples.from_transports([every[left]])
        found = multibounce(rest, **settings).fit
        errors = score_fit(cluster_moments(alone, 4, np.array(ALBEDOS)), found)
        mse.append(errors.mse[0])
        biases.append(errors.bias[0])
    row = table[label]
    # Rational fits stop where the objective is flat to rounding, √1e-16 from the optimum and further where it is long.
    within = 1e-6 if form == "two_parameter" else 1e-9
    assert row.rmse_per_scene == pytest.approx(np.sqrt(np.mean(mse, axis=1)), abs=within)
    assert row.rmse_per_albedo == pytest.approx(np.sqrt(np.mean(mse, axis=0)), abs=within)
    assert row.loso_rmse == pytest.approx(math.sqrt(np.mean(mse)), abs=within)
    assert row.bias == pytest.approx(np.mean(biases), abs=within)
    whole = multibounce(Samples.from_transports(every), **settings)
    assert row.coefficients == pytest.approx(whole.fit.coefficients, abs=within)
    assert row.train_rmse == pytest.approx(whole.rmse, abs=within)


def test_wins_and_differences(table):
    published = np.array(table[fit.PUBLISHED].rmse_per_scene)
    some_win, some_lose = False, False
    for row in table.rows[1:]:
        change = np.array(row.rmse_per_scene) - published
        assert row.wins == np.sum(change < 0) == 4 - len(row.lost)
        assert row.lost == tuple(np.array(table.scenes)[change >= 0])
        assert row.difference == pytest.approx(change.mean())
        assert row.difference_error == pytest.approx(change.std(ddof=1) / 2)
        some_win |= row.wins > 0
        some_lose |= bool(row.lost)
    assert some_win
    assert some_lose
    assert table[fit.PUBLISHED].difference is None
    assert (table[fit.PUBLISHED].wins, table[fit.PUBLISHED].lost) == (0, ())


def test_the_mean_given_visibility_is_below_every_form(table):
    floor = table[fit.FLOOR]
    assert all(floor.train_rmse < row.train_rmse for row in table.rows[:-1])
    assert floor.loso_rmse > floor.train_rmse


def test_floor_is_zero_where_visibility_says_all():
    # One law for all scenes, and linear in V, so that the bins' straight lines have no error either.
    shares = [np.array([v, 0.5 * (1 - v)]) for v in (np.linspace(0, 1, 513), np.linspace(0, 1, 257))]
    s = Samples.from_transports([(f"s{i}", synthetic.exact(t, paths=512)) for i, t in enumerate(shares)])
    row = compare_forms(s, 2, albedos=ALBEDOS)[fit.FLOOR]
    # T_2 is rounded to 1/512, and outside the means of the outermost bins the line is level for half a bin.
    assert row.loso_rmse < 2e-3


def test_infinite_bounces_have_no_truncated_sphere():
    table = compare_forms(Samples.from_transports(transports(3, 100)), math.inf, albedos=ALBEDOS)
    assert "sphere, truncated" not in [row.label for row in table.rows]
    assert table.to_dict()["bounces"] == "inf"


def test_the_headline_fit_gets_a_row():
    s = Samples.from_transports(transports(3, 100))
    energy = FitSettings(constraints=("unit_at_one", "energy"))
    table = compare_forms(s, 4, include=energy)
    assert table.rows[1].label == energy.label == "linear cubic, f(1) = 1, energy bound"
    assert len(compare_forms(s, 4, include=FitSettings()).rows) == len(table.rows) - 1


def test_a_single_scene_has_nothing_to_leave_out():
    table = compare_forms(Samples.from_transports(transports(1)), 4)
    for row in table.rows:
        assert row.train_rmse > 0
        assert row.loso_rmse is row.rmse_per_scene is row.difference is None
    assert "–" in table._repr_html_()


def few_visibilities(*scenes):
    shares = [np.repeat(synthetic.sphere(np.array(values), 4), 50, axis=1) for values in scenes]
    return Samples.from_transports([(f"s{i}", synthetic.exact(t, paths=512)) for i, t in enumerate(shares)])


def test_a_form_that_needs_every_scene_has_no_left_out_error():
    # A free cubic wants three visibilities; with f(1) = 1 two will do.
    table = compare_forms(few_visibilities((0.25, 0.5), (0.75, 0.875)), 2)
    assert table["linear cubic, free"].loso_rmse is None
    assert table["linear cubic, free"].train_rmse < 0.05
    assert table["linear cubic, f(1) = 1"].loso_rmse > 0


def test_a_form_that_the_scenes_do_not_determine_is_named():
    with pytest.raises(FitError, match="linear cubic, free: the data do not determine"):
        compare_forms(few_visibilities((0.25,), (0.75,)), 2)


def test_table_goes_into_a_record_and_a_notebook(table):
    values = json.loads(json.dumps(table.to_dict()))
    assert values["bounces"] == 4
    assert values["rows"][1]["loso_rmse"] == table.rows[1].loso_rmse
    page = table._repr_html_()
    for row in table.rows:
        assert f"{row.loso_rmse:.4f}" in page
    assert f"{table.rows[1].wins} of 4" in page


def test_result_goes_into_a_record_and_a_notebook():
    result = multibounce(Samples.from_transports(transports(3, 100)), bounces=math.inf, n_bootstrap=20)
    values = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert values["settings"]["bounces"] == "inf"
    assert list(values["coefficients"]) == ["a1", "a0", "b1", "b0", "c1", "c0"]
    assert values["standard_errors"]["a1"] == result.fit.standard_errors[0]
    assert values["tail"].keys() == {"s0", "s1", "s2"}
    assert all(tail > 0 for tail in values["tail"].values())
    assert np.array(values["rmse_per_scene_and_albedo"]).shape == (3, 7)
    assert "refit on 3 scenes, 64 paths per pixel" in result._repr_html_()
