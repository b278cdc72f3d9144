"""Figures of a comparison of specular occlusion show its numbers, and the report holds them all in one page."""

import numpy as np
import pytest
from plot._pages import Checker

from gtao import ShapeError, plot
from gtao.errors import ConfigError

TRACED, DENSE = "ray-traced visibility", "dense slices"
RNG = np.random.default_rng(2)
TRUTH = RNG.random((6, 8))
MASK = TRUTH > 0.2


def scene(name, **errors):
    methods = [
        plot.MethodResult(name=m, label=m, metrics={"rmse": e, "bias": -e}, group=group)
        for group in (TRACED, DENSE)
        for m, e in errors.items()
    ]
    return plot.SceneComparison(name=name, radius=1.0, truth=TRUTH, mask=MASK, methods=methods, noise=0.01)


def make(*, lit=True, steps=True):
    table = plot.Comparison(scenes=[scene("one", table=0.1, curve=0.2), scene("two", table=0.3, curve=0.4)])
    rows = {"table": 0.2, "curve": 0.3}
    view = {"frame": "one", "source": DENSE, "truth": TRUTH, "mask": MASK}
    colours = {"truth": TRUTH[..., None].repeat(3, -1), "images": {"table": np.full((6, 8, 3), 0.5)}}
    return plot.SpecularComparison(
        tables={"0.2": table, "0.5": table},
        means={TRACED: {"0.2": rows, "0.5": {"table": 0.15, "curve": 0.05}}, DENSE: {"0.2": rows, "0.5": rows}},
        steps={"0.2": {"a cone & more": 0.11}, "0.5": {"a cone & more": 0.07}} if steps else {"0.2": {}, "0.5": {}},
        cones={"0.04": {"30": rows, "90": rows}},
        lit={"vmf:4": {"0.5": table}} if lit else {},
        lit_means={"0.5": {"traced factors": {"two splits": 0.1}, TRACED: rows, DENSE: rows}} if lit else {},
        views=[plot.SpecularView(roughness=0.2, images={"table": TRUTH, "curve": 0.5 * TRUTH}, **view)],
        lit_views=[plot.LightingView(**view | colours, light="vmf:4, roughness 0.5")] if lit else [],
        shown=["table"],
        notes=["Left out: <none>."],
        command="gtao compare-specular one",
        versions={"gtao": "1 & 2"},
        record={"kind": "specular"},
    )


def test_curves_hold_every_number():
    figure = plot.specular_curves(make().means)
    assert [axis.get_title(loc="left") for axis in figure.axes] == [TRACED, DENSE]
    lines = {line.get_label(): line.get_xydata().tolist() for line in figure.axes[0].get_lines()}
    assert lines == {"table": [[0.2, 0.2], [0.5, 0.15]], "curve": [[0.2, 0.3], [0.5, 0.05]]}
    (only,) = plot.specular_curves(make().means, shown=["curve"]).axes[0].get_lines()
    assert only.get_label() == "curve"


def test_steps_hold_every_number():
    (line,) = plot.specular_steps(make().steps).axes[0].get_lines()
    assert line.get_xydata().tolist() == [[0.2, 0.11], [0.5, 0.07]]


def test_images_show_what_methods_miss():
    (view,) = make().views
    figure = plot.specular_images(view, limit=0.25)
    axes = figure.axes
    assert [axis.get_title(loc="left") for axis in axes[:3]] == ["ray-traced", "table", "curve"]
    shown = axes[5].images[0]
    assert shown.get_clim() == (-0.25, 0.25)
    assert np.ma.allclose(shown.get_array(), np.ma.masked_array(-0.5 * TRUTH, ~MASK))
    assert np.array_equal(np.ma.getmaskarray(shown.get_array()), ~MASK)
    root = np.sqrt(np.mean((0.5 * TRUTH[MASK]) ** 2))
    assert f"RMSE {root:.3f}" in axes[5].get_xlabel()
    grey = axes[0].images[0].get_array()
    assert len(np.unique(grey[~MASK].reshape(-1, 3), axis=0)) == 1


def test_the_report_holds_everything():
    comparison = make()
    figures = plot.specular_figures(comparison)
    assert set(figures) == {"methods", "steps", "lit", "one_0.2_dense-slices", "one_vmf-4-roughness-0.5"}
    page = plot.specular_report(comparison, figures=figures)
    Checker().check(page, len(figures))
    for word in (TRACED, "two splits", "<th>90</th>", "F0 = 0.04", "vmf:4, roughness 0.5", "Left out: &lt;none&gt;."):
        assert word in page, word
    assert "<span class=good>0.0500</span>" in page
    # Bars leave out the methods that curves do not show.
    labels = [label.get_text() for label in figures["lit"].axes[0].get_yticklabels()]
    assert labels == ["two splits", "table"]


def test_what_is_not_there_is_left_out():
    comparison = make(lit=False, steps=False)
    assert set(plot.specular_figures(comparison)) == {"methods", "one_0.2_dense-slices"}
    page = plot.specular_report(comparison)
    Checker().check(page, 2)
    assert "Under light" not in page
    assert "Where errors come from" not in page


def test_nothing_to_draw_is_told():
    with pytest.raises(ShapeError, match="no errors to draw"):
        plot.specular_curves({})
    with pytest.raises(ShapeError, match="no steps to draw"):
        plot.specular_steps({"0.2": {}})
    with pytest.raises(ShapeError, match="no image"):
        plot.specular_images(plot.SpecularView(
            frame="one", source=DENSE, roughness=0.2, truth=TRUTH, mask=MASK, images={}))  # fmt: skip
    with pytest.raises(ConfigError, match="no roughness"):
        plot.SpecularComparison(tables={}, means={}, steps={})
