"""Figures show what they are given, leave no state behind, and report it in one self-contained page."""

import math
import re
import subprocess
import sys

import matplotlib as mpl
import numpy as np
import pytest
from fit import _synthetic as synthetic
from matplotlib.figure import Figure
from plot._pages import Checker

import gtao
from gtao import fit, plot

ALBEDOS = (0.2, 0.5, 0.9)


def make(n_scenes, n_bootstrap=30, bounces=4.0, **kwargs):
    shares = [synthetic.spread(i, 300, a=0.7 + i / 2) for i in range(n_scenes)]
    names = ["<stairs & co>", "cloth", "pile", "city"]
    s = fit.Samples.from_transports(
        [(names[i], synthetic.transport(t, 64, 8, i)) for i, t in enumerate(shares)],
    )
    result = fit.multibounce(s, albedos=ALBEDOS, bounces=bounces, n_bootstrap=n_bootstrap, **kwargs)
    tables = {
        b: fit.compare_forms(s, b, albedos=ALBEDOS, include=result.settings)
        for b in dict.fromkeys((bounces, 4.0, math.inf))
    }
    return result, tables, fit.diagnose(s, result)


@pytest.fixture(scope="module")
def parts():
    return make(4)


def lines(axis):
    return {line.get_label(): line for line in axis.get_lines()}


def test_scatter_draws_samples_and_curves(parts):
    _, _, d = parts
    figure = plot.scatter(d)
    axes = figure.axes
    assert [a.get_title(loc="left") for a in axes[:3]] == ["albedo 0.2", "albedo 0.5", "albedo 0.9"]
    for r, axis in enumerate(axes[:3]):
        shown = lines(axis)
        for label, curve in (("refit", "refit"), ("published", "published"), ("integrating sphere", "closed form")):
            assert shown[label].get_ydata() == pytest.approx(d.curves[curve][r])
        image = axis.get_images()[0].get_array()
        # Rows of an image are V', columns V.
        assert image.shape == (d.density.shape[2], d.density.shape[1])
        assert np.ma.filled(image, 0) == pytest.approx(d.density[r].T)
    assert "4 bounces" in figure.get_suptitle()
    labels = [text.get_text() for text in axes[3].get_legend().get_texts()]
    assert labels == ["refit", "published", "integrating sphere", "V' = V"]


def test_coefficients_are_points_with_lines_through_them(parts):
    result, _, _ = parts
    figure = plot.coefficients(result)
    for j, axis in enumerate(figure.axes):
        shown = lines(axis)
        slope, intercept = result.fit.coefficients[2 * j : 2 * j + 2]
        assert shown["refit"].get_ydata() == pytest.approx([intercept, slope + intercept])
        slope, intercept = gtao.JIMENEZ2016.coefficients[2 * j : 2 * j + 2]
        assert shown["published"].get_ydata() == pytest.approx([intercept, slope + intercept])
        points, _, bars = axis.containers[0]
        assert points.get_ydata() == pytest.approx(result.cubics[:, j])
        half = [abs(s[1, 1] - s[0, 1]) / 2 for s in bars[0].get_segments()]
        assert half == pytest.approx(result.cubic_errors[:, j])


def test_residuals_have_a_panel_per_scene_and_a_line_per_albedo(parts):
    _, _, d = parts
    figure = plot.residuals(d)
    titles = [a.get_title(loc="left") for a in figure.axes[:4]]
    assert titles == list(d.scenes)
    for i, axis in enumerate(figure.axes[:4]):
        drawn = axis.get_lines()[1:]
        assert len(drawn) == 3
        for r, line in enumerate(drawn):
            assert np.ma.allclose(np.ma.masked_invalid(line.get_ydata()), d.residuals[i, :, r])


def test_comparison_shows_curves_and_difference(parts):
    _, _, d = parts
    left, right = plot.comparison(d).axes
    assert len(left.get_lines()) == 6
    assert lines(right)["0.9"].get_ydata() == pytest.approx(d.curves["refit"][2] - d.curves["published"][2])


def test_coverage_is_in_percent(parts):
    _, _, d = parts
    above, below = plot.coverage(d).axes[:2]
    assert [bar.get_height() for bar in above.patches] == pytest.approx(100 * d.coverage.mean(axis=0))
    assert np.asarray(below.get_images()[0].get_array()) == pytest.approx(100 * d.coverage)
    assert [t.get_text() for t in below.get_yticklabels()] == list(d.scenes)


def test_left_out_bars_are_the_table_sorted(parts):
    result, tables, _ = parts
    table, label = tables[4.0], result.settings.label
    axis = plot.left_out(table, label).axes[0]
    order = np.argsort(table["published"].rmse_per_scene)
    ours, published = axis.containers
    assert [b.get_width() for b in ours] == pytest.approx(np.array(table[label].rmse_per_scene)[order])
    assert [b.get_width() for b in published] == pytest.approx(np.array(table["published"].rmse_per_scene)[order])
    assert [t.get_text() for t in axis.get_yticklabels()] == [table.scenes[i] for i in order]
    names = [t.get_text() for t in axis.figure.legends[0].get_texts()]
    assert names == [label, "published", "four parameters", "one parameter"]
    marks = lines(axis)["four parameters"].get_xdata()
    assert marks == pytest.approx(np.array(table["four parameters"].rmse_per_scene)[order])


def test_forms_run_from_training_to_left_out_error(parts):
    result, tables, _ = parts
    table = tables[math.inf]
    axis = plot.forms(table, result.settings.label).axes[0]
    assert [t.get_text() for t in axis.get_yticklabels()][-1] == "published  (0)"
    spans = [line.get_xdata() for line in axis.get_lines() if len(line.get_xdata()) == 2][1:]
    assert spans == [pytest.approx([row.train_rmse, row.loso_rmse]) for row in table.rows[::-1]]


@pytest.mark.parametrize(
    ("n_scenes", "kwargs", "missing"),
    [
        (1, {"n_bootstrap": 0}, ()),
        (2, {"bounces": math.inf, "form": "one_parameter"}, ("coefficients",)),
        (4, {"constraints": ("unit_at_one", "energy"), "bounces": 3.0}, ()),
    ],
)
def test_every_kind_of_refit_can_be_drawn_and_reported(n_scenes, kwargs, missing):
    result, tables, d = make(n_scenes, **kwargs)
    figures = plot.refit_figures(result, tables, d)
    names = {"scatter", "comparison", "left_out", "residuals", "coverage", "coefficients"}
    assert set(figures) == (names | {f"forms_{b:g}" for b in tables}) - set(missing)
    assert all(isinstance(figure, Figure) for figure in figures.values())
    page = plot.refit_report(result, tables, d, figures=figures)
    Checker().check(page, n_images=len(figures))
    if n_scenes == 1:
        assert "There is no scene to leave out" in page
        assert "no standard errors" in page
    if n_scenes == 2:
        assert "There are too few scenes to resample" in page
        assert "geometric tail" in page
    if "constraints" in kwargs:
        assert "energy bound" in page


def test_report_says_what_was_found(parts):
    result, tables, d = parts
    record = {"command": "gtao refit <x>", "seed": 0}
    figures = plot.refit_figures(result, tables, d) | {"scenes": plot.visibility_image(np.eye(3))}
    page = plot.refit_report(
        result, tables, d, record=record, shader="return V < 1 ? f : V;", figures=figures, title="A & B"
    )
    Checker().check(page, n_images=9)
    assert "The scenes: visibility" in page
    assert "<title>A &amp; B</title>" in page
    assert "&lt;stairs &amp; co&gt;" in page
    assert "<stairs" not in page
    assert "return V &lt; 1" in page
    assert "gtao refit &lt;x&gt;" in page
    assert "prefers-color-scheme: dark" in page
    text = re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", page))
    for name, value in zip(result.fit.names, result.fit.coefficients, strict=True):
        assert f"{name} {value:.4f}".replace("-", "−") in text
    row = tables[4.0][result.settings.label]
    assert f"on {row.wins} of 4 scenes" in text
    for scene in row.lost:
        assert scene.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;") in text.split("It loses on")[1]
    for r in tables[math.inf].rows:
        assert f"{r.train_rmse:.4f}" in text


def test_figures_leave_the_users_settings_alone(parts):
    _, _, d = parts
    with mpl.rc_context({"font.size": 17.0, "axes.grid": False}):
        figure = plot.coverage(d)
        assert (mpl.rcParams["font.size"], mpl.rcParams["axes.grid"]) == (17.0, False)
    assert figure.axes[0].xaxis.label.get_size() == 9.0


def test_figures_show_themselves_and_are_the_same_each_time(parts):
    _, _, d = parts
    first, second = (plot.comparison(d)._repr_png_() for _ in range(2))
    assert first.startswith(b"\x89PNG")
    assert first == second
    assert first != plot.coverage(d)._repr_png_()
    assert plot.visibility_image(np.eye(3))._repr_png_().startswith(b"\x89PNG")


def test_no_window_system_is_loaded():
    code = (
        "import gtao.plot, sys, numpy as np; gtao.plot.visibility_image(np.eye(3)).savefig('/dev/null', format='png');"
        "sys.exit('matplotlib.pyplot' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
