"""Figures of a tuning show its numbers, and the report holds them all in one page."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from plot._pages import Checker

from gtao import fit, plot
from gtao.config import engines

RIVAL = "xegtao <3x3>"


def parameter(path, start, value, **changes):
    unit = fit.CONTINUOUS[path].unit
    return fit.TunedParameter(
        path=path, unit=unit, start=start, value=value, low=0.0, high=5.0, by="gradient", **changes
    )


def make(folds=True, n_candidates=3, error=0.01):
    unseen = np.array([0.08, 0.14, np.nan, 0.05]) if folds else np.full(4, np.nan)
    rmse = {
        "start": np.array([0.1, 0.2, 0.3, 0.06]),
        "tuned": np.array([0.07, 0.1, 0.2, 0.05]),
        "unseen": unseen,
        RIVAL: np.array([0.12, 0.13, 0.28, 0.09]),
    }
    parameters = (
        parameter("power", 2.2, 1.7, standard_error=error, interval=(1.6, 1.9)),
        parameter("falloff.start", 0.4, 0.0),
    )
    candidates = [
        fit.Candidate(choice={"n_steps": n}, taps=6 * n, loss=0.01 * n, values={}, n_evaluations=40, converged=True)
        for n in range(1, n_candidates + 1)
    ]
    return fit.TuningResult(
        method=engines.xegtao(),
        parameters=parameters,
        choice={"n_steps": 1},
        start_loss=0.04,
        loss=0.01,
        history=((1, 0.04, "start"), (5, 0.0225, "descent"), (9, 0.01, "search")),
        candidates=tuple(candidates),
        folds=(fit.Fold(left_out=("a",), choice={}, values={"power": 1.65}),) if folds else (),
        scores=fit.TuningScores(
            views=("a, 0", "b & c", "d", "e"),
            scenes=("a", "b", "d", "e"),
            held_out=np.array([False, False, False, True]),
            rmse=rmse,
            unfiltered={k: v + 0.01 for k, v in rmse.items()},
        ),
        n_evaluations=90,
        converged=True,
    )


def markers(axis, marker):
    return [line for line in axis.get_lines() if line.get_marker() == marker]


def test_the_descent_is_of_root_mean_squares():
    axis = plot.tuning_history(make()).axes[0]
    assert axis.get_lines()[0].get_ydata() == pytest.approx([0.2, 0.15, 0.1, 0.1])
    assert axis.get_lines()[0].get_xdata() == pytest.approx([1, 5, 9, 40])
    shown = {line.get_label(): line.get_ydata() for line in axis.get_lines()[1:]}
    assert shown == {"start": [0.2], "quasi-Newton steps": [0.15], "compass search": [0.1]}


def test_every_option_has_a_row_with_start_value_interval_and_folds():
    power, start = plot.tuning_parameters(make()).axes
    assert [line.get_xdata() for line in markers(power, "D")] == [[2.2]]
    assert [line.get_xdata() for line in markers(power, "o")] == [[1.7]]
    assert list(markers(power, "|")[0].get_xdata()) == [1.65]
    assert any(list(line.get_xdata()) == [1.6, 1.9] for line in power.get_lines())
    assert "share of falloff.end" in start.get_ylabel()
    # A fold whose combination has no such option shows nothing for it.
    assert len(markers(start, "|")[0].get_xdata()) == 0


def test_views_are_sorted_by_the_rival_with_held_out_ones_above():
    axis = plot.tuning_errors(make(), RIVAL).axes[0]
    assert [label.get_text() for label in axis.get_yticklabels()] == ["a, 0", "b & c", "d", "e"]
    circles = [(line.get_xdata()[0], line.get_markerfacecolor()) for line in markers(axis, "o")]
    # The third view was in every tuning, which its open circle says.
    assert [x for x, _ in circles] == [0.08, 0.14, 0.2, 0.05]
    assert [face == "white" for _, face in circles] == [False, False, True, False]
    assert [line.get_xdata()[0] for line in markers(axis, "D")] == [0.12, 0.13, 0.28, 0.09]
    gains = [line.get_color() for line in axis.get_lines() if len(line.get_xdata()) == 2 and line.get_alpha()]
    assert [colour == plot.style.REFIT for colour in gains] == [True, False, True, True]


def test_candidates_are_bars_with_their_errors_and_samples():
    axis = plot.tuning_candidates(make()).axes[0]
    assert [bar.get_width() for bar in axis.patches] == pytest.approx([0.1, 0.1 * 2**0.5, 0.1 * 3**0.5])
    assert [label.get_text() for label in axis.get_yticklabels()] == [
        "n_steps 1  (6 taps)",
        "n_steps 2  (12 taps)",
        "n_steps 3  (18 taps)",
    ]
    many = plot.tuning_candidates(make(n_candidates=30))
    assert "(6 more not shown)" in many.get_suptitle()


@pytest.mark.parametrize("result", [make(), make(folds=False, n_candidates=1)], ids=["all", "least"])
def test_the_page_is_whole_and_says_what_it_is_about(result):
    figures = plot.tuning_figures(result, RIVAL)
    assert all(isinstance(figure, Figure) for figure in figures.values())
    assert ("candidates" in figures) == (len(result.candidates) > 1)
    page = plot.tuning_report(result, RIVAL, record={"seed": 3})
    Checker().check(page, len(figures))
    assert "RMSE before" in page
    assert "0.2000" in page
    assert ("xegtao &lt;3x3&gt;" in page) == bool(result.folds)
    assert "(bound)" in page
    unseen = "1 of 2" if result.folds else "No view was left out"
    assert unseen in page
    assert '"seed": 3' in page.replace("&quot;", '"')


def test_differences_and_an_early_end_are_explained():
    result = make()
    assert "differences" not in plot.tuning_report(result, RIVAL)
    by = fit.TunedParameter(path="step_exponent", unit="", start=2.0, value=1.5, low=1.0, high=3.0, by="differences")
    other = fit.TuningResult(**{**vars(result), "parameters": (by,), "converged": False})
    page = plot.tuning_report(other, RIVAL)
    assert "have no usable derivative" in page
    assert "ended at its limit of rounds" in page
