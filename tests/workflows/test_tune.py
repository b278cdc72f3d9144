"""Tuning from scenes to record, small; the command, and the one line that it says when something is wrong."""

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from plot._pages import Checker

import gtao
from gtao import cli, fit, io, workflows

SMALL = {"resolution": 24, "spp": 64, "max_rounds": 2, "parameters": ("power", "radius_multiplier=1:3")}


@pytest.fixture(scope="module")
def outcome(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tune")
    config = workflows.TuneConfig(
        scenes=("stairs", "pile"),
        held_out=("trench",),
        search=("n_steps=2,3",),
        folds=2,
        radii=(0.5, 1.0),
        all_sensors=False,
        **SMALL,
    )
    return workflows.tune(config, folder / "out", cache=folder / "cache"), folder, config


def test_everything_is_written_and_listed(outcome):
    result, folder, _ = outcome
    out = folder / "out"
    record = io.read_record(out / "record.json")
    assert {k: v for k, v in record.items() if k != "schema"} == json.loads(io.pretty_json(result.record))
    listed = {entry["path"] for entry in record["outputs"]}
    # The report holds the record, which therefore cannot hold the report's hash.
    assert {p.name for p in out.iterdir()} == listed | {"record.json", "report.html"}
    for entry in record["outputs"]:
        assert io.sha256_file(out / entry["path"]) == entry["sha256"]
    figures = {"history.png", "parameters.png", "errors.png", "candidates.png"}
    assert listed == figures | {"method.json", "tuning.csv"}
    Checker().check((out / "report.html").read_text(), len(figures))


def test_the_method_of_the_file_is_the_tuned_one(outcome):
    result, folder, _ = outcome
    stored = gtao.method_from_dict(json.loads((folder / "out" / "method.json").read_text()))
    assert stored == result.result.method
    assert stored.occlusion.radius == 1.0
    assert stored.occlusion.power == result.result.values["power"]


def test_the_numbers_are_those_of_the_images(outcome):
    """One view from the scene on, everything anew."""
    result, folder, _ = outcome
    scene = gtao.render.load_scene("pile", resolution=24)
    g = gtao.render.gbuffer(scene)
    radius = 0.5 * gtao.render.scenes.get("pile").radius
    truth = gtao.render.visibility(scene, g, radius, 64, 0, bent_normal=False)
    rows = list(csv.DictReader((folder / "out" / "tuning.csv").read_text().splitlines()))
    assert [row["view"] for row in rows] == [
        f"{scene}, {factor:g} r" for scene in ("stairs", "pile", "trench") for factor in (0.5, 1)
    ]
    row = next(row for row in rows if row["view"] == "pile, 0.5 r")
    kept = g.mask.numpy().astype(bool)
    for column, method in (
        ("start", gtao.config.named("xegtao-high", radius)),
        ("xegtao-high 3x2", gtao.config.with_budget(gtao.config.named("xegtao-high", radius), 3, 2)),
        ("tuned", fit.at_radius(result.result.method, radius)),
    ):
        image = method.step(g).visibility.numpy().astype(float)
        square = np.mean((image - truth.mean.numpy())[kept] ** 2) - truth.variance.numpy()[kept].mean()
        # The table has six digits; the filter's kernel rounds like the one of the tuning, and no better.
        assert float(row[column]) == pytest.approx(np.sqrt(max(square, 0)), rel=1e-4)
    assert [r["held out"] for r in rows] == ["0", "0", "0", "0", "1", "1"]


def test_the_summary_says_what_was_found(outcome):
    result, _, _ = outcome
    lines = result.summary().splitlines()
    assert lines[0].startswith("RMSE ")
    assert any("power" in line and "2.2 -> " in line for line in lines)
    assert any(line.startswith("  scenes left out in turn: RMSE ") for line in lines)
    assert any(line.startswith("  held-out scenes: RMSE ") for line in lines)


def test_what_was_traced_is_not_traced_again_and_the_same_seed_gives_the_same(outcome, tmp_path, monkeypatch):
    result, folder, config = outcome
    damaged = min((folder / "cache").glob("*.exr"))
    whole = damaged.read_bytes()
    damaged.write_bytes(whole[: len(whole) // 2])
    traced = []
    real = gtao.render.visibility
    monkeypatch.setattr(gtao.render, "visibility", lambda *a, **k: traced.append(1) or real(*a, **k))
    again = workflows.tune(config, tmp_path / "out", cache=folder / "cache")
    assert len(traced) == 1
    assert damaged.read_bytes() == whole
    # Threads add gradients in any order, and what follows differs by that rounding.
    assert again.result.values == pytest.approx(result.result.values, rel=1e-3)
    for a, b in zip(again.result.folds, result.result.folds, strict=True):
        assert (a.left_out, a.choice) == (b.left_out, b.choice)
        assert a.values == pytest.approx(b.values, rel=1e-3)
    for label, errors in again.result.scores.rmse.items():
        assert errors == pytest.approx(result.result.scores.rmse[label], rel=1e-3)


def test_a_killed_run_leaves_no_record(outcome, tmp_path, monkeypatch):
    _, folder, config = outcome
    (tmp_path / "out").mkdir()
    for name in ("report.html", "record.json"):
        (tmp_path / "out" / name).write_text("earlier")
    monkeypatch.setattr(workflows.tuning.fit, "tune", lambda *_, **__: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        workflows.tune(config, tmp_path / "out", cache=folder / "cache")
    # Nothing was replaced, so that the earlier result is whole.
    assert {p.name: p.read_text() for p in (tmp_path / "out").iterdir()} == {
        "report.html": "earlier",
        "record.json": "earlier",
    }


def test_frames_of_files_keep_their_radius(tmp_path):
    workflows.render_scene("trench", tmp_path / "a.exr", resolution=24, spp=64, max_distance=0.8)
    config = workflows.TuneConfig(scenes=(str(tmp_path / "a.exr"),), **SMALL)
    found = workflows.tune(config, tmp_path / "out", cache=tmp_path / "cache")
    assert found.record["inputs"] == [io.file_entry(tmp_path / "a.exr") | {"scene": "a"}]
    assert found.result.folds == ()
    assert all(p.standard_error is None for p in found.result.parameters)
    workflows.render_scene("trench", tmp_path / "b.exr", resolution=24, spp=64)
    with pytest.raises(gtao.ConfigError, match="has no finite reach"):
        workflows.tune(workflows.TuneConfig(scenes=(str(tmp_path / "b.exr"),), **SMALL), tmp_path / "b")


def test_the_defaults_are_the_constants_of_xegtao():
    config = workflows.TuneConfig()
    assert list(config.bounds()) == [
        "radius_multiplier",
        "falloff.start",
        "step_exponent",
        "thin_occluder_compensation",
        "power",
    ]
    # Of methods without some of them, the others.
    assert "falloff.start" not in workflows.TuneConfig(method="bitmask").bounds()
    assert config.choices() == {}
    assert workflows.TuneConfig(search=("fetch=nearest,bilinear", "pyramid=none")).choices() == {
        "fetch": ("nearest", "bilinear"),
        "pyramid": (None,),
    }


def test_the_committed_constants_beat_those_of_xegtao_on_scenes_that_they_do_not_know():
    """At equal slices and steps, with the same filter and without any."""
    folder = Path(__file__).parents[2] / "fits" / "tuning" / "2026-11" / "constants"
    record = io.read_record(folder / "record.json")
    for entry in record["outputs"]:
        assert io.sha256_file(folder / entry["path"]) == entry["sha256"]
    assert record["numbers"]["rival"] == "xegtao-high 3x3"
    method = gtao.method_from_dict(json.loads((folder / "method.json").read_text()))
    assert (method.occlusion.n_slices, method.occlusion.n_steps, method.spatial) == (3, 3, gtao.EdgeAwareFilter())
    for views in record["numbers"]["unseen"].values():
        for found in views.values():
            assert found["ratio"] < 1
            assert found["wins"] > found["n_views"] / 2
            # Paired over scenes: by more than chance.
            assert found["difference"] < -2 * found["standard_error"]


# --- the command ---------------------------------------------------------------------------------------------------


@pytest.fixture
def command(monkeypatch, capfd, tmp_path):
    """Run ``gtao tune`` in the temporary folder: code, lines of output, lines of errors."""
    monkeypatch.chdir(tmp_path)

    def run(*words):
        monkeypatch.setattr(sys, "argv", ["gtao", "tune", *map(str, words)])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        found = capfd.readouterr()
        return stop.value.code, found.out.splitlines(), found.err.splitlines()

    return run


def test_the_command(command, tmp_path):
    words = ["--quick", "--resolution", 24, "--spp", 16, "--no-all-sensors", "--cache", "cache", "-o", "out"]
    options = ["--parameter", "power=1:3", "--search", "n_steps=2,3", "--max-taps", 12, "--set", "n_slices=3"]
    code, out, _ = command("trench", "stairs", *words, *options, "--folds", 0, "--radii", "0.5,1", "--frames", 2)
    assert code == 0
    assert out[-1] == "report: out/report.html"
    record = io.read_record(tmp_path / "out" / "record.json")
    assert record["command"] == ["gtao", "tune"]
    given = {"scenes": ["trench", "stairs"], "spp": 16, "radii": [0.5, 1.0], "max_taps": 12, "folds": 0, "n_frames": 2}
    assert {key: record["config"][key] for key in given} == given
    assert record["numbers"]["choice"] == {"n_steps": 2}
    assert len(record["numbers"]["scores"]["views"]) == 4


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["nowhere"], "no embedded scene is called 'nowhere'"),
        (["trench", "trench"], "scenes given more than once: trench"),
        (["trench", "--held-out", "trench"], "scenes given more than once: trench"),
        (["trench", "--method", "gtaoo"], "method must be one of gtao"),
        (["trench", "--rival", "gtaoo"], "rival must be one of gtao"),
        (["trench", "--set", "n_steps"], "an option is written key=value, got 'n_steps'"),
        (["trench", "--parameter", "n_steps"], "'n_steps' cannot be tuned here; choose from radius"),
        (["trench", "--parameter", "power=1"], "a parameter is written path or path=low:high, got 'power=1'"),
        (["trench", "--parameter", "power=3:4"], "power starts at 2.2, outside of its bounds 3 and 4"),
        (["trench", "--search", "n_steps"], "a search is written key=value,value,…, got 'n_steps'"),
        (["trench", "--search", "n_steps=2,x"], "n_steps must be a whole number, got 'x'"),
        (["trench", "--search", "n_stops=2"], "there is no option 'n_stops'"),
        (["trench", "--max-taps", 4], "no combination reads at most 4 depth samples per pixel; the least is 18"),
        (["trench", "--folds", 2], "folds must be 0 (none) or from 2 to the number of scenes, 1, got 2"),
        (["trench", "--bootstrap", 100], "the bootstrap needs at least 3 scenes, got 1"),
        (["trench", "--radius", "nan"], "must be positive or inf"),
        (["trench", "--radius", "inf"], "radius must be positive and finite"),
        (["trench", "--radii", "1,-1"], "must be positive or inf, got -1"),
        (["trench", "--radii", "1,far"], "'far' is not a number"),
        (["trench", "--spp", 20], "spp must be a multiple of 8"),
        (["trench", "--resolution", 8], "Invalid value for '--resolution'"),
        (["trench", "-o", "taken"], "cannot write taken/record.json"),
        (["trench", "--cache", "file"], "cannot write file/"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(command, tmp_path, monkeypatch, words, message):
    traced = "nowhere" in words
    if not traced:
        monkeypatch.setattr(gtao.render, "load_scene", lambda *_, **__: pytest.fail("a scene was loaded"))
    (tmp_path / "taken" / "record.json").mkdir(parents=True)
    (tmp_path / "file").write_text("in the way")
    before = sorted(tmp_path.rglob("*"))
    code, out, err = command("-o", "new/out", *words)
    assert (code, out) == (2, [])
    assert len(err) == 1
    assert message in err[0]
    assert sorted(tmp_path.rglob("*")) == before
