"""Figures of errors show the numbers that they are given."""

import io
import math

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from plot._comparisons import budgets, scene

from gtao import evaluate, plot
from gtao.errors import ShapeError
from gtao.plot import style


def texts(figure):
    return [text.get_text() for axis in figure.axes for text in axis.texts]


def titles(figure):
    return [axis.get_title(loc="left") for axis in figure.axes if axis.get_title(loc="left")]


def saved(figure):
    """Layout and drawing must work too, not only the construction."""
    figure.savefig(io.BytesIO(), format="png")
    return figure


def test_zero_is_neutral_and_the_scale_is_the_same_on_both_sides():
    colours = style.SIGNED(np.linspace(0, 1, 257))[:, :3]
    assert to_hex(colours[128]) == "#f7f7f7"
    lightness = colours @ [0.2126, 0.7152, 0.0722]
    # Away from zero it only gets darker, to both sides, so that it reads without colour too.
    assert np.all(np.diff(lightness[128:]) < 0)
    assert np.all(np.diff(lightness[:129]) > 0)
    # Blue on one side, red on the other: the pair that the common colour blindnesses keep apart.
    assert np.all(colours[:100, 2] > colours[:100, 0])
    assert np.all(colours[-100:, 0] > colours[-100:, 2])


def test_images_are_on_one_scale_with_the_truth_first():
    s = scene()
    shown = {m.label: m.visibility for m in s.methods if m.visibility is not None}
    figure = saved(plot.comparison_images(s.truth, shown, mask=s.mask))
    assert [t.replace("\n", " ") for t in titles(figure)] == ["ray-traced truth", *shown]
    for axis, image in zip(figure.axes, [s.truth, *shown.values()], strict=False):
        expected = plot.visibility_image(np.where(s.mask, image, np.nan)).axes[0].get_images()[0].get_array()
        assert np.array_equal(axis.get_images()[0].get_array(), expected)


def test_error_maps_share_a_scale_and_their_sign():
    s = scene()
    shown = {m.label: m.visibility for m in s.methods if m.visibility is not None}
    figure = saved(plot.signed_error_maps(s.truth, shown, mask=s.mask, captions={"second & <best>": "here"}))
    errors = {label: np.where(s.mask, image - s.truth, np.nan) for label, image in shown.items()}
    absolute = np.abs(np.concatenate([e[s.mask] for e in errors.values()]))
    maps = [axis for axis in figure.axes if axis.get_images()]
    for axis, error in zip(maps, errors.values(), strict=False):
        image = axis.get_images()[0]
        assert image.get_clim() == (-np.percentile(absolute, 99), np.percentile(absolute, 99))
        assert image.get_cmap() is style.SIGNED
        assert np.array_equal(image.get_array().filled(np.nan), error, equal_nan=True)
    assert [axis.get_xlabel() for axis in maps[: len(shown)]].count("here") == 1
    fixed = plot.signed_error_maps(s.truth, shown, limit=0.07)
    assert fixed.axes[0].get_images()[0].get_clim() == (-0.07, 0.07)


def test_an_image_without_error_still_has_a_scale():
    truth = np.full((6, 8), 0.5)
    assert plot.signed_error_maps(truth, {"same": truth}).axes[0].get_images()[0].get_clim() == (-1, 1)


def test_budget_maps_are_the_steps_and_their_sum():
    budget = budgets()["first"]
    figure = saved(plot.error_budget_maps(budget, title="of one"))
    maps = [axis.get_images()[0].get_array() for axis in figure.axes if axis.get_images()][:4]
    assert titles(figure) == [*budget.names, "all together"]
    for shown, image in zip(maps, [*budget.images, np.sum(budget.images, axis=0)], strict=True):
        assert np.ma.allclose(shown, np.ma.masked_invalid(image))
    captions = [axis.get_xlabel() for axis in figure.axes][:4]
    assert captions[0].startswith(f"RMS {math.sqrt(budget.mean_squares[0]):.4f}, mean ")
    assert captions[3].startswith(f"RMS {math.sqrt(budget.total):.4f}, mean ")
    assert figure.get_suptitle() == "of one"


def test_a_single_step_has_no_sum():
    truth = np.zeros((6, 8))
    budget = evaluate.error_budget({"truth": truth, "only": truth + 0.1})
    assert titles(plot.error_budget_maps(budget)) == ["only"]


@pytest.mark.parametrize("name", ["first", "second"])
def test_budget_bars_stack_mean_squares_and_end_at_the_total(name):
    budget = budgets()[name]
    figure = saved(plot.error_budget_bar({name: budget}))
    axis = figure.axes[0]
    *steps, cross = axis.patches
    assert [bar.get_width() for bar in steps] == pytest.approx(list(budget.mean_squares))
    assert [bar.get_x() for bar in steps] == pytest.approx([0, *np.cumsum(budget.mean_squares)[:-1]])
    assert cross.get_hatch()
    assert cross.get_x() == pytest.approx(budget.mean_squares.sum())
    assert cross.get_width() == pytest.approx(budget.cross_terms)
    marks = [line.get_xdata() for line in axis.get_lines() if len(line.get_xdata()) == 2]
    assert any(np.allclose(mark, budget.total) for mark in marks)
    assert texts(figure) == [f"RMSE {math.sqrt(budget.total):.4f}"]
    assert (budget.cross_terms < 0) == (name == "first")


def test_budget_bars_show_mean_squares_below_zero():
    """Noise taken out of a step that is nothing but noise."""
    noise = np.random.default_rng(0).standard_normal((20, 20)) * 0.1
    step = np.full((20, 20), 0.3)
    budget = evaluate.error_budget({"truth": 0 * step, "step": step, "noise": step + noise}, variances={"noise": 0.02})
    assert budget.mean_squares[1] < 0
    first, second, cross = plot.error_budget_bar({"x": budget}).axes[0].patches
    assert first.get_x() == second.get_x() == 0
    assert second.get_width() == pytest.approx(budget.mean_squares[1])
    assert cross.get_x() == pytest.approx(budget.mean_squares.sum())
    assert cross.get_x() + cross.get_width() == pytest.approx(budget.total)


def test_a_step_has_one_colour_in_all_bars():
    figure = plot.error_budget_bar(budgets())
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names == ["depth layer", "samples", "heuristic", "cross terms, up to the total"]
    colours = [to_hex(patch.get_facecolor()) for patch in figure.legends[0].get_patches()[:3]]
    assert len(set(colours)) == 3
    drawn = [to_hex(patch.get_facecolor()) for patch in figure.axes[0].patches]
    assert drawn[:3] == drawn[4:7] == colours


def test_deviations_are_a_waterfall():
    walks = {"engine": [("published", 0.10), ("worse", 0.13), ("better", 0.08)], "alone": [("published", 0.05)]}
    figure = saved(plot.deviation_bars(walks, limit=0.06))
    assert titles(figure) == ["engine", "alone"]
    axis = figure.axes[0]
    spans = [(bar.get_x(), bar.get_x() + bar.get_width()) for bar in axis.patches]
    assert spans == [pytest.approx(s) for s in [(0, 0.10), (0.10, 0.13), (0.13, 0.08), (0, 0.08)]]
    colours = [to_hex(bar.get_facecolor()).upper() for bar in axis.patches]
    assert colours[1:3] == [style.PUBLISHED, style.REFIT]
    assert [t.get_text() for t in axis.get_yticklabels()] == ["published", "worse", "better", "engine"]
    assert [t.get_text() for t in axis.texts] == ["0.1000", "+0.0300", "−0.0500", "0.0800"]
    assert axis.yaxis_inverted()
    assert [bar.get_width() for bar in figure.axes[1].patches] == [0.05]
    assert any(np.allclose(line.get_xdata(), 0.06) for line in figure.axes[1].get_lines())


def test_error_against_samples():
    curves = {"a": [(54, 0.02), (6, 0.08), (18, 0.04)], "b": [(18, 0.3)]}
    figure = saved(plot.error_against_samples(curves, noise=0.01, limit=0.03, ours=["a"]))
    axis = figure.axes[0]
    shown = {line.get_label(): line for line in axis.get_lines()}
    assert shown["a"].get_xydata().tolist() == [[6, 0.08], [18, 0.04], [54, 0.02]]
    assert (axis.get_xscale(), axis.get_yscale()) == ("log", "log")
    assert shown["a"].get_linewidth() > shown["b"].get_linewidth()
    assert texts(figure) == ["noise of the truth", "limit of one depth layer"]
    assert [line.get_ydata()[0] for line in axis.get_lines()[:2]] == [0.01, 0.03]
    assert axis.get_ylim()[0] < 0.01 < 0.3 < axis.get_ylim()[1]
    assert texts(plot.error_against_samples(curves, noise=0.0)) == []
    # A floor far below would squeeze the curves: it is named, and nothing makes room for it.
    far = plot.error_against_samples(curves, noise=0.004)
    assert texts(far) == ["↓ noise of the truth 0.0040"]
    assert far.axes[0].get_ylim()[0] > 0.01
    assert len(far.axes[0].get_lines()) == 2


@pytest.mark.parametrize(("low", "high"), [(0.011, 0.013), (0.004, 0.2), (1e-4, 3.0), (18, 18)])
def test_logarithmic_axes_have_numbers_to_read(low, high):
    figure = saved(plot.error_against_samples({"a": [(18, low), (20, high)]}))
    axis = figure.axes[0]
    inside = [t for t in axis.get_yticks() if axis.get_ylim()[0] <= t <= axis.get_ylim()[1]]
    assert 1 <= len(inside) <= 9
    labels = [t.get_text() for t in axis.get_yticklabels()]
    assert all(labels)
    assert len(set(labels)) == len(labels)


def test_error_against_time_takes_points_and_series():
    figure = saved(plot.error_against_time({"one": (2.0, 0.1), "two": [(3.0, 0.05), (1.0, 0.2)]}))
    one, two = figure.axes[0].get_lines()
    assert one.get_xydata().tolist() == [[2.0, 0.1]]
    assert two.get_xydata().tolist() == [[1.0, 0.2], [3.0, 0.05]]
    assert "milliseconds" in figure.axes[0].get_xlabel()


def test_many_methods_are_told_apart():
    styles = style.method_styles([str(i) for i in range(24)])
    looks = {(s["color"], s["marker"], str(s["linestyle"])) for s in styles.values()}
    assert len(looks) == 24


def test_strata_are_lines_over_bins():
    s = scene()
    figure = saved(plot.stratified_errors(s.strata, ours=["second & <best>"]))
    quantities = list(evaluate.STRATA_EDGES)
    assert titles(figure) == quantities
    above, below = figure.axes[: len(quantities)], figure.axes[len(quantities) :]
    for axis, lower, quantity in zip(above, below, quantities, strict=False):
        for line, bias, tables in zip(axis.get_lines(), lower.get_lines(), s.strata.values(), strict=False):
            assert np.array_equal(line.get_ydata(), tables[quantity].corrected_rmse, equal_nan=True)
            assert np.array_equal(bias.get_ydata(), tables[quantity].bias, equal_nan=True)
        noise = next(line for line in axis.get_lines() if line.get_label() == "noise of the truth")
        assert np.array_equal(noise.get_ydata(), s.strata["first"][quantity].noise, equal_nan=True)
        assert axis.get_ylim()[0] == 0
        top = np.nanmax([tables[quantity].rmse for tables in s.strata.values()])
        assert axis.get_ylim()[1] >= top
    table = s.strata["first"]["tilt"]
    labels = [t.get_text() for t in below[0].get_xticklabels()]
    assert labels[0] == f"0–15\n{100 * table.count[0] / table.count.sum():.0f} %"
    assert below[3].get_xticklabels()[-1].get_text().startswith("≥16")


IMAGE = np.zeros((4, 5))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: plot.signed_error_maps(IMAGE, {}), "no error map"),
        (lambda: plot.signed_error_maps(IMAGE, {"a": IMAGE[1:]}), r"image \(3, 5\), truth \(4, 5\)"),
        (lambda: plot.comparison_images(IMAGE, {"a": IMAGE[1:]}), "different shapes"),
        (lambda: plot.error_budget_bar({}), "no error budget"),
        (lambda: plot.deviation_bars({}), "no deviations"),
        (lambda: plot.deviation_bars({"engine": []}), "no deviations"),
        (lambda: plot.error_against_samples({}), "at least one point"),
        (lambda: plot.error_against_samples({"a": [(0, 0.1)]}), "positive"),
        (lambda: plot.error_against_time({"a": (1.0, math.nan)}), "finite"),
        (lambda: plot.stratified_errors({}), "nothing to draw"),
        (lambda: plot.stratified_errors({"a": {}}), "nothing to draw"),
    ],
)
def test_refusals(call, message):
    with pytest.raises(ShapeError, match=message):
        call()


def test_strata_with_other_edges_are_refused():
    by, edges = {"q": IMAGE}, ({"q": (0, 1)}, {"q": (0, 2)})
    tables = [evaluate.stratify(IMAGE, IMAGE, by=by, edges=e) for e in edges]
    with pytest.raises(ShapeError, match="b has other edges of q"):
        plot.stratified_errors({"a": tables[0], "b": tables[1]})


def test_all_are_figures_that_show_themselves():
    figure = plot.error_budget_bar(budgets())
    assert isinstance(figure, Figure)
    assert figure._repr_png_().startswith(b"\x89PNG")
