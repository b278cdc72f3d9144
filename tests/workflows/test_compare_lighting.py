"""The comparison of irradiance under light, small."""

import csv
import dataclasses
import json
import math
import sys

import numpy as np
import pytest

import gtao
from gtao import cli, io, lighting, plot, workflows
from gtao.workflows import outputs, standings
from gtao.workflows.lighting import frames, lights, methods, tables

SMALL = {"resolution": 24, "spp": 64}
METHODS = ("slice-moments", "clipped-cone-4", "bent-normal-average-horizon", "unoccluded")
SOURCES = ("ray-traced visibility", "dense slices", "few slices, filtered")
CUTS = ("order 2", "order 4", "all bands", "all bands, windowed")
LIMITS = "exact visibility, light cut"


@pytest.fixture(scope="module")
def outcome(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lighting") / "out"
    config = workflows.CompareLightingConfig(
        scenes=("corner_boxes", "trench"), environments=("gradient", "vmf:20"), methods=METHODS, turn=120, **SMALL
    )
    return workflows.compare_lighting(config, folder), folder


def rows_of(folder):
    return list(csv.DictReader((folder / "lighting.csv").read_text().splitlines()))


def errors(result, light, cut, source, frame=0):
    scene = result.comparison.tables[light][cut].scenes[frame]
    return {m.name: m.metrics for m in scene.methods if m.group == source}


def test_everything_is_written_and_listed(outcome):
    result, folder = outcome
    record = io.read_record(folder / "record.json")
    assert {k: v for k, v in record.items() if k != "schema"} == json.loads(json.dumps(result.record))
    listed = {entry["path"] for entry in record["outputs"]}
    assert {p.name for p in folder.iterdir()} == listed | {"record.json", "report.html"}
    for entry in record["outputs"]:
        assert io.sha256_file(folder / entry["path"]) == entry["sha256"]
    # The first frame under every light, the second under one of them.
    pictures = {"corner_boxes_gradient.png", "corner_boxes_vmf-20.png", "trench_vmf-20.png"}
    assert listed == {"lighting.csv", "lighting.md", "methods.png", *pictures}
    page = (folder / "report.html").read_text()
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert all(word in page for word in ("vmf:20", "slice-moments", *SOURCES, *CUTS, LIMITS))
    assert [entry["turn"] for entry in record["inputs"]] == [0, 120]
    assert {entry["up"] for entry in record["inputs"]} == {"z"}


def test_the_table_holds_everything(outcome):
    _, folder = outcome
    rows = rows_of(folder)
    expected = {
        (frame, light, cut, source, method)
        for frame in ("corner_boxes", "trench")
        for light in ("gradient", "vmf:20")
        for cut in CUTS
        for source in SOURCES
        for method in METHODS
        # Rays find mean directions, not halves between horizons.
        if (source, method) != (SOURCES[0], "bent-normal-average-horizon")
    }
    expected |= {
        (frame, light, "all bands", LIMITS, order)
        for frame in ("corner_boxes", "trench")
        for light in ("gradient", "vmf:20")
        for order in ("order 2", "order 4")
    }
    assert {(r["frame"], r["light"], r["cut"], r["source"], r["method"]) for r in rows} == expected
    assert len(rows) == len(expected)


@pytest.mark.parametrize("cut", CUTS)
def test_the_numbers_are_those_of_the_images(outcome, cut):
    """Relative errors from the definition, with everything estimated anew and every method called under its light."""
    result, _ = outcome
    radius = gtao.render.scenes.get("corner_boxes").radius
    scene = gtao.render.load_scene("corner_boxes", resolution=24)
    g = gtao.render.gbuffer(scene)
    mask = g.mask.numpy()
    # +y of the light is the top; the world's is +z.
    direction = np.array([math.cos(math.radians(40)) * math.cos(math.radians(30)), 0, math.sin(math.radians(40))])
    direction[1] = -math.cos(math.radians(40)) * math.sin(math.radians(30))
    environment = lighting.von_mises_fisher(direction, 20).map(128)
    light = lighting.to_view(lighting.von_mises_fisher(direction, 20).project(4), gtao.render.view_to_world(scene))
    whole = gtao.render.irradiance(scene, environment=environment, g=g, max_distance=radius, spp=64, seed=4)
    mean = whole.mean.numpy()[mask].mean()
    if cut.startswith("all bands"):
        truth, variance = whole.mean.numpy(), whole.variance.numpy()
    else:
        n = {"order 2": 9, "order 4": 25}[cut]
        light[n:] = 0
        runs = [
            gtao.render.directional(scene, g, radius, 32, seed, order=4, n_batches=2).mean.numpy() for seed in (0, 1)
        ]
        a, b = (run @ light for run in runs)
        truth, variance = (a + b) / 2, (a - b) ** 2 / 4
    given = (light, light)
    if cut.endswith("windowed"):
        # The width is the same however the light is turned.
        given = [lighting.non_negative(environment.project(order), "laplacian")[1] for order in (2, 4)]
        given = [lighting.window(light[:n], "laplacian", width) for n, width in zip((9, 25), given, strict=True)]

    def estimate(n_slices, n_steps, spatial=None, **directions):
        method = gtao.GTAO(radius=radius, n_slices=n_slices, n_steps=n_steps, **directions)
        ao = gtao.ambient_occlusion(g, method)
        return gtao.denoise(ao, g, spatial) if spatial else ao

    game = (3, 3, gtao.EdgeAwareFilter(passes=2))
    half = {"bent_normal": "average_horizon"}
    open_ = gtao.AmbientOcclusion(visibility=g.types.Tensor(np.ones(g.shape, np.float32)))
    for source, name, ao, method, coefficients in (
        ("dense slices", "slice-moments", estimate(32, 32, directional=True), gtao.SliceMoments(), given[0]),
        ("dense slices", "clipped-cone-4", estimate(32, 32, bent_normal=True), gtao.ClippedCone(order=4), given[1]),
        ("dense slices", METHODS[2], estimate(32, 32, **half), gtao.BentNormalIrradiance(order=4), given[1]),
        ("few slices, filtered", "slice-moments", estimate(*game, directional=True), gtao.SliceMoments(), given[0]),
        ("few slices, filtered", METHODS[2], estimate(*game, **half), gtao.BentNormalIrradiance(order=4), given[1]),
        ("dense slices", "unoccluded", open_, gtao.OcclusionTimesIrradiance(order=4), given[1]),
    ):
        image = gtao.irradiance(coefficients, g, ao, method).numpy()
        error = (image - truth)[mask].astype(float)
        expected = math.sqrt(np.mean(error**2) - variance[mask].mean()) / mean
        found = errors(result, "vmf:20", cut, source)[name]
        # The texels of the light are a degree away from where another azimuth puts them.
        assert found["rmse"] == pytest.approx(expected, rel=2e-2)
        assert found["bias"] == pytest.approx(error.mean() / mean, abs=2e-3)


def test_the_truth_and_what_methods_are_given_share_no_rays():
    config = workflows.CompareLightingConfig(scenes=("trench",), methods=("slice-moments",), **SMALL)
    (frame,) = frames.frames_of("trench", "trench", config, lambda _: lambda *_: None)
    runs = [*frame.truths, *(run for run in frame.harmonics["ray-traced visibility"]["slice-moments"])]
    noise = [run[:, :9] - runs[0][:, :9] for run in runs[1:]]
    for i, one in enumerate(noise):
        assert np.abs(one).max() > 1e-3
        assert not any(np.array_equal(one, other) for other in noise[:i])


def test_exact_moments_have_no_error_of_their_own(outcome):
    """Under light without higher bands, given ray-traced visibility, noise is all that is left."""
    result, _ = outcome
    for light, cuts in result.comparison.tables.items():
        for i, scene in enumerate(cuts["order 2"].scenes):
            found = errors(result, light, "order 2", "ray-traced visibility", i)
            # A mean square of n numbers is known to sqrt(2/n) of itself: with 3 colours alike, over 200 pixels, to 0.1;
            # truth and estimate both have it.
            assert found["slice-moments"]["rmse"] < 0.6 * scene.noise
            assert found["clipped-cone-4"]["rmse"] > found["slice-moments"]["rmse"]
            assert found["unoccluded"]["rmse"] > 0.05


def test_windowed_light_is_never_negative():
    sharp, smooth = lights.lights(["vmf:20", "vmf:0.5"])
    light = sharp.map.project(4)
    for order in (2, 4):
        assert lighting.minimum(light[: (order + 1) ** 2]).min() < -0.1
        assert lighting.minimum(sharp.windowed(light, order)).min() > -1e-9
    light = smooth.map.project(4)
    assert np.array_equal(smooth.windowed(light, 2), light[:9])


def test_what_the_cut_of_the_light_costs(outcome):
    result, _ = outcome
    for i in range(2):
        smooth, sharp = (errors(result, light, "all bands", LIMITS, i) for light in ("gradient", "vmf:20"))
        assert smooth["order 2"]["rmse"] < sharp["order 2"]["rmse"]
        assert sharp["order 4"]["rmse"] < sharp["order 2"]["rmse"]


def test_a_plane_in_the_open_is_right_for_all(tmp_path):
    config = workflows.CompareLightingConfig(scenes=("open_plane",), environments=("vmf:4",), **SMALL)
    result = workflows.compare_lighting(config, tmp_path / "out")
    assert set(errors(result, "vmf:4", "order 2", "dense slices")) == set(workflows.IRRADIANCE_METHODS)
    for name, found in errors(result, "vmf:4", "order 2", "dense slices").items():
        if name == "bent-normal-average-horizon":
            assert found["rmse"] > 0.01  # the plane is tilted, halves between horizons lean toward the viewer
        elif not name.startswith("triple-product"):
            # Factors cut to few bands do not multiply to a whole hemisphere.
            assert found["rmse"] < 0.02, name


@pytest.mark.parametrize("up", ["x", "y", "z"])
def test_the_top_of_the_light_is_up(up):
    (light,) = lights.lights(["gradient"])
    axis = np.eye(3)["xyz".index(up)]
    for turn in (0.0, 77.0):
        environment = lights.placed(light, up, turn)
        assert environment.lookup(axis) == pytest.approx(light.map.lookup([0, 1, 0]))
        assert np.linalg.det(environment.to_world) == pytest.approx(1)


def test_the_light_turns_about_the_vertical():
    (light,) = lights.lights(["disc:10"])
    brightest = [
        environment.to_world @ light.map.to_world.T @ lights._direction()
        for environment in (lights.placed(light, "z", turn) for turn in (0, 90, 180))
    ]
    for direction in brightest:
        assert direction[2] == pytest.approx(math.sin(math.radians(40)))
    assert brightest[0][:2] @ brightest[1][:2] == pytest.approx(0, abs=1e-12)
    assert brightest[0][:2] == pytest.approx(-brightest[2][:2])


def test_the_sun_stands_in_the_sky():
    (light,) = lights.lights(["sunsky"])
    first = light.map.project(1).mean(-1)
    assert first[1] > abs(first[2])  # Y_{1,-1} goes with y, the light's vertical
    assert light.map.radiance.max() > 100 * light.map.radiance.mean()


def test_maps_of_files_are_listed_with_their_hash(tmp_path):
    path = tmp_path / "room.exr"
    io.write_environment(path, lighting.gradient_sky((0, 1, 0), 1.0, 0.5, 0.1).map(16))
    config = workflows.CompareLightingConfig(
        scenes=("trench",), environments=(str(path),), methods=("occlusion",), up={"trench": "x"}, **SMALL
    )
    result = workflows.compare_lighting(config, tmp_path / "out")
    assert list(result.comparison.tables) == ["room"]
    frame, light = result.record["inputs"]
    assert frame["up"] == "x"
    assert (light["light"], light["sha256"]) == ("room", io.sha256_file(path))
    assert str(tmp_path) not in (tmp_path / "out" / "record.json").read_text()


def test_where_no_light_gets_it_is_left_out_in_words(tmp_path):
    # Turned about x, the disc stands above the plane of the first view and below that of the second.
    config = workflows.CompareLightingConfig(
        scenes=("open_plane",), environments=("disc:5", "gradient"), methods=("occlusion",), up="x", turn=180,
        all_sensors=True, **SMALL,
    )  # fmt: skip
    result = workflows.compare_lighting(config, tmp_path / "out")
    assert len(result.comparison.tables["disc:5"]["all bands"].scenes) == 1
    assert len(result.comparison.tables["gradient"]["all bands"].scenes) == 2
    (note,) = result.record["numbers"]["notes"]
    assert note == "Left out, because hardly any light gets there: open_plane, camera 1 under disc:5."
    path = tmp_path / "below.exr"
    io.write_environment(path, lighting.disc((0, -1, 0), 0.2).map(32))
    config = workflows.CompareLightingConfig(scenes=("open_plane",), environments=(str(path),), **SMALL)
    with pytest.raises(gtao.SceneError, match="no light reaches any"):
        workflows.compare_lighting(config, tmp_path / "dark")
    assert not (tmp_path / "dark" / "record.json").exists()


def test_a_black_map_is_left_out_in_words(tmp_path):
    path = tmp_path / "black.exr"
    io.write_environment(path, lighting.constant(0.0).map(8))
    config = workflows.CompareLightingConfig(
        scenes=("trench",), environments=(str(path), "gradient"), methods=("occlusion",), **SMALL
    )
    result = workflows.compare_lighting(config, tmp_path / "out")
    assert list(result.comparison.tables) == ["gradient"]
    assert result.record["numbers"]["notes"] == [
        "Left out, because hardly any light gets there: trench under black."
    ]  # fmt: skip


def test_methods_that_pictures_do_not_show_by_default(tmp_path):
    config = workflows.CompareLightingConfig(
        scenes=("trench",), environments=("gradient",), methods=("unoccluded", "cone-matched-4"), **SMALL
    )
    (view,) = workflows.compare_lighting(config, tmp_path / "out").comparison.views
    assert list(view.images) == ["unoccluded", "cone-matched-4"]
    with_others = dataclasses.replace(config, methods=("unoccluded", "slice-moments-4", "occlusion"))
    (view,) = workflows.compare_lighting(with_others, tmp_path / "out").comparison.views
    assert list(view.images) == ["occlusion", "slice-moments-4"]


def test_the_same_seed_gives_the_same_numbers(tmp_path):
    config = workflows.CompareLightingConfig(
        scenes=("trench",), environments=("vmf:80",), methods=("slice-moments",), **SMALL
    )
    a, b = (workflows.compare_lighting(config, tmp_path / name).record["numbers"] for name in "ab")
    assert a == b


def test_a_run_that_breaks_off_leaves_no_record(tmp_path, monkeypatch):
    config = workflows.CompareLightingConfig(
        scenes=("trench",), environments=("gradient",), methods=("occlusion",), **SMALL
    )
    workflows.compare_lighting(config, tmp_path / "out")
    (tmp_path / "out" / "mine.txt").write_text("kept")

    def full(*_):
        raise gtao.ImageError("no space left")

    monkeypatch.setattr(outputs, "save_figures", full)
    with pytest.raises(gtao.ImageError):
        workflows.compare_lighting(config, tmp_path / "out")
    assert not (tmp_path / "out" / "record.json").exists()
    assert (tmp_path / "out" / "mine.txt").exists()


def scene_of(name, **errors):
    methods = [
        plot.MethodResult(name=key.replace("_", "-"), label=key, group="g", metrics={"rmse": value, "bias": value / 2})
        for key, value in errors.items()
    ]
    return plot.SceneComparison(name=name, radius=1.0, truth=np.zeros((2, 2)), methods=methods)


def test_standings_by_hand():
    # The last two differ by rounding, so that neither wins there.
    scenes = [scene_of("one", a=0.1, b=0.3), scene_of("two", a=0.5, b=0.2), scene_of("three", a=0.1, b=0.1 + 1e-9)]
    table = plot.Comparison(scenes=scenes)
    found = tables.standings(standings.numbers_of(table), "all")["g"]
    assert found["a"] == {
        "rmse": pytest.approx(0.7 / 3), "bias": pytest.approx(0.35 / 3), "rank": pytest.approx(4 / 3), "wins": 1
    }  # fmt: skip
    assert found["b"]["rank"] == pytest.approx(4 / 3)
    assert found["b"]["wins"] == 1
    averages = tables.means({"x": {"all": table}, "y": {"all": table}}, limits="none")
    assert averages["all"]["g"]["b"] == pytest.approx(0.2)
    assert tables.means({"x": {"all": table}}, limits="g") == {}


def test_twins_are_no_rivals_under_smooth_light():
    errors = {"moment_zh": 0.2, "moment_zh_4": 0.2 - 1e-9, "slice_moments": 0.3, "slice_moments_4": 0.1}
    numbers = standings.numbers_of(plot.Comparison(scenes=[scene_of("one", **errors)]))
    smooth, sharp = (tables.standings(numbers, cut)["g"] for cut in ("order 2", "all bands"))
    assert {name: (row["rank"], row["wins"]) for name, row in smooth.items()} == {
        "moment-zh": (1, 1), "moment-zh-4": (1, 1), "slice-moments": (2, 0), "slice-moments-4": (1, 1)
    }  # fmt: skip
    assert {name: (row["rank"], row["wins"]) for name, row in sharp.items()} == {
        "moment-zh": (2, 0), "moment-zh-4": (2, 0), "slice-moments": (4, 0), "slice-moments-4": (1, 1)
    }  # fmt: skip
    # Without its plain one in the run a method is like any other.
    del numbers["one"]["errors"]["g"]["slice-moments"]
    assert tables.standings(numbers, "order 2")["g"]["moment-zh"]["rank"] == 2


def test_twins_are_the_same_under_smooth_light():
    """By their harmonics of bands 0 to 2; the triple product, which is no twin, differs there."""
    config = workflows.CompareLightingConfig(scenes=("corner_boxes",), resolution=16, spp=32)
    (frame,) = frames.frames_of("corner_boxes", "corner_boxes", config, lambda _: lambda *_: None)
    assert set(methods.TWINS) == {"slice-moments-4", "moment-zh-4", "cone-matched-4", "clipped-cone-4"}
    for found in frame.harmonics.values():
        low = {name: runs[0][:, :9] for name, runs in found.items()}
        for twin, plain in methods.TWINS.items():
            np.testing.assert_allclose(low[twin], low[plain], atol=2e-6)  # single precision, sums of a few terms
        assert np.abs(low["triple-product-4"] - low["triple-product"]).max() > 1e-2


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"methods": ("cone",)}, "method must be one of slice-moments"),
        ({"methods": ("occlusion", "occlusion")}, "methods given more than once"),
        ({"environments": ("gradient", "gradient")}, "environments given more than once"),
        ({"radius": 0.0}, "radius must be positive"),
        ({"radius": {"stairs": -1.0}}, "radius must be positive"),
        ({"up": "w"}, "up must be one of x, y, z"),
        ({"up": {"stairs": ""}}, "up must be one of x, y, z"),
        ({"turn": 400}, "turn must be an angle"),
        ({"turn": -400}, "turn must be an angle"),
        ({"turn": math.nan}, "turn must be an angle"),
        ({"spp": 40}, "spp must be a multiple of 16"),
        ({"spp": 16}, "spp must be a multiple of 16"),
        ({"seed": -1}, "seed must lie"),
        ({"resolution": 8}, "resolution must be at least 16"),
    ],
)
def test_bad_settings(options, message):
    with pytest.raises(gtao.ConfigError, match=message):
        workflows.CompareLightingConfig(**options)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["nowhere"], "no embedded scene is called 'nowhere'"),
        (["trench", "--environment", "sunset"], "light must be a .hdr or .exr file or one of gradient, vmf:NUMBER"),
        (["trench", "--environment", "vmf"], "light must be a .hdr or .exr file or one of"),
        (["trench", "--environment", "gradient:2"], "light must be a .hdr or .exr file or one of"),
        (["trench", "--environment", "vmf:big"], "light 'vmf:big' must have a number after the colon"),
        (["trench", "--environment", "vmf:-3"], "kappa must be"),
        (
            ["trench", "--environment", "disc:400"],
            "environment disc:DEGREES must lie above 0 and at most at 180 degrees, got 400",
        ),
        (["trench", "--environment", "missing.hdr"], "missing.hdr"),
        (["trench", "--environment", "a/m.hdr", "--environment", "b/m.exr"], "m.hdr"),
        (["trench", "--method", "cones"], "method must be one of slice-moments"),
        (["trench", "--up", "north"], "up must be one of x, y, z, got 'north'"),
        (["trench", "--radius", "0"], "must be positive or inf"),
        (["image.exr"], "image.exr is an image; light is traced through scenes"),
        (["empty"], "holds no .xml scene"),
    ],
)
def test_command_says_what_is_wrong(monkeypatch, capfd, tmp_path, words, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    (tmp_path / "image.exr").touch()
    monkeypatch.setattr(sys, "argv", ["gtao", "compare-lighting", *words, "-o", "out"])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    _, err = capfd.readouterr()
    assert stop.value.code == 2
    assert message in err
    assert len(err.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_files_of_one_name(tmp_path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        io.write_environment(tmp_path / folder / "sky.exr", lighting.constant().map(4))
    with pytest.raises(gtao.ConfigError, match="files of one name: sky"):
        lights.lights([str(tmp_path / "a" / "sky.exr"), str(tmp_path / "b" / "sky.exr")])


def test_maps_whose_pictures_would_have_one_name(tmp_path):
    path = tmp_path / "vmf-20.exr"
    io.write_environment(path, lighting.constant().map(4))
    with pytest.raises(gtao.ConfigError, match="'vmf:20' and 'vmf-20' would have the same file names"):
        lights.lights(["vmf:20", str(path)])
    assert len(lights.lights(["vmf:4", str(path)])) == 2


def test_command(monkeypatch, capfd, tmp_path):
    words = ["--method", "occlusion", "--environment", "disc:20", "--resolution", "16", "--spp", "32", "--turn", "10"]
    monkeypatch.setattr(sys, "argv", ["gtao", "compare-lighting", "trench", *words, "-o", str(tmp_path / "out")])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    out, _ = capfd.readouterr()
    assert stop.value.code == 0
    assert out.startswith("RMSE / mean irradiance, dense slices, mean over 1 kind of light\n")
    assert out.splitlines()[-1] == f"report: {tmp_path / 'out' / 'report.html'}"
    record = io.read_record(tmp_path / "out" / "record.json")
    config = record["config"]
    assert (config["methods"], config["environments"], config["turn"]) == (["occlusion"], ["disc:20"], 10)
    # The command of the record asks for the same again, wherever it writes.
    _, _, scene, _, _, *words = record["command"]
    assert scene == "trench"
    monkeypatch.setattr(sys, "argv", ["gtao", "compare-lighting", scene, "-o", str(tmp_path / "again"), *words])
    with pytest.raises(SystemExit):
        cli.main()
    again = io.read_record(tmp_path / "again" / "record.json")
    assert again["config"] == config
    assert again["numbers"] == record["numbers"]


def test_a_page_holds_so_many_pictures_only(outcome):
    result, _ = outcome
    comparison = result.comparison
    figures = plot.lighting_figures(comparison)
    many = [dataclasses.replace(comparison.views[0], frame=f"frame {i}") for i in range(40)]
    some = plot.lighting_figures(dataclasses.replace(comparison, views=many[:1]))
    drawn = figures | {f"frame-{i}_gradient": some["frame-0_gradient"] for i in range(40)}
    page = plot.lighting_report(dataclasses.replace(comparison, views=many), figures=drawn)
    # Half of two dozen for each of two lights, of which one has no view, and the bars.
    assert page.count("data:image/png") == 12 + 1


def test_equal_errors_are_drawn_by_name():
    figure = plot.lighting_bars({"all bands": {"g": {"c": 0.2, "b": 0.2, "d": 0.1, "a": 0.2}}})
    figure.draw_without_rendering()
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == ["d", "a", "b", "c"]


def test_figures_refuse_nothing_to_draw():
    with pytest.raises(gtao.ShapeError, match="no errors to draw"):
        plot.lighting_bars({"all bands": {"dense slices": {}}})
    truth, mask = np.ones((4, 5, 3)), np.ones((4, 5), bool)
    view = {"frame": "f", "light": "l", "source": "s", "truth": truth, "mask": mask}
    with pytest.raises(gtao.ShapeError, match="no image to draw"):
        plot.lighting_images(plot.LightingView(images={}, **view))
    with pytest.raises(gtao.ShapeError, match="both must be"):
        plot.lighting_images(plot.LightingView(images={"a": truth[1:]}, **view))
    with pytest.raises(gtao.ConfigError, match="no light to report"):
        plot.LightingComparison(tables={}, means={})
