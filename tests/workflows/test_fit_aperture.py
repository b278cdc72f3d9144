"""From scenes to the aperture of the reflection cone."""

import csv
import dataclasses
import json

import numpy as np
import pytest

import gtao
from gtao import cli, io, render, workflows

SMALL = {"resolution": 32, "spp": 32, "roughness": (0.4, 0.7), "n_bootstrap": 20}


@pytest.fixture(scope="module")
def outcome(tmp_path_factory):
    folder = tmp_path_factory.mktemp("aperture")
    config = workflows.FitApertureConfig(scenes=("trench", "pit", "v_groove"), **SMALL)
    return workflows.fit_aperture(config, folder), folder


def test_everything_is_written_and_listed(outcome):
    result, folder = outcome
    record = io.read_record(folder / "record.json")
    assert {k: v for k, v in record.items() if k != "schema"} == json.loads(json.dumps(result.record))
    listed = {entry["path"] for entry in record["outputs"]}
    assert listed == {"aperture.csv", "curves.png", "by_roughness.png"}
    assert {p.name for p in folder.iterdir()} == listed | {"record.json", "report.html"}
    assert record["numbers"]["best"]["u"] == result.result.best.u
    assert [entry["frame"] for entry in record["inputs"]] == ["trench", "pit", "v_groove"]
    rows = list(csv.reader((folder / "aperture.csv").read_text().splitlines()))
    assert len(rows) == 7
    assert [float(x) for x in rows[1][3:]] == pytest.approx(list(result.result.curves[0]), rel=1e-5)
    page = (folder / "report.html").read_text()
    assert f"{result.result.best.u:.4g}" in page


@pytest.mark.parametrize(("reference", "aperture"), [("traced", "seed"), ("cone", "tilted")])
def test_curves_are_those_of_the_reference_and_two_cones(outcome, tmp_path, reference, aperture):
    """One point of one curve, put together from public functions and the seeds of the frames."""
    result, _ = outcome
    if reference == "cone":
        config = workflows.FitApertureConfig(scenes=("pit",), reference=reference, aperture=aperture, **SMALL)
        result = workflows.fit_aperture(config, tmp_path)
    scene = render.load_scene("pit", resolution=32)
    g = render.gbuffer(scene, albedo=False)
    radius, batches = render.scenes.get("pit").radius, {"n_batches": 2}
    found = {"traced": [], "cone": [], "estimate": []}
    for seed in (0, 1):
        traced = render.specular(scene, g, 0.7, 0.04, radius, 16, seed, **batches)
        found["traced"].append(traced.occlusion.mean.numpy().astype(float))
    for seed in (2, 4):
        traced = render.visibility(scene, g, radius, 16, seed, **batches)
        ao = gtao.AmbientOcclusion(visibility=traced.mean, mean_direction=traced.mean_direction, normal_v=g.normal_v)
        method = gtao.ConeCone(u=float(result.result.grid[10]), aperture=aperture)
        for name, one in (("estimate", method), ("cone", gtao.ConeBRDF(aperture=aperture))):
            found[name].append(gtao.specular_occlusion(ao, g, 0.7, 0.04, one).numpy().astype(float))
    images = {name: np.mean(runs, axis=0) for name, runs in found.items()}
    expected = gtao.evaluate.dssim(images["estimate"], images[reference], mask=g.mask.numpy())
    k = result.result.samples.index(("pit", "pit", 0.7))
    assert result.result.curves[k, 10] == pytest.approx(expected, rel=1e-6)


def test_the_same_run_gives_the_same_numbers(tmp_path):
    config = workflows.FitApertureConfig(scenes=("trench",), **SMALL | {"roughness": (0.5,)})
    a, b = (workflows.fit_aperture(config, tmp_path / name).record["numbers"] for name in "ab")
    assert a == b
    assert a["interval"] is None


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"reference": "photo"}, "reference must be one of traced, cone"),
        ({"source": "eyes"}, "source must be one of traced, dense"),
        ({"metric": "psnr"}, "metric must be one of"),
        ({"aperture": "wide"}, "aperture must be one of"),
        ({"weighting": "none"}, "weighting must be one of"),
        ({"roughness": (1.5,)}, "roughness must lie"),
        ({"roughness": (0.5, 0.5)}, "more than once"),
        ({"f0": -0.1}, "f0 must lie"),
        ({"spp": 18}, "multiple of 4"),
        ({"radius": 0.0}, "radius must be positive"),
        ({"resolution": 8}, "at least 16"),
        ({"seed": -1}, "seed must lie"),
        ({"n_bootstrap": -1}, "n_bootstrap"),
    ],
)
def test_bad_settings(options, words):
    with pytest.raises(gtao.ConfigError, match=words):
        workflows.FitApertureConfig(**options)


def test_the_command(tmp_path, monkeypatch, capsys):
    words = [
        "gtao",
        "fit-aperture",
        "trench",
        "--quick",
        "--source",
        "dense",
        "--roughness",
        "0.5",
        "-o",
        str(tmp_path),
    ]
    monkeypatch.setattr("sys.argv", words)
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 0
    assert "u = " in capsys.readouterr().out
    record = io.read_record(tmp_path / "record.json")
    assert (record["config"]["source"], record["config"]["roughness"]) == ("dense", [0.5])
    # The command of the record asks for the same again.
    words = [str(tmp_path / "again") if word.endswith(tmp_path.name) else word for word in record["command"]]
    monkeypatch.setattr("sys.argv", words)
    with pytest.raises(SystemExit):
        cli.main()
    again = io.read_record(tmp_path / "again" / "record.json")
    assert (again["config"], again["numbers"]) == (record["config"], record["numbers"])


def test_an_optimum_at_the_end_of_the_search_is_told(outcome):
    result, _ = outcome
    ended = dataclasses.replace(result.result, best=dataclasses.replace(result.result.best, at_bound=True))
    assert "at the end of the search" in dataclasses.replace(result, result=ended).summary()
    assert ("end of the search" in result.summary()) == result.result.best.at_bound


def test_bad_input_ends_in_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["gtao", "fit-aperture", "missing.xml", "-o", str(tmp_path / "out")])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 2
    assert capsys.readouterr().err.count("\n") <= 2
    assert not (tmp_path / "out" / "record.json").exists()
