"""Methods on moving images, small: what is written, what it says, and that a run that stopped goes on."""

import itertools
import json
import math
import shutil
import weakref
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import gtao
from gtao import evaluate, io, plot, render, workflows
from gtao.workflows.animation import pictures
from gtao.workflows.animation.methods import PIPELINES, methods_of
from gtao.workflows.animation.sources import read_path, source_of
from gtao.workflows.options import changed_pipeline, pipeline_from_options

SMALL = {"resolution": 32, "spp": 16, "video": "gif"}
PIPELINE = "published-pipeline"
METHODS = (PIPELINE, "gtao,n_slices=1,n_steps=2")
FILES = (PIPELINE, "gtao-n-slices-1-n-steps-2")
N = 4
#: What differs between identical runs.
TIMED = {"record.json", "report.html"}


class Stopped(Exception):
    pass


def config(animation="passing_object", methods=METHODS, frames=N, **options):
    return workflows.AnimateConfig(animation=animation, methods=methods, frames=frames, **SMALL | options)


def stops_after(n_frames):
    """Progress that ends the run when so many frames are done."""

    def progress(task, done, total):
        if task == "frames" and done == n_frames:
            raise Stopped

    return progress


def stop_after(n_frames, output, **options):
    with pytest.raises(Stopped):
        workflows.animate(config(**options), output, progress=stops_after(n_frames))


def files(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def assert_same(one, other):
    """The same files with the same bytes, but for the time in record and report."""
    a, b = files(one), files(other)
    assert a.keys() == b.keys()
    assert [name for name in a if a[name] != b[name] and name not in TIMED] == []
    records = [io.without_timestamps(io.read_record(folder / "record.json")) for folder in (one, other)]
    for record in records:
        # The command names the folder.
        del record["command"], record["git"]
    assert records[0] == records[1]


@pytest.fixture(scope="module")
def calm(tmp_path_factory):
    """A run that nothing disturbs."""
    folder = tmp_path_factory.mktemp("animate") / "out"
    return workflows.animate(config(exr=True), folder), folder


@pytest.fixture(scope="module")
def by_hand():
    """Truths and results of the same frames, made without the workflow."""
    animation = render.animations.build("passing_object", width=32, height=24)
    made = render.sequence(animation, N)
    pipeline, history = gtao.Pipeline.as_published(animation.radius), gtao.History()
    single = gtao.Pipeline(occlusion=gtao.GTAO(radius=animation.radius, n_slices=1, n_steps=2), clamp=False)
    found = []
    for frame in made:
        images = {
            FILES[0]: pipeline.step(frame.g, history).visibility.numpy(),
            FILES[1]: single.step(frame.g, frame_index=frame.index).visibility.numpy(),
        }
        truth = render.visibility(frame.scene, frame.g, animation.radius, 16)
        found.append((images, truth.mean.numpy(), truth.variance.numpy(), frame.g.mask.numpy()))
    return found


def test_everything_is_written_and_listed(calm):
    outcome, folder = calm
    record = io.read_record(folder / "record.json")
    assert {k: v for k, v in record.items() if k != "schema"} == json.loads(io.pretty_json(outcome.record))
    listed = {entry["path"] for entry in record["outputs"]}
    assert listed == {"animation.csv", "animation.md", "curves.png", *(f"{name}.gif" for name in FILES)}
    assert {p.name for p in folder.iterdir()} == listed | {"record.json", "report.html", "frames"}
    stems = ("truth", *FILES)
    names = {f"{stem}_{i:05d}.{end}" for stem in stems for i in range(N) for end in ("png", "exr")}
    names |= {f"{name}_error_{i:05d}.png" for name in FILES for i in range(N)}
    assert {p.name for p in (folder / "frames").iterdir()} == names
    page = (folder / "report.html").read_text()
    for name in FILES:
        assert f'src="{name}.gif"' in page
    assert set(record["methods"]) == set(METHODS)
    assert record["methods"][PIPELINE]["temporal"]["type"] == "TemporalFilter"
    assert record["inputs"][0]["path"] == "embedded:passing_object"
    again = record["command"]
    assert again[:3] == ["gtao", "animate", "passing_object"]
    assert again[again.index("--frames") + 1] == str(N)
    assert again.count("--method") == 2


def test_the_numbers_are_those_of_the_images(calm, by_hand):
    outcome, folder = calm
    numbers = outcome.record["numbers"]
    for name, file in zip(METHODS, FILES, strict=True):
        expected = [evaluate.corrected_rmse(images[file], t, v, mask=m) for images, t, v, m in by_hand]
        assert numbers[name]["curves"]["rmse"] == pytest.approx(expected, rel=1e-6)
        bias = [evaluate.bias(images[file], t, mask=m) for images, t, v, m in by_hand]
        assert numbers[name]["curves"]["bias"] == pytest.approx(bias, abs=1e-7)
        whole = numbers[name]["whole"]
        assert whole["rmse"] == pytest.approx(math.sqrt(np.mean(np.square(expected))))
        assert whole["last_rmse"] == pytest.approx(expected[-1])
    rows = (folder / "animation.csv").read_text().splitlines()
    assert len(rows) == 1 + 2 * N
    assert rows[1].split(",")[:2] == [PIPELINE, "0"]
    # The comma of a method's options does not end its cell.
    assert rows[-1].startswith(f'"{METHODS[1]}",{N - 1},')


def test_the_pictures_are_those_of_the_images(calm, by_hand):
    _, folder = calm
    for i, (images, truth, _, mask) in enumerate(by_hand):
        shown = np.asarray(Image.open(folder / "frames" / f"truth_{i:05d}.png"))
        assert np.array_equal(shown, plot.visibility_pixels(truth, mask))
        for file in FILES:
            shown = np.asarray(Image.open(folder / "frames" / f"{file}_{i:05d}.png"))
            assert np.array_equal(shown, plot.visibility_pixels(images[file], mask)), (i, file)
            shown = np.asarray(Image.open(folder / "frames" / f"{file}_error_{i:05d}.png"))
            assert np.array_equal(shown, plot.error_pixels(images[file], truth, mask, 0.25)), (i, file)
            channels, _ = io.read_channels(folder / "frames" / f"{file}_{i:05d}.exr")
            assert np.array_equal(channels["visibility.mean"], images[file])
        stored, variance, radius = io.read_truth(folder / "frames" / f"truth_{i:05d}.exr")
        assert np.array_equal(stored, truth)
        assert (variance[mask] > 0).any()
        assert radius == render.animations.get("passing_object").radius


def test_the_videos_show_truth_result_and_error(calm):
    outcome, folder = calm
    with Image.open(folder / f"{FILES[0]}.gif") as video:
        assert video.n_frames == N
        video.seek(N - 1)
        shown = np.asarray(video.convert("RGB")).astype(int)
    frames = (np.asarray(Image.open(folder / "frames" / f"{s}_{N - 1:05d}.png")) for s in
              ("truth", FILES[0], f"{FILES[0]}_error"))  # fmt: skip
    rmse = outcome.record["numbers"][PIPELINE]["curves"]["rmse"][-1]
    expected = plot.video_frame(*frames, name=PIPELINE, frame=N - 1, rmse=rmse, limit=0.25)
    # A GIF has every second grey, and every second colour of the scale of errors.
    assert np.abs(shown - expected).max() <= 8


def test_flicker_of_what_stands_still_is_the_change_of_its_pixels(tmp_path):
    result = workflows.animate(config("still", ("gtao,n_slices=1",), 4), tmp_path / "out")
    (numbers,) = result.record["numbers"].values()
    radius = render.animations.get("still").radius
    g = next(render.sequence(render.animations.build("still", width=32, height=24))).g
    method, mask = gtao.GTAO(radius=radius, n_slices=1), g.mask.numpy()
    images = [gtao.ambient_occlusion(g, method, frame_index=i).visibility.numpy().astype(float) for i in range(4)]
    steps = [math.sqrt(np.mean((b - a)[mask] ** 2)) for a, b in itertools.pairwise(images)]
    assert numbers["curves"]["step"][0] is None
    assert numbers["curves"]["step"][1:] == pytest.approx(steps, rel=1e-6)
    assert numbers["whole"]["step"] == pytest.approx(math.sqrt(np.mean(np.square(steps))), rel=1e-6)
    deviation = math.sqrt(np.var(images, axis=0, ddof=1)[mask].mean())
    assert numbers["whole"]["flicker"] == pytest.approx(deviation, rel=1e-6)
    # Nothing moves, and nothing remembers.
    assert numbers["whole"]["lag"] is None
    assert numbers["curves"]["lag"] == [None] * 4


def test_ghosts_lag_behind_the_estimate_without_a_past(tmp_path):
    given = (f"{PIPELINE},temporal.clamp=false", PIPELINE, f"{PIPELINE},temporal=none")
    result = workflows.animate(config(methods=given, frames=12, resolution=96), tmp_path / "out")
    numbers = result.record["numbers"]
    lags = [numbers[name]["whole"]["lag"] for name in given]
    # The clamp is there to take ghosts away; what has no past has none.
    assert lags[0] > 1.3 * lags[1] > 0
    assert lags[2] is None
    curve = numbers[given[0]]["curves"]["lag"]
    assert curve[0] is None
    # The whole is the mean over all pixels of the trail, so it lies among its frames.
    assert min(curve[1:]) < lags[0] < max(curve[1:])


@pytest.mark.parametrize("n_frames", [1, 3, N])
def test_a_run_goes_on_from_every_frame(calm, tmp_path, n_frames):
    _, expected = calm
    output = tmp_path / "out"
    stop_after(n_frames, output, exr=True)
    assert not (output / "record.json").exists()
    assert (output / "unfinished" / "state.json").exists()
    kept = {p.name: p.stat().st_ino for p in (output / "frames").iterdir()}
    workflows.animate(config(exr=True), output)
    assert_same(output, expected)
    # A file that is written again has another number.
    assert all((output / "frames" / name).stat().st_ino == number for name, number in kept.items())


@pytest.mark.parametrize("call", [1, 4])
def test_a_run_goes_on_from_within_a_frame(calm, tmp_path, monkeypatch, call):
    """Pictures of a frame whose state has not been kept are made again."""
    _, expected = calm
    output, real, calls = tmp_path / "out", pictures.Pictures.write_result, []

    def write(*arguments):
        calls.append(arguments)
        if len(calls) == call + 1:
            raise Stopped
        real(*arguments)

    monkeypatch.setattr(pictures.Pictures, "write_result", write)
    with pytest.raises(Stopped):
        workflows.animate(config(exr=True), output)
    monkeypatch.undo()
    workflows.animate(config(exr=True), output)
    assert_same(output, expected)


@pytest.mark.parametrize(
    "change",
    [{"error_limit": 0.5}, {"frames": 4}, {"methods": (PIPELINE,)}, {"settings": ("temporal.frames=12",)}],
)
def test_other_settings_start_anew(tmp_path, change):
    if "settings" in change:
        change = change | {"methods": (PIPELINE,)}
    stop_after(3, tmp_path / "out")
    (tmp_path / "out" / "frames" / "mine.png").write_text("a file of the user's")
    workflows.animate(config(**change), tmp_path / "out")
    assert (tmp_path / "out" / "frames" / "mine.png").read_text() == "a file of the user's"
    (tmp_path / "out" / "frames" / "mine.png").unlink()
    workflows.animate(config(**change), tmp_path / "fresh")
    assert_same(tmp_path / "out", tmp_path / "fresh")


def test_another_frame_rate_goes_on(tmp_path):
    """It changes videos only."""
    stop_after(2, tmp_path / "out")
    before = (tmp_path / "out" / "frames" / "truth_00001.png").stat().st_ino
    workflows.animate(config(fps=10.0), tmp_path / "out")
    assert (tmp_path / "out" / "frames" / "truth_00001.png").stat().st_ino == before


@pytest.mark.parametrize("damage", ["cut", "gone", "history", "text"])
def test_a_damaged_state_starts_anew(calm, tmp_path, damage):
    _, expected = calm
    output = tmp_path / "out"
    stop_after(3, output, exr=True)
    state = output / "unfinished"
    if damage == "cut":
        scores = state / "000003" / f"{FILES[0]}.scores.npz"
        scores.write_bytes(scores.read_bytes()[:200])
    elif damage == "gone":
        shutil.rmtree(state / "000003")
    elif damage == "history":
        path = state / "000003" / f"{FILES[0]}.history.npz"
        path.write_bytes(path.read_bytes()[:-300])
    else:
        (state / "state.json").write_text('{"settings": 3}')
    workflows.animate(config(exr=True), output)
    assert_same(output, expected)


def test_a_finished_run_makes_room_for_the_next(tmp_path):
    workflows.animate(config(methods=(PIPELINE,)), tmp_path / "out")
    workflows.animate(config("orbit", ("gtao",), 2), tmp_path / "out")
    workflows.animate(config("orbit", ("gtao",), 2), tmp_path / "fresh")
    assert_same(tmp_path / "out", tmp_path / "fresh")


def test_a_video_of_a_run_that_was_not_finished_goes_with_it(tmp_path, monkeypatch):
    def publish(*_, **__):
        raise Stopped

    monkeypatch.setattr(workflows.outputs.OutputDirectory, "publish", publish)
    with pytest.raises(Stopped):
        workflows.animate(config(frames=1), tmp_path / "out")
    monkeypatch.undo()
    assert (tmp_path / "out" / f"{FILES[1]}.gif").exists()
    workflows.animate(config(methods=(PIPELINE,), frames=1), tmp_path / "out")
    assert not (tmp_path / "out" / f"{FILES[1]}.gif").exists()


def test_truths_are_traced_once(tmp_path, monkeypatch):
    cache = tmp_path / "cache"
    workflows.animate(config("still", ("gtao",), 6), tmp_path / "one", cache=cache)
    # What stands still has one truth.
    assert len(list(cache.iterdir())) == 1
    workflows.animate(config(methods=("gtao",)), tmp_path / "two", cache=cache)
    assert len(list(cache.iterdir())) == 1 + N

    for n, change in enumerate(({"radius": 0.3}, {"spp": 24}, {"seed": 1}), 2):
        workflows.animate(config("still", ("gtao",), 1, **change), tmp_path / "other", cache=cache)
        assert len(list(cache.iterdir())) == n + N, change

    def trace(*_, **__):
        raise AssertionError("traced again")

    monkeypatch.setattr(render, "visibility", trace)
    workflows.animate(config(methods=(PIPELINE,)), tmp_path / "three", cache=cache)


def test_memory_does_not_grow_with_the_number_of_frames(tmp_path, monkeypatch):
    alive, most = [], 0
    real = render.sequence

    def watched(*arguments):
        nonlocal most
        for frame in real(*arguments):
            alive.append(weakref.ref(frame.g))
            most = max(most, sum(ref() is not None for ref in alive))
            yield frame
            del frame

    monkeypatch.setattr(render, "sequence", watched)
    workflows.animate(config(methods=(PIPELINE,), frames=12, resolution=16), tmp_path / "out")
    assert len(alive) == 12
    # The one at hand, and the one before, which the sequence still holds.
    assert most <= 2


def test_a_run_without_ffmpeg_says_so_and_writes_gifs(tmp_path, monkeypatch):
    for place in (io, io.video):
        monkeypatch.setattr(place, "find_ffmpeg", lambda: None)
    given = config("still", ("gtao",), 2, video="auto")
    result = workflows.animate(given, tmp_path / "out")
    assert (tmp_path / "out" / "gtao.gif").exists()
    assert "pip install 'gtao[video]'" in result.summary()
    with pytest.raises(gtao.ConfigError, match="no FFmpeg"):
        workflows.animate(config("still", ("gtao",), 2, video="mp4"), tmp_path / "other")
    assert not (tmp_path / "other").exists()


@pytest.mark.skipif(io.find_ffmpeg() is None, reason="no FFmpeg: pip install 'gtao[video]'")
def test_the_report_plays_mp4s(tmp_path):
    workflows.animate(config("still", ("gtao",), 2, video="auto"), tmp_path / "out")
    assert (tmp_path / "out" / "gtao.mp4").stat().st_size > 1000
    page = (tmp_path / "out" / "report.html").read_text()
    assert '<video controls loop muted playsinline preload=metadata aria-label="Video of gtao" src="gtao.mp4">' in page


def test_a_method_of_another_radius_than_the_truth_is_told(tmp_path):
    given = ("gtao,radius=0.25", "gtao,n_slices=1")
    result = workflows.animate(config("still", given, 1), tmp_path / "out")
    (note,) = result.comparison.notes
    assert note.startswith("gtao,radius=0.25 has a radius of 0.25, but the truth is that of 0.5")


class TestSources:
    def test_more_frames_than_an_animation_has(self):
        source = source_of(config("orbit", frames=200))
        assert source.n_frames == source.animation.n_frames == 200
        assert source_of(config("orbit", frames=None)).n_frames == render.animations.get("orbit").n_frames

    def test_a_cut_counts_only_if_it_is_shown(self):
        cut = render.animations.get("cut").cut
        assert source_of(config("cut", frames=None)).cut == cut
        assert source_of(config("cut", frames=cut)).cut is None

    def test_a_camera_goes_around_what_it_looks_at(self):
        source = source_of(config("trench", orbit=90.0, frames=9))
        poses = [np.array(frame.g.view_to_world) for frame in render.sequence(source.animation)]
        origin = render.view_to_world(render.load_scene("trench", resolution=32))
        assert poses[0] == pytest.approx(origin, abs=1e-5)
        turns = [a[:3, :3].T @ b[:3, :3] for a, b in itertools.pairwise(poses)]
        angles = [math.acos((np.trace(turn) - 1) / 2) for turn in turns]
        assert angles == pytest.approx([math.radians(10)] * 8, abs=1e-5)
        # The point in the middle stays in the middle, as far away as it was.
        z = float(np.median(render.gbuffer(render.load_scene("trench", resolution=32)).view_z.numpy()))
        middle = [pose[:3, 3] - z * pose[:3, 2] for pose in poses]
        assert np.ptp(middle, axis=0) == pytest.approx(np.zeros(3), abs=1e-4)

    def test_a_file_moves_a_scene(self, tmp_path):
        scene = tmp_path / "ball.xml"
        scene.write_text(SCENE)
        moves = [np.eye(4) for _ in range(3)]
        for i, move in enumerate(moves):
            move[0, 3] = 0.5 * i
        path = tmp_path / "path.json"
        path.write_text(json.dumps({"movers": {"ball": [m.tolist() for m in moves]}, "cut": 2}))
        source = source_of(config(str(scene), frames=None, path=str(path)))
        assert (source.n_frames, source.cut) == (3, 2)
        assert list(source.origin) == ["path", "bytes", "sha256", "moved_by"]
        shown = list(render.sequence(source.animation))
        assert [bool(frame.moving.numpy().any()) for frame in shown] == [True] * 3
        centres = [np.argwhere(frame.moving.numpy())[:, 1].mean() for frame in shown]
        assert centres[0] < centres[1] < centres[2]

    @pytest.mark.parametrize(
        ("content", "words"),
        [
            ("no json", "is not a path"),
            ("[]", "must hold an object with camera, movers or cut"),
            ("{}", "must hold an object"),
            ('{"cameras": []}', "must hold an object"),
            ('{"camera": 3}', "camera must be a list"),
            ('{"movers": {"a": 3}}', "every mover must be a list"),
            ('{"camera": [], "cut": "x"}', "cut must be the number of a frame"),
        ],
    )
    def test_a_wrong_path_is_told(self, tmp_path, content, words):
        path = tmp_path / "path.json"
        path.write_text(content)
        with pytest.raises(gtao.ConfigError, match=words):
            read_path(path)


SCENE = """<scene version="3.0.0">
  <shape type="sphere" id="ball"><float name="radius" value="0.4"/></shape>
  <shape type="rectangle"><transform name="to_world"><scale value="4"/><translate z="-0.4"/></transform></shape>
  <sensor type="perspective">
    <float name="fov" value="60"/>
    <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="24"/></film>
  </sensor>
</scene>
"""


class TestMethods:
    def test_options_of_all_and_of_each(self):
        given = methods_of([f"{PIPELINE},temporal.frames=12", "gtao,n_slices=3"], ["n_steps=5"], 0.7)
        assert [m.name for m in given] == [f"{PIPELINE},temporal.frames=12", "gtao,n_slices=3"]
        assert [m.file for m in given] == ["published-pipeline-temporal.frames-12", "gtao-n-slices-3"]
        first, second = (m.pipeline for m in given)
        assert first.temporal.frames == 12
        assert first.occlusion.n_steps == second.occlusion.n_steps == 5
        assert second.occlusion.n_slices == 3
        assert first.occlusion.radius == second.occlusion.radius == 0.7
        assert given[0].forgetful.temporal is None
        assert given[0].forgetful.spatial == first.spatial
        assert given[1].forgetful is None

    def test_a_radius_among_the_options_makes_the_whole_preset(self):
        for name, make in PIPELINES.items():
            (given,) = methods_of([f"{name},radius=0.2"], [], 0.7)
            assert given.pipeline == make(0.2)

    def test_a_file_describes_a_method(self, tmp_path):
        pipeline = gtao.Pipeline.as_published(0.3)
        (tmp_path / "mine.json").write_text(io.pretty_json(pipeline.to_dict()))
        (tmp_path / "bare.json").write_text(io.pretty_json(gtao.GTAO().to_dict()))
        text = f"{tmp_path / 'mine.json'},temporal.clamp=false"
        mine, bare = methods_of([text, str(tmp_path / "bare.json")], [], 0.7)
        assert mine.name == "mine,temporal.clamp=false"
        assert mine.pipeline.occlusion.radius == 0.3
        assert not mine.pipeline.temporal.clamp
        assert bare.pipeline.occlusion == gtao.GTAO()

    def test_files_have_names_of_their_own(self, tmp_path):
        (tmp_path / "truth.json").write_text(io.pretty_json(gtao.GTAO().to_dict()))
        given = methods_of([str(tmp_path / "truth.json"), "gtao,n_slices=1", "gtao,n-slices=1"[:4] + ",n_slices=1 "],
                           [], 1.0)  # fmt: skip
        assert [m.file for m in given] == ["truth-2", "gtao-n-slices-1", "gtao-n-slices-1-2"]

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            ("magic", "method must be one of published-pipeline, recommended-temporal, gtao, "),
            ("gtao,slices=3", "there is no option 'slices'"),
            ("gtao,n_slices", "an option is written key=value"),
            ("missing.json", "cannot take a method from missing.json"),
            (f"{PIPELINE},temporal.frames=0", "frames must be at least 1"),
        ],
    )
    def test_wrong_methods_are_told(self, text, words):
        with pytest.raises(gtao.ConfigError, match=words):
            methods_of([text], [], 1.0)


def test_stages_are_options():
    pipeline = pipeline_from_options("gtao", ["downsample.factor=4", "upsample.type=PlaneAwareUpsample",
                                              "temporal.frames=16", "spatial.passes=2"], 1.0)  # fmt: skip
    assert pipeline.downsample == gtao.Downsample(factor=4)
    assert pipeline.upsample == gtao.PlaneAwareUpsample()
    assert pipeline.temporal == gtao.TemporalFilter(frames=16)
    assert pipeline.spatial == gtao.EdgeAwareFilter(passes=2)
    assert changed_pipeline(pipeline, ["temporal=none", "spatial=none"]).temporal is None


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"methods": ()}, "no method"),
        ({"methods": ("gtao", "gtao")}, "more than once"),
        ({"frames": 0}, "frames must be at least 1"),
        ({"radius": -1.0}, "radius must be positive"),
        ({"radius": math.nan}, "radius must be positive"),
        ({"resolution": 8}, "at least 16"),
        ({"spp": 8}, "spp must be a multiple of 8, 16 at least"),
        ({"spp": 20}, "spp must be a multiple of 8"),
        ({"video": "avi"}, "video must be one of auto, mp4, gif"),
        ({"error_limit": 0.0}, "error_limit must lie in"),
        ({"seed": -1}, "seed must lie in"),
        ({"orbit": 90.0, "path": "a.json"}, "not both"),
        ({"orbit": 1e5}, "orbit must be"),
        ({"up": "w"}, "up must be one of"),
    ],
)
def test_wrong_settings_are_told(options, words):
    with pytest.raises(gtao.ConfigError, match=words):
        workflows.AnimateConfig(**options)


def test_a_path_says_how_many_frames_there_are():
    options = {"quick": True, "animation": "trench"}
    assert workflows.AnimateConfig.from_options(**options).frames == 16
    assert workflows.AnimateConfig.from_options(**options, path="a.json").frames is None
    assert workflows.AnimateConfig.from_options(**options, path="a.json", frames=3).frames == 3


def test_an_example_of_the_documentation_exists():
    """The page of the command names animations, which are those that there are."""
    text = (Path(__file__).parents[2] / "docs" / "howto" / "animate.md").read_text()
    for name in render.animations.names():
        assert f"`{name}`" in text
