"""A run of an animation that stopped goes on, and starts anew where anything has changed."""

import json
import shutil

import pytest
from animate_runs import BALL, FILES, PIPELINE, SCENE, N, Stopped, assert_same, config, stop_after

from gtao import render, workflows
from gtao.workflows.animation import pictures


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


#: One method on two of the smallest frames, where it does not matter what they show.
TINY = {"methods": ("gtao,n_slices=1,n_steps=1",), "frames": 2, "resolution": 16}


@pytest.mark.parametrize(
    "change", [{"error_limit": 0.5}, {"frames": 1}, {"methods": ("gtao,n_slices=2",)}, {"settings": ("n_steps=2",)}]
)
def test_other_settings_start_anew(tmp_path, change):
    stop_after(1, tmp_path / "out", **TINY)
    (tmp_path / "out" / "frames" / "mine.png").write_text("a file of the user's")
    workflows.animate(config(**TINY | change), tmp_path / "out")
    assert (tmp_path / "out" / "frames" / "mine.png").read_text() == "a file of the user's"
    (tmp_path / "out" / "frames" / "mine.png").unlink()
    workflows.animate(config(**TINY | change), tmp_path / "fresh")
    assert_same(tmp_path / "out", tmp_path / "fresh")


@pytest.mark.parametrize("changed", ["scene.xml", "ball.xml", "path.json"])
def test_other_contents_of_the_same_files_start_anew(tmp_path, changed):
    """Of the scene, of a file that it includes, and of the path."""
    ball = '<scene version="3.0.0"><shape type="sphere" id="ball"><float name="radius" value="0.4"/></shape></scene>'
    poses = [[[1, 0, 0, 0.2 + 0.1 * i], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]] for i in range(2)]
    contents = {
        "scene.xml": (SCENE.replace(BALL, '<include filename="ball.xml"/>'), ('"60"', '"45"')),
        "ball.xml": (ball, ('"0.4"', '"0.7"')),
        "path.json": (json.dumps({"movers": {"ball": poses}}), ("0.2", "0.6")),
    }
    for name, (text, _) in contents.items():
        (tmp_path / name).write_text(text)
    given = TINY | {"animation": str(tmp_path / "scene.xml"), "path": str(tmp_path / "path.json")}
    # Not that of the scene, which would tell some changes.
    given["radius"] = 0.5
    stop_after(1, tmp_path / "out", **given)
    text, change = contents[changed]
    (tmp_path / changed).write_text(text.replace(*change))
    workflows.animate(config(**given), tmp_path / "out")
    workflows.animate(config(**given), tmp_path / "fresh")
    assert_same(tmp_path / "out", tmp_path / "fresh")


def test_another_frame_rate_goes_on(tmp_path):
    """It changes videos only."""
    stop_after(2, tmp_path / "out")
    before = (tmp_path / "out" / "frames" / "truth_00001.png").stat().st_ino
    workflows.animate(config(fps=10.0), tmp_path / "out")
    assert (tmp_path / "out" / "frames" / "truth_00001.png").stat().st_ino == before


@pytest.mark.parametrize("damage", ["cut", "gone", "history", "text", "pictures", "picture", "exr"])
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
    elif damage == "pictures":
        shutil.rmtree(output / "frames")
    elif damage == "picture":
        path = output / "frames" / f"{FILES[0]}_error_00001.png"
        path.write_bytes(path.read_bytes()[:-40])
    elif damage == "exr":
        (output / "frames" / "truth_00000.exr").unlink()
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

    def truths(**options):
        workflows.animate(config(**TINY | options), tmp_path / "out", cache=cache)
        return len(list(cache.iterdir()))

    # What stands still has one truth.
    assert truths(animation="still") == 1
    assert truths() == 3
    for n, change in enumerate(({"radius": 0.3}, {"spp": 24}, {"seed": 1}), 4):
        assert truths(animation="still", frames=1, **change) == n, change

    def trace(*_, **__):
        raise AssertionError("traced again")

    monkeypatch.setattr(render, "visibility", trace)
    assert truths(methods=("gtao,n_slices=2",)) == 6
