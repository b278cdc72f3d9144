"""The comparison from scenes to report, small."""

import csv
import json
import math

import numpy as np
import pytest

import gtao
from gtao import evaluate, io, workflows
from gtao.workflows import outputs, views
from gtao.workflows.comparison import timing
from gtao.workflows.comparison.tables import COLUMNS

SMALL = {
    "methods": ("gtao", "hbao"),
    "resolution": 32,
    "spp": 64,
    "budgets": ((3, 3),),
    "curve": ((1, 2), (4, 4)),
    "n_directions": 4,
    "rays_per_direction": 4,
    "rounds": 1,
}


@pytest.fixture(scope="module")
def outcome(tmp_path_factory):
    folder = tmp_path_factory.mktemp("compare") / "out"
    config = workflows.CompareConfig(scenes=("corner_boxes", "trench"), **SMALL)
    return workflows.compare(config, folder), folder


def rows_of(folder):
    return list(csv.DictReader((folder / "comparison.csv").read_text().splitlines()))


def test_everything_is_written_and_listed(outcome):
    result, folder = outcome
    record = io.read_record(folder / "record.json")
    assert {k: v for k, v in record.items() if k != "schema"} == json.loads(json.dumps(result.record))
    listed = {entry["path"] for entry in record["outputs"]}
    assert {p.name for p in folder.iterdir()} == listed | {"record.json", "report.html"}
    for entry in record["outputs"]:
        assert io.sha256_file(folder / entry["path"]) == entry["sha256"]
    assert {"comparison.csv", "comparison.md"} <= listed
    page = (folder / "report.html").read_text()
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert "corner_boxes" in page


def test_files_of_an_earlier_run_do_not_stay(tmp_path):
    folder = tmp_path / "out"
    small = SMALL | {"methods": ("gtao",)}
    workflows.compare(workflows.CompareConfig(scenes=("trench", "wall"), **small), folder)
    (folder / "mine.txt").write_text("kept")
    assert (folder / "wall_images.png").exists()
    workflows.compare(workflows.CompareConfig(scenes=("trench",), **small), folder)
    assert (folder / "trench_images.png").exists()
    assert not (folder / "wall_images.png").exists()
    assert (folder / "mine.txt").read_text() == "kept"


def test_the_table_holds_every_method_in_every_group(outcome):
    _, folder = outcome
    rows = rows_of(folder)
    assert {(r["frame"], r["group"], r["method"]) for r in rows} == {
        (frame, group, method)
        for frame in ("corner_boxes", "trench")
        for group, methods in {
            "own defaults": ("gtao", "hbao"),
            "18 taps per pixel": ("gtao", "hbao"),
            "limits of one depth layer": ("height field, ray march", "height field, dense slices", "gtao, dense"),
        }.items()
        for method in methods
    }
    assert set(COLUMNS) <= set(rows[0])
    defaults = [r for r in rows if r["group"] == "own defaults"]
    assert {(r["method"], r["taps"]) for r in defaults} == {("gtao", "64"), ("hbao", "64")}
    assert all(float(r["milliseconds"]) > 0 for r in defaults)
    assert {r["taps"] for r in rows if r["group"] == "18 taps per pixel"} == {"18"}


def test_the_numbers_are_those_of_the_images(outcome):
    """The table's RMSE from the definition, with everything estimated anew."""
    result, _ = outcome
    scene = next(s for s in result.comparison.scenes if s.name == "corner_boxes")
    info = gtao.render.scenes.get("corner_boxes")
    assert scene.radius == info.radius
    loaded = gtao.render.load_scene("corner_boxes", resolution=32)
    g = gtao.render.gbuffer(loaded)
    truth = gtao.render.visibility(loaded, g, info.radius, 64, 0, bent_normal=False).mean.numpy()
    image = gtao.ambient_occlusion(g, gtao.GTAO(radius=info.radius)).visibility.numpy()
    error = (image - truth)[g.mask.numpy()]
    entry = next(m for m in scene.methods if m.name == "gtao" and m.group == "own defaults")
    assert entry.metrics["rmse"] == pytest.approx(math.sqrt(np.mean(error.astype(float) ** 2)), rel=1e-6)
    assert entry.metrics["bias"] == pytest.approx(error.mean(), abs=1e-6)


def test_the_budget_ends_at_the_error_of_the_method(outcome):
    result, _ = outcome
    for scene in result.comparison.scenes:
        entry = next(m for m in scene.methods if m.name == "gtao" and m.group == "own defaults")
        budget = scene.budgets["gtao"]
        assert budget.names == (
            "one depth layer",
            "frame's edge",
            "horizon integral",
            "closed form",
            "heuristics",
            "sampling",
        )
        # GTAO's defaults are the faithful method: the step of its heuristics is nothing.
        assert budget.mean_squares[4] == 0
        assert budget.total + budget.noise == pytest.approx(entry.metrics["rmse"] ** 2, rel=1e-6)


def test_deviations_lead_from_the_faithful_method_to_the_result(tmp_path):
    config = workflows.CompareConfig(scenes=("trench",), **SMALL | {"methods": ("published",)})
    (scene,) = workflows.compare(config, tmp_path / "out").comparison.scenes
    walk = scene.deviations["published"]
    assert [name for name, _ in walk] == [
        "faithful",
        "slice_measure = screen",
        "step_exponent = 1",
        "falloff = LinearFalloff",
    ]
    entry = next(m for m in scene.methods if m.group == "own defaults")
    assert walk[-1][1] == pytest.approx(entry.metrics["rmse"], rel=1e-6)


def test_dense_gtao_reaches_the_limit_of_one_layer(outcome):
    result, _ = outcome
    for scene in result.comparison.scenes:
        limits = {m.name: m.metrics for m in scene.methods if m.group == "limits of one depth layer"}
        # Where the height field is compared with itself only the noise of the march is left.
        assert limits["height field, ray march"]["field_rmse"] == 0
        # Tables and images of 32 pixels: two ways to integrate the same field, apart by their discretisation.
        assert limits["height field, dense slices"]["field_rmse"] < 0.02
        # It can be nearer the truth than the height field: horizons do not see what the frame's last texels hide.
        assert limits["gtao, dense"]["corrected_rmse"] < 1.1 * limits["height field, ray march"]["corrected_rmse"]


def test_methods_that_need_a_radius_are_left_out_in_words(tmp_path):
    small = {k: v for k, v in SMALL.items() if k != "methods"} | {"resolution": 16, "radius": math.inf}
    config = workflows.CompareConfig(scenes=("trench",), **small | {"budgets": (), "curve": ((1, 2),)})
    (scene,) = workflows.compare(config, tmp_path / "out").comparison.scenes
    assert {m.name for m in scene.methods if m.group == "own defaults"} == {"gtao", "bitmask"}
    assert any(note.startswith("Left out") and "xegtao-high" in note for note in scene.notes)
    with pytest.raises(gtao.ConfigError, match="radius"):
        workflows.compare(
            workflows.CompareConfig(scenes=("trench",), **small | {"methods": ("xegtao-high",)}), tmp_path / "b"
        )


def test_frames_of_files_and_folders(tmp_path):
    workflows.render_scene("trench", tmp_path / "a.exr", resolution=24, spp=64, max_distance=0.8)
    found = views.sources([str(tmp_path)])
    assert list(found) == ["a"]
    config = workflows.CompareConfig(scenes=(str(tmp_path),), **SMALL)
    result = workflows.compare(config, tmp_path / "out")
    (scene,) = result.comparison.scenes
    assert scene.radius == pytest.approx(0.8)
    # A file has nothing around its frame, so there is no step for the frame's edge.
    assert "frame's edge" not in scene.budgets["gtao"].names
    assert result.record["inputs"][0]["sha256"] == io.sha256_file(tmp_path / "a.exr")


def test_the_same_seed_gives_the_same_numbers(tmp_path):
    config = workflows.CompareConfig(scenes=("trench",), **SMALL)

    def numbers(name):
        record = workflows.compare(config, tmp_path / name).record
        assert set(record["numbers"]["trench"]["timing"]) == {"gtao", "hbao"}
        return io.without_timestamps(record["numbers"])

    assert numbers("a") == numbers("b")


def test_the_default_radius_is_a_tenth_of_the_frame():
    z = np.full((20, 30), 4.0, np.float32)
    camera = gtao.PerspectiveCamera(30, 20, 2 * math.atan(0.5))
    # The frame is as high as its distance here: 4 units.
    assert views.default_radius(gtao.GBuffer(z, None, camera)) == pytest.approx(0.4)
    camera = gtao.OrthographicCamera(width=30, height=20, view_height=7.3)
    assert views.default_radius(gtao.GBuffer(z, None, camera)) == pytest.approx(0.73)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"methods": ("gtaoo",)}, "method must be one of gtao"),
        ({"methods": ("gtao", "gtao")}, "methods given more than once"),
        ({"radius": 0.0}, "radius must be positive"),
        ({"seed": 2**32}, "seed must be below"),
        ({"spp": 20}, "spp must be a multiple of 8"),
        ({"spp": 8}, "spp must be at least 16"),
        ({"resolution": 8}, "resolution must be at least 16"),
        ({"guard": 2.0}, "guard must be a share"),
        ({"budgets": ((0, 3),)}, "a budget is"),
        ({"rounds": 0}, "rounds must be at least 1"),
    ],
)
def test_bad_settings(options, message):
    with pytest.raises(gtao.ConfigError, match=message):
        workflows.CompareConfig(**options)


def test_the_truth_of_a_file_has_one_reach(tmp_path):
    workflows.render_scene("trench", tmp_path / "a.exr", resolution=16, spp=64, max_distance=0.8)
    small = SMALL | {"methods": ("gtao",), "scenes": (str(tmp_path / "a.exr"),)}
    with pytest.raises(gtao.ConfigError, match=r"up to 0\.8 away, not 0\.1"):
        workflows.compare(workflows.CompareConfig(**small, radius=0.1), tmp_path / "out")
    result = workflows.compare(workflows.CompareConfig(**small, radius=0.8), tmp_path / "out")
    assert result.comparison.scenes[0].radius == pytest.approx(0.8)


def test_strata_of_parallel_views(tmp_path):
    """A surface that faces a parallel camera is tilted nowhere, however far from the axis."""
    z = np.full((32, 32), 2.0, np.float32)
    g = gtao.GBuffer(z, None, gtao.OrthographicCamera(width=32, height=32, view_height=6.0))
    truth = {"visibility.mean": np.full_like(z, 0.9)}
    io.write_gbuffer(tmp_path / "flat.exr", g, extra=truth, manifest={"config": {"max_distance": 0.5}})
    config = workflows.CompareConfig(scenes=(str(tmp_path / "flat.exr"),), **SMALL | {"methods": ("gtao",)})
    (scene,) = workflows.compare(config, tmp_path / "out").comparison.scenes
    assert scene.radius == 0.5
    assert list(scene.strata["gtao"]["tilt"].count) == [1024, 0, 0, 0, 0, 0]


def test_a_run_that_breaks_off_leaves_no_record(tmp_path, monkeypatch):
    config = workflows.CompareConfig(scenes=("trench",), **SMALL | {"methods": ("gtao",)})
    workflows.compare(config, tmp_path / "out")

    def full(*_):
        raise gtao.ImageError("no space left")

    monkeypatch.setattr(outputs, "save_figures", full)
    with pytest.raises(gtao.ImageError):
        workflows.compare(config, tmp_path / "out")
    assert not (tmp_path / "out" / "record.json").exists()


def test_where_gtao_is_not_the_nearest_the_notes_say_what_helps(tmp_path):
    """In the pit few samples miss walls that stand at the frame's edge."""
    small = SMALL | {"methods": ("gtao", "bevy"), "resolution": 128, "scenes": ("pit",)}
    (scene,) = workflows.compare(workflows.CompareConfig(**small), tmp_path / "out").comparison.scenes
    at_18 = {m.name: m.metrics["field_rmse"] for m in scene.methods if m.group == "18 taps per pixel"}
    notes = [note for note in scene.notes if note.startswith("18 taps per pixel: bevy is nearer")]
    assert bool(notes) == (at_18["bevy"] < at_18["gtao"])
    assert all("alone, its" in note or "another seed" in note for note in notes)
    assert notes


def test_a_folder_of_scene_folders(tmp_path):
    for name in ("barn", "attic"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "scene.xml").write_text("<scene/>")
    assert views.sources([str(tmp_path), "trench"]) == {
        "attic": str(tmp_path / "attic" / "scene.xml"),
        "barn": str(tmp_path / "barn" / "scene.xml"),
        "trench": "trench",
    }


def test_bad_sources(tmp_path):
    with pytest.raises(gtao.SceneError, match=r"holds no \.xml scene"):
        views.sources([str(tmp_path)])
    z = np.full((16, 16), 4.0, np.float32)
    io.write_gbuffer(tmp_path / "bare.exr", gtao.GBuffer(z, None, gtao.PerspectiveCamera(16, 16, 1.0)))
    config = workflows.CompareConfig(scenes=(str(tmp_path / "bare.exr"),), **SMALL)
    with pytest.raises(gtao.ImageError, match=r"has no channel visibility\.mean"):
        workflows.compare(config, tmp_path / "out")
    assert not (tmp_path / "out" / "record.json").exists()


def test_interleaved_times_take_turns():
    order = []

    def job(name):
        def run():
            order.append(name)
            return gtao.backend.default_float()(1.0)

        return run

    seconds = timing.interleaved({"a": job("a"), "b": job("b")}, 2)
    # Once each to compile, then in turns.
    assert order == ["a", "b", "a", "b", "a", "b"]
    assert all(value > 0 for value in seconds.values())


def test_methods_are_measured_without_each_other(outcome):
    """More methods do not change the numbers of one."""
    result, _ = outcome
    scene = next(s for s in result.comparison.scenes if s.name == "trench")
    loaded = gtao.render.load_scene("trench", resolution=32)
    g = gtao.render.gbuffer(loaded)
    image = gtao.config.named("hbao", scene.radius).step(g).visibility.numpy()
    entry = next(m for m in scene.methods if m.name == "hbao" and m.group == "own defaults")
    assert entry.metrics["rmse"] == pytest.approx(evaluate.rmse(image, scene.truth, mask=scene.mask), rel=1e-6)
