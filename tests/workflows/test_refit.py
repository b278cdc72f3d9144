"""The main job from scenes to files: complete, consistent, repeatable, and whole again after any failure."""

import functools
import html
import json
import math
import re
import shutil
import sys
from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

import gtao
from gtao import fit, io, plot, render, workflows
from gtao.errors import FitError, RecordError
from gtao.fit import FitSettings
from gtao.io import origin

CONFIG = workflows.RefitConfig(
    scenes=("pile", "stairs", "cloth"), resolution=24, spp=32, n_bounces=8, fit=FitSettings(n_bootstrap=20)
)
COARSE = gtao.GTAO(n_slices=2, n_steps=4, radius=1.0)
FREE = replace(CONFIG, fit=replace(CONFIG.fit, constraints=()))

BALL = """<scene version="3.0.0">
  <shape type="sphere"/>
  <shape type="rectangle">
    <transform name="to_world"><scale value="4"/><rotate x="1" angle="-70"/><translate y="-1"/></transform>
  </shape>
  <sensor type="perspective">
    <float name="fov" value="60"/>
    <transform name="to_world"><lookat origin="0, 1, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="40"/><integer name="height" value="30"/></film>
  </sensor>
</scene>
"""


@pytest.fixture(scope="module", autouse=True)
def _one_commit():
    """Somebody may commit while the tests run; two records would then differ in that."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(origin, "git_state", lambda: {"commit": "0" * 40, "dirty": False})
        yield


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="module")
def whole(tmp_path_factory, cache):
    """``(outcome, output directory)`` of a run with everything."""
    output = tmp_path_factory.mktemp("whole") / "result"
    return workflows.refit(CONFIG, output, cache=cache), output


@pytest.fixture
def undrawn(monkeypatch):
    """Drawing takes most of a small run's time, and most tests look at numbers."""
    blank = Figure(figsize=(1, 1))
    monkeypatch.setattr(plot, "refit_figures", lambda *_: {"scatter": blank})
    monkeypatch.setattr(plot, "image_row", lambda *_: blank)
    monkeypatch.setattr(plot, "refit_report", lambda *_, **__: "page")


@pytest.fixture
def traced(monkeypatch):
    """What is traced, not taken from the cache: arguments of every call."""
    calls, real = [], render.transport

    def count(*arguments, **named):
        calls.append(arguments)
        return real(*arguments, **named)

    monkeypatch.setattr(render, "transport", count)
    return calls


@functools.cache
def trace(name, sensor=0):
    scene = render.load_scene(name, resolution=CONFIG.resolution)
    return render.transport(scene, None, CONFIG.n_bounces, CONFIG.spp, CONFIG.seed, sensor=sensor)


@functools.cache
def estimate(name, sensor=0):
    g = render.gbuffer(render.load_scene(name, resolution=CONFIG.resolution), sensor)
    return gtao.ambient_occlusion(g, COARSE).visibility.numpy()


def fitted(transports, regressors=None, **options):
    samples = fit.Samples.from_transports(transports, regressors=regressors)
    return fit.multibounce(samples, **{"n_bootstrap": CONFIG.fit.n_bootstrap, **options})


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def listed(record):
    return {entry["path"] for entry in record["outputs"]}


def test_all_outputs_are_there_and_listed(whole):
    _, output = whole
    names = {"coefficients.json", *(f"multibounce.{suffix}" for suffix in ("hlsl", "glsl", "wgsl", "h"))}
    plots = ("scatter", "comparison", "coefficients", "left_out", "residuals", "coverage", "forms_4", "forms_inf")
    names |= {f"{name}.png" for name in (*plots, "scenes")}
    assert set(contents(output)) == {*names, "record.json", "report.html"}
    record = io.read_record(output / "record.json")
    assert listed(record) == names
    for entry in record["outputs"]:
        path = output / entry["path"]
        assert entry["sha256"] == io.sha256_file(path)
        assert entry["bytes"] == path.stat().st_size
        if path.suffix == ".png":
            with Image.open(path) as image:
                image.load()


def test_coefficients_are_the_same_everywhere(whole):
    outcome, output = whole
    assert io.read_fit(output / "coefficients.json") == outcome.fit
    assert outcome.result.fit == outcome.fit
    record = io.read_record(output / "record.json")
    assert record.pop("schema") == io.records.SCHEMA
    assert record == json.loads(io.canonical_json(outcome.record))
    values = dict(zip(outcome.fit.names, outcome.fit.coefficients, strict=True))
    assert record["numbers"]["fit"]["coefficients"] == values
    for name in ("standard_errors", "intervals"):
        assert record["numbers"]["fit"][name].keys() == values.keys()
    for suffix, language in (("hlsl", "hlsl"), ("glsl", "glsl"), ("wgsl", "wgsl"), ("h", "c")):
        assert (output / f"multibounce.{suffix}").read_text() == io.shader_code(outcome.fit, language)
    for name, value in values.items():
        assert f"{name:7} {value:9.4f}" in outcome.summary()


def test_they_are_what_the_rooms_give_when_called_one_by_one(whole):
    outcome, _ = whole
    expected = fitted([(name, trace(name)) for name in CONFIG.scenes])
    assert outcome.fit == expected.fit
    assert (outcome.result.clusters, outcome.result.n_clusters) == ("scenes", 3)


def test_the_record_describes_its_input(whole):
    outcome, _ = whole
    assert [entry["scene"] for entry in outcome.record["inputs"]] == list(CONFIG.scenes)
    entry, transport = outcome.record["inputs"][1], trace("stairs")
    print_of = render.fingerprint(render.load_scene("stairs", resolution=24), 0)
    assert (entry["path"], entry["sha256"], entry["views"]) == ("embedded:stairs", print_of, [print_of])
    v = transport.visibility.ravel()[transport.pixel]
    assert entry["n_pixels"] == v.size == sum(entry["visibility_deciles"])
    assert entry["mean_visibility"] == pytest.approx(v.mean(dtype=float), abs=1e-6)
    assert entry["visibility_deciles"][9] == (v >= 0.9).sum()
    inside = transport.remainder.ravel()[transport.pixel].mean(dtype=float)
    assert entry["share_left_inside"] == pytest.approx(inside, abs=1e-6)
    assert outcome.record["config"]["scenes"] == list(CONFIG.scenes)
    assert outcome.record["seed"] == CONFIG.seed


def shown_record(page):
    """The record that a report holds."""
    return json.loads(html.unescape(re.search(r"<summary>Record</summary><pre>(.*?)</pre>", page, re.DOTALL)[1]))


def test_the_report_holds_the_record(whole):
    _, output = whole
    shown = shown_record((output / "report.html").read_text())
    record = io.read_record(output / "record.json")
    del record["schema"]
    assert json.loads(io.canonical_json(io.with_infinities(shown))) == record


def test_the_same_run_gives_the_same_files(whole, cache, tmp_path, traced):
    _, output = whole
    workflows.refit(CONFIG, tmp_path, cache=cache)
    assert traced == []
    first, second = contents(output), contents(tmp_path)
    records = [json.loads(files.pop("record.json")) for files in (first, second)]
    pages = [files.pop("report.html").decode() for files in (first, second)]
    assert first == second
    assert io.without_timestamps(records[0]) == io.without_timestamps(records[1])
    time = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\+00:00")
    assert len(time.findall(pages[0])) == 2
    assert time.sub("", pages[0]) == time.sub("", pages[1])


@pytest.mark.usefixtures("undrawn")
class TestOptions:
    def test_another_fit_of_the_same_scenes_traces_nothing(self, whole, cache, tmp_path, monkeypatch):
        monkeypatch.setattr(render, "transport", lambda *_, **__: pytest.fail("a scene was traced"))
        outcome = workflows.refit(FREE, tmp_path, cache=cache)
        before, _ = whole
        assert outcome.fit.coefficients != before.fit.coefficients
        assert sum(before.fit.coefficients) == pytest.approx(1, abs=1e-9) != sum(outcome.fit.coefficients)

    @pytest.mark.parametrize("change", [{"seed": 1}, {"spp": 48}, {"resolution": 16}, {"n_batches": 16}])
    def test_another_sampling_is_traced_anew(self, whole, cache, tmp_path, traced, change):
        outcome = workflows.refit(replace(CONFIG, **change), tmp_path, cache=cache)
        assert len(traced) == 3
        assert outcome.fit.coefficients != whole[0].fit.coefficients

    def test_infinitely_many_bounces(self, cache, tmp_path):
        config = replace(CONFIG, fit=replace(CONFIG.fit, bounces=math.inf))
        outcome = workflows.refit(config, tmp_path, cache=cache)
        expected = fitted([(name, trace(name)) for name in CONFIG.scenes], bounces=math.inf)
        assert outcome.fit == expected.fit == io.read_fit(tmp_path / "coefficients.json")
        assert list(outcome.tables) == [math.inf, 4]
        record = io.read_record(tmp_path / "record.json")
        assert record["config"]["fit"]["bounces"] == "inf"
        assert list(record["numbers"]["comparison"]) == ["4", "inf"]

    def test_other_bounces_join_those_that_are_always_tabulated(self, cache, tmp_path):
        settings = replace(CONFIG.fit, bounces=3, form="one_parameter", constraints=("energy",))
        config = replace(CONFIG, fit=settings)
        outcome = workflows.refit(config, tmp_path, cache=cache)
        assert list(outcome.tables) == [3, 4, math.inf]
        for table in outcome.tables.values():
            assert table[config.fit.label].form == "one_parameter"
        # The comparison fits the same thing by another way.
        assert outcome.tables[3][config.fit.label].coefficients == pytest.approx(outcome.fit.coefficients, abs=1e-12)

    def test_without_bootstrap(self, cache, tmp_path):
        config = replace(CONFIG, fit=replace(CONFIG.fit, n_bootstrap=0))
        outcome = workflows.refit(config, tmp_path, cache=cache)
        assert outcome.fit.intervals is None
        assert io.read_record(tmp_path / "record.json")["numbers"]["fit"]["standard_errors"] is None
        assert "±" not in outcome.summary()

    def test_screen_space_visibility(self, whole, cache, tmp_path, traced):
        config = replace(CONFIG, regressor="screen", screen_method=COARSE)
        outcome = workflows.refit(config, tmp_path, cache=cache)
        assert traced == []
        transports = [(name, trace(name)) for name in CONFIG.scenes]
        assert outcome.fit == fitted(transports, {name: estimate(name) for name in CONFIG.scenes}).fit
        assert outcome.fit.coefficients != whole[0].fit.coefficients
        assert outcome.record["config"]["screen_method"]["n_steps"] == COARSE.n_steps

    @pytest.mark.parametrize("regressor", ["ray", "screen"])
    def test_every_camera(self, cache, tmp_path, regressor):
        settings = replace(CONFIG.fit, weighting="pixel")
        config = replace(CONFIG, all_sensors=True, fit=settings, regressor=regressor, screen_method=COARSE)
        outcome = workflows.refit(config, tmp_path, cache=cache)
        # However many cameras it has, a scene is one draw of the bootstrap.
        assert (outcome.result.clusters, outcome.result.n_clusters) == ("scenes", 3)
        views = {f"{name} {i}": (name, i) for name in CONFIG.scenes for i in range(2)}
        transports = [(view, trace(*where)) for view, where in views.items()]
        seen = {view: estimate(*where) for view, where in views.items()} if regressor == "screen" else None
        # Where pixels count the same, it does not matter for the coefficients which of them are called a scene.
        expected = fitted(transports, seen, weighting="pixel", n_bootstrap=0)
        assert outcome.fit.coefficients == pytest.approx(expected.fit.coefficients, abs=1e-9)
        for i, entry in enumerate(outcome.record["inputs"]):
            assert len(set(entry["views"])) == 2
            assert entry["n_pixels"] == sum(t.pixel.size for _, t in transports[2 * i : 2 * i + 2])

    def test_pixel_blocks_of_several_cameras_are_not_mixed(self, cache, tmp_path):
        settings = replace(CONFIG.fit, form="one_parameter")
        config = replace(CONFIG, scenes=("pile",), all_sensors=True, fit=settings)
        result = workflows.refit(config, tmp_path, cache=cache).result
        # 8 x 8 blocks in each of two images without background.
        assert (result.clusters, result.n_clusters) == ("pixel blocks", 128)

    def test_a_scene_of_the_user_beside_embedded_ones(self, cache, tmp_path):
        path = tmp_path / "mine" / "scene.xml"
        path.parent.mkdir()
        path.write_text(BALL)
        config = replace(CONFIG, scenes=("pile", str(path), "cloth"))
        outcome = workflows.refit(config, tmp_path / "out", cache=cache)
        assert outcome.result.scenes == ("pile", "mine", "cloth")
        entry = outcome.record["inputs"][1]
        assert (entry["path"], entry["sha256"]) == ("scene.xml", io.sha256_file(path))
        # The longer side is what was asked for, the aspect ratio the scene's own.
        assert 0 < entry["n_pixels"] <= 24 * 18
        assert str(tmp_path) not in (tmp_path / "out" / "record.json").read_text()
        expected = fitted([("pile", trace("pile")), ("mine", trace(str(path))), ("cloth", trace("cloth"))])
        assert outcome.fit.coefficients == expected.fit.coefficients

    def test_a_file_called_like_an_embedded_scene(self, cache, tmp_path):
        path = tmp_path / "pile.xml"
        path.write_text(BALL)
        config = replace(CONFIG, scenes=(str(path), "pile", "cloth"))
        outcome = workflows.refit(config, tmp_path / "out", cache=cache)
        assert outcome.result.scenes == ("pile (2)", "pile", "cloth")
        assert [entry["path"] for entry in outcome.record["inputs"]] == ["pile.xml", "embedded:pile", "embedded:cloth"]

    def test_which_scenes(self, cache, tmp_path, monkeypatch):
        def stop(sources, *_):
            raise FitError(" ".join(sources.values()))

        monkeypatch.setattr(sys.modules["gtao.workflows.refit"], "collect", stop)
        all_of_them = " ".join(render.scenes.names("procedural"))
        for config, expected in (
            (workflows.RefitConfig(), all_of_them),
            (workflows.RefitConfig(scenes=("mine.xml",)), "mine.xml"),
            (workflows.RefitConfig(scenes=("mine.xml",), also_embedded=True), f"mine.xml {all_of_them}"),
        ):
            with pytest.raises(FitError, match=f"^{expected}$"):
                workflows.refit(config, tmp_path, cache=cache)

    def test_progress_ends_where_it_said(self, cache, tmp_path):
        told = defaultdict(list)
        config = replace(CONFIG, seed=2, resolution=8)
        workflows.refit(config, tmp_path, cache=cache, progress=lambda task, *step: told[task].append(step))
        assert list(told) == ["scenes", *(f"  {name}" for name in CONFIG.scenes), "fit"]
        for steps in told.values():
            done, totals = zip(*steps, strict=True)
            assert len(set(totals)) == 1
            assert list(done) == sorted(set(done))
            assert done[-1] == totals[0]


def test_one_scene(cache, tmp_path):
    # Also drawn: tables and plots have nothing to leave out.
    config = replace(CONFIG, scenes=("pile",), fit=replace(CONFIG.fit, form="one_parameter"))
    outcome = workflows.refit(config, tmp_path, cache=cache)
    assert outcome.result.clusters == "pixel blocks"
    assert outcome.result.n_clusters == 64
    assert outcome.tables[4][config.fit.label].loso_rmse is None
    assert "coefficients.png" not in contents(tmp_path)


@pytest.mark.usefixtures("undrawn")
class TestFailures:
    @pytest.fixture(autouse=True)
    def _compared(self, whole, monkeypatch):
        """Tables of an earlier comparison: they take time, and these tests do not look at them."""
        monkeypatch.setattr(fit, "compare_forms", lambda samples, bounces, **_: whole[0].tables[bounces])

    @pytest.fixture
    def earlier(self, whole, tmp_path):
        """The result of an earlier run, with a file of the user's among it."""
        output = tmp_path / "earlier"
        shutil.copytree(whole[1], output)
        (output / "notes.txt").write_text("mine")
        return output

    def test_a_damaged_cache_entry_is_traced_again(self, whole, tmp_path, traced):
        outcome, _ = whole
        cache = tmp_path / "cache"
        workflows.refit(CONFIG, tmp_path / "first", cache=cache)
        traced.clear()
        entries = sorted(cache.iterdir())
        assert len(entries) == 3
        content = entries[1].read_bytes()
        entries[1].write_bytes(content[: len(content) // 2])
        again = workflows.refit(CONFIG, tmp_path / "second", cache=cache)
        assert len(traced) == 1
        assert again.fit == outcome.fit
        assert entries[1].read_bytes() == content
        assert sorted(cache.iterdir()) == entries

    def test_a_fit_that_fails_leaves_the_earlier_result(self, earlier, cache, monkeypatch):
        def fail(*_, **__):
            raise FitError("no")

        before = contents(earlier)
        monkeypatch.setattr(fit, "multibounce", fail)
        with pytest.raises(FitError):
            workflows.refit(FREE, earlier, cache=cache)
        assert contents(earlier) == before

    @pytest.mark.parametrize("step", ["write_text", "atomic_path", "write_record"])
    def test_writing_that_fails_leaves_no_record(self, earlier, cache, monkeypatch, step):
        def fail(*_, **__):
            raise RecordError("the disk is full")

        monkeypatch.setattr(io, step, fail)
        with pytest.raises(RecordError):
            workflows.refit(FREE, earlier, cache=cache)
        assert "record.json" not in contents(earlier)

    def test_what_an_earlier_run_drew_and_this_one_does_not_is_gone(self, earlier, cache):
        outcome = workflows.refit(FREE, earlier, cache=cache)
        names = set(contents(earlier))
        assert names == {*listed(outcome.record), "record.json", "report.html", "notes.txt"}
        assert "scatter.png" in names
        assert "comparison.png" not in names

    @pytest.mark.parametrize("place", ["../other.txt", "{folder}/other.txt", "sub/other.txt"])
    def test_a_record_cannot_have_other_files_removed(self, earlier, cache, place):
        other = earlier / place.format(folder=earlier.parent)
        other.parent.mkdir(exist_ok=True)
        other.write_text("keep")
        record = json.loads((earlier / "record.json").read_text())
        record["outputs"].append({"path": place.format(folder=earlier.parent), "sha256": "0" * 64})
        (earlier / "record.json").write_text(json.dumps(record))
        workflows.refit(CONFIG, earlier, cache=cache)
        assert other.read_text() == "keep"

    def test_a_damaged_record_is_replaced(self, earlier, cache):
        (earlier / "record.json").write_text("{")
        outcome = workflows.refit(CONFIG, earlier, cache=cache)
        assert np.isfinite(outcome.fit.coefficients).all()
        io.read_record(earlier / "record.json")
