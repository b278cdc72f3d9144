"""The report of a comparison: what it says, in which order, and that it stands alone."""

import io
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image
from plot._comparisons import images, scene
from plot._pages import Checker

from gtao import plot
from gtao.errors import ConfigError, ShapeError
from gtao.plot import style, viewer
from gtao.plot.comparing import scene_figure
from gtao.plot.comparison_tables import summary_rows

NEUTRAL = [int(style.NO_VALUE[i : i + 2], 16) for i in (1, 3, 5)]
#: For a scene of which only tables and images are looked at.
NO_FIGURES = {"budgets": {}, "curves": {}, "deviations": {}, "strata": {}}
KINDS = ("images", "errors", "budget", "budget_maps", "samples", "time", "deviations", "strata")


def comparison(n=2, **changes):
    scenes = [scene(name, seed) for seed, name in enumerate(("hall", "<attic> & co", "yard")[:n])]
    options = {"command": "gtao compare <x> -o y", "versions": {"Dr.Jit": "1.2.3"}, "record": {"seed": 7}}
    return plot.Comparison(scenes=scenes, **(options | changes))


@pytest.fixture(scope="module")
def page():
    return plot.compare_report(comparison())


def text_of(page):
    return re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", re.sub(r"<(style|script)>.*?</\1>", "", page, flags=re.DOTALL)))


def pixels(png):
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))


def test_the_page_stands_alone(page):
    # Per scene: two pictures of the slider, the truth, three images, three errors, six figures; one overview.
    Checker().check(page, n_images=2 * (2 + 1 + 6 + 6) + 1, scripts=1)
    assert "prefers-color-scheme: dark" in page


def test_names_are_escaped(page):
    assert "<attic>" not in page
    assert "<best>" not in page
    assert "gtao compare &lt;x&gt; -o y" in page
    assert "&lt;attic&gt; &amp; co" in page


def test_it_says_what_was_measured(page):
    text, s = text_of(page), scene()
    assert "3 methods on 2 scenes" in text
    for m in s.methods:
        assert f"{m.metrics['rmse']:.4f}" in text
        assert f"{m.metrics['bias']:+.4f}".replace("-", "−") in text
        assert m.settings in text
    assert f"noise of the truth {s.noise:.4f}" in text
    assert "limit of one depth layer 0.0500" in text
    assert "occluders within 0.5" in text
    assert "One note." in text
    assert "Dr.Jit 1.2.3" in text
    assert "&quot;seed&quot;: 7" in text
    assert (
        text_of(plot.compare_report(plot.Comparison(scenes=[scene(radius=np.inf, **NO_FIGURES)]))).count("any distance")
        == 1
    )


def test_rows_are_sorted_by_error_in_every_table(page):
    tables = re.findall(r"<table>.*?</table>", page, re.DOTALL)
    sorted_tables = 0
    for table in tables:
        errors = [float(x) for x in re.findall(r"</s>(\d\.\d{4})</div>", table)]
        assert errors == sorted(errors)
        sorted_tables += len(errors) == 3
    # Two groups: over all scenes, and on each of two.
    assert sorted_tables == 6
    first = tables[0].index("second &amp; &lt;best&gt;")
    assert first < tables[0].index("third")
    assert "<tr class='ours'><td>first" in tables[0]


def test_a_method_that_misses_a_scene_comes_last():
    full, part = scene("a", **NO_FIGURES), scene("b", 1)
    part = scene("b", 1, methods=[m for m in part.methods if not m.name.startswith("second")], **NO_FIGURES)
    c = plot.Comparison(scenes=[full, part])
    rows = summary_rows(c, "own defaults")
    assert [row.label for row in rows] == ["first", "third", "second & <best>"]
    assert [row.complete for row in rows] == [True, True, False]
    assert [row.lowest for row in rows] == [1, 0, 1]
    assert rows[2].rmse == full.methods[1].metrics["rmse"]
    expected = np.mean([s.methods[0].metrics["rmse"] for s in (full, part)])
    assert rows[0].rmse == pytest.approx(expected)
    assert "(1 of 2 scenes)" in text_of(plot.compare_report(c))


def test_what_was_not_measured_is_not_shown():
    bare = [plot.MethodResult(name="only", label="only", metrics={"rmse": 0.25})]
    c = plot.Comparison(scenes=[scene(methods=bare, noise=None, limit_rmse=None, notes=(), **NO_FIGURES)])
    assert plot.comparison_figures(c) == {}
    page = plot.compare_report(c)
    Checker().check(page, n_images=0, scripts=1)
    text = text_of(page)
    for word in ("SSIM", "taps", "noise of the truth", "How to repeat", "each scene", "Settings"):
        assert word not in text
    assert "0.2500" in text


def test_figures_have_names_for_files():
    c = comparison()
    figures = plot.comparison_figures(c)
    slug = "-attic-co"
    assert set(figures) == {f"{s}_{kind}" for s in ("hall", slug) for kind in KINDS} | {"budget_first"}
    assert all(isinstance(figure, Figure) for figure in figures.values())
    assert plot.compare_report(c, figures=figures) == plot.compare_report(c)
    # The library's own method has the maps, wherever it stands.
    turned = scene(budgets=dict(reversed(c.scenes[0].budgets.items())))
    for figure in (figures["hall_budget_maps"], scene_figure(turned, "budget_maps")):
        assert "of first" in figure.get_suptitle()


def test_given_figures_are_shown():
    c = comparison(1)
    other = plot.visibility_image(np.eye(5))
    page = plot.compare_report(c, figures={"hall_samples": other})
    source = viewer.data_uri(style.png_bytes(other, dpi=130))
    assert source in page
    assert source not in plot.compare_report(c)


def test_many_scenes_show_the_best_images_only(monkeypatch):
    monkeypatch.setattr("gtao.plot.comparison_report._IMAGES", 2)
    monkeypatch.setattr("gtao.plot.comparison_report._FEWEST_IMAGES", 1)
    hall, yard = scene(**NO_FIGURES), scene("yard", **NO_FIGURES)
    page = plot.compare_report(plot.Comparison(scenes=[hall]))
    # Ours always, then by error.
    cards = re.findall(r"<figcaption><b>(.*?)</b>", page)
    assert cards == ["ray-traced truth", "second &amp; &lt;best&gt;", "first"]
    assert "The 2 best of 3 methods" in text_of(page)
    page = plot.compare_report(plot.Comparison(scenes=[hall, yard]))
    assert re.findall(r"<figcaption><b>(.*?)</b>", page)[1::2] == ["first", "first"]


def test_the_slider_starts_with_ours_against_the_truth():
    truth, mask, estimates = images()
    page = viewer.viewer(truth, estimates, mask=mask, ours="third")
    alts = re.findall(r'alt="(.*?)"', page)
    assert alts[int(re.search(r"data-start=(\d+)", page)[1])] == "third"
    assert alts[0] == "ray-traced truth"
    assert page.count("class='card mine'") == 1
    assert "data-start=1 " in viewer.viewer(truth, estimates)


def test_labels_that_occur_twice_are_told_apart():
    s = scene()
    again = [plot.MethodResult(**(vars(m) | {"group": "again"})) for m in s.methods if m.visibility is not None]
    page = plot.compare_report(plot.Comparison(scenes=[scene(methods=[*s.methods, *again], **NO_FIGURES)]))
    cards = re.findall(r"<figcaption><b>(.*?)</b>", page)
    assert "third, again" in cards
    assert "third, own defaults" in cards
    assert len(set(cards)) == len(cards) == 7


def test_small_images_hold_what_they_show():
    visibility = np.array([[0.0, 0.5, 1.0], [2.0, -1.0, np.nan]])
    shown = pixels(viewer.visibility_png(visibility))
    # 254 steps of grey: 0.5 is 0.7354 of the way in sRGB.
    assert shown[0, :, 0].tolist() == [0, round(255 * round(254 * 0.7354) / 254), 255]
    assert shown[1].tolist() == [[255, 255, 255], [0, 0, 0], NEUTRAL]
    masked = pixels(viewer.visibility_png(visibility, [[True, False, True], [True, True, True]]))
    assert masked[0, 1].tolist() == NEUTRAL


def test_error_images_are_signed_and_neutral_at_zero():
    shown = pixels(viewer.error_png(np.array([[0.0, -0.1, 0.1], [-0.5, 0.5, np.nan]]), 0.1))
    ends = [np.rint(255 * np.array(style.SIGNED(x)[:3])).tolist() for x in (0.5, 0.0, 1.0)]
    assert shown[0].tolist() == ends
    assert shown[1].tolist() == [ends[1], ends[2], NEUTRAL]
    assert ends[0] == [0xF7] * 3


@pytest.mark.skipif(
    not (shutil.which("node") or (Path(sys.prefix) / "bin" / "node").exists()),
    reason="no Node.js to read the script with",
)
def test_the_script_works(tmp_path):
    """Run on a page that is just objects: pictures arrive where they belong, and the divider follows."""
    stub = """
    const make = (extra) => ({ style: { set: {}, setProperty(k, v) { this.set[k] = v; } }, on: {}, children: [],
      addEventListener(kind, f) { this.on[kind] = f; }, append(x) { this.children.push(x); },
      getBoundingClientRect: () => ({ left: 10, width: 200 }), scrollIntoView() {}, ...extra });
    globalThis.Option = class { constructor(text, value) { this.text = text; this.value = value; } };
    const shots = ["truth", "a", "a: error"].map((alt) => make({ alt, src: "data:" + alt, parentNode: make() }));
    const parts = { ".left": make(), ".right": make(), ".at-left": make(), ".at-right": make(), input: make() };
    const stage = make({ querySelector: (q) => parts[q] }), view = make({ hidden: true }), picks = [make(), make()];
    const box = make({ dataset: { start: "1" }, querySelector: (q) => (q === ".stage" ? stage : view),
      querySelectorAll: (q) => (q === "select" ? picks : shots) });
    globalThis.document = { querySelectorAll: () => [box] };
    """
    check = """
    const state = () => [parts[".left"].src, parts[".right"].src, parts[".at-left"].textContent];
    const found = { start: state(), hidden: view.hidden, options: picks[0].children.map((o) => o.text) };
    shots[2].parentNode.on.click(); found.click = state(); found.picked = picks[0].value;
    picks[1].value = 1; picks[1].on.change(); found.change = state();
    stage.on.pointermove({ pointerType: "mouse", clientX: 60 }); found.split = stage.style.set["--split"];
    stage.on.pointermove({ pointerType: "touch", clientX: 210 }); found.touch = stage.style.set["--split"];
    parts.input.value = 80; parts.input.on.input(); found.input = stage.style.set["--split"];
    console.log(JSON.stringify(found));
    """
    script = tmp_path / "viewer.js"
    script.write_text(stub + viewer.VIEWER_SCRIPT + check)
    node = shutil.which("node") or str(Path(sys.prefix) / "bin" / "node")
    found = json.loads(subprocess.run([node, str(script)], capture_output=True, text=True, check=True).stdout)
    assert found == {
        "start": ["data:a", "data:truth", "a"],
        "hidden": False,
        "options": ["truth", "a", "a: error"],
        "click": ["data:a: error", "data:truth", "a: error"],
        "picked": 2,
        "change": ["data:a: error", "data:a", "a: error"],
        "split": "25%",
        "touch": "25%",
        "input": "80%",
    }


GOOD = {"name": "m", "label": "m", "metrics": {"rmse": 0.1}}


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: plot.MethodResult(**(GOOD | {"metrics": {"mae": 0.1}})), ConfigError, r"\['mae'\].*'rmse'"),
        (lambda: plot.MethodResult(**(GOOD | {"metrics": {"rmse": None}})), ConfigError, "'rmse'"),
        (lambda: scene(methods=[]), ConfigError, "no method"),
        (lambda: scene(methods=[plot.MethodResult(**GOOD)] * 2), ConfigError, "twice"),
        (
            lambda: scene(methods=[plot.MethodResult(**GOOD, visibility=np.zeros((2, 2)))]),
            ShapeError,
            r"m on hall has shape \(2, 2\)",
        ),
        (lambda: plot.Comparison(scenes=[]), ConfigError, "no scene"),
    ],
)
def test_refusals(call, error, message):
    with pytest.raises(error, match=message):
        call()
