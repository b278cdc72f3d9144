"""Methods on moving images, small: what is written, and what it says."""

import itertools
import json
import math
import weakref

import numpy as np
import pytest
from animate_runs import FILES, METHODS, PIPELINE, N, config
from PIL import Image

import gtao
from gtao import evaluate, io, plot, render, workflows


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
    with pytest.raises(gtao.ConfigError, match="there is no FFmpeg"):
        workflows.animate(config("still", ("gtao",), 2, video="mp4"), tmp_path / "other")
    assert not (tmp_path / "other").exists()


def test_an_ffmpeg_that_does_not_run_is_found_before_anything_begins(tmp_path, monkeypatch):
    for place in (io, io.video):
        monkeypatch.setattr(place, "find_ffmpeg", lambda: "/bin/false")
    given = {"methods": ("gtao",), "frames": 1, "resolution": 16}
    result = workflows.animate(config(**given, video="auto"), tmp_path / "out")
    assert (tmp_path / "out" / "gtao.gif").exists()
    (note,) = result.comparison.notes
    assert note.startswith("Videos are GIFs: FFmpeg at /bin/false ended with status 1")
    with pytest.raises(gtao.ConfigError, match="FFmpeg at /bin/false ended with status 1"):
        workflows.animate(config(**given, video="mp4"), tmp_path / "other")
    assert not (tmp_path / "other").exists()


def test_images_converge_after_a_cut(tmp_path):
    result = workflows.animate(config("cut", ("gtao,n_slices=1",), 4, resolution=16), tmp_path / "out")
    (numbers,) = result.record["numbers"].values()
    assert result.comparison.cut == 2
    errors = numbers["curves"]["rmse"]
    assert numbers["whole"]["convergence"] == evaluate.convergence_frames(errors, 2)


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
