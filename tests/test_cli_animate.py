"""``gtao animate``: what it says, and that bad input costs one line and touches nothing."""

import json
import sys

import pytest

import gtao
from gtao import cli, io

QUICK = ("--quick", "--resolution", 16, "--spp", 16, "--frames", 2, "--video", "gif")


@pytest.fixture
def command(monkeypatch, capfd, tmp_path):
    """Run ``gtao animate`` in the temporary folder; status, standard output and standard error."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["gtao", "animate", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        return stop.value.code, *capfd.readouterr()

    return run


def test_a_run_says_what_it_found_and_its_record_repeats_it(command, tmp_path):
    options = ["--method", "published-pipeline", "--method", "gtao,n_slices=1", "--set", "n_steps=3"]
    code, out, _ = command("orbit", "-o", "out", *QUICK, "--error-limit", 0.5, *options)
    assert code == 0
    assert "gtao,n_slices=1" in out
    assert "report: out/report.html" in out
    first = io.read_record(tmp_path / "out" / "record.json")
    assert first["config"]["settings"] == ["n_steps=3"]
    assert first["methods"]["gtao,n_slices=1"]["occlusion"]["n_steps"] == 3
    words = ["again" if word == "out" else word for word in first["command"][2:]]
    assert command(*words)[0] == 0
    again = io.read_record(tmp_path / "again" / "record.json")
    assert again["frames"] == first["frames"]
    assert again["numbers"] == first["numbers"]
    assert again["config"] == first["config"]


def test_a_scene_of_the_user_moves(command, tmp_path):
    assert command("trench", "-o", "out", *QUICK, "--orbit", 30, "--method", "gtao", "--exr")[0] == 0
    record = io.read_record(tmp_path / "out" / "record.json")
    assert record["config"]["orbit"] == 30
    assert "--exr" in record["command"]
    frames = [io.read_gbuffer(tmp_path / "out" / "frames" / f"truth_{i:05d}.exr") for i in (0, 1)]
    assert frames[0].view_z.numpy() != pytest.approx(frames[1].view_z.numpy(), abs=1e-3)


BAD = [
    (["nothing"], "there is no animation or scene 'nothing'; animations are still, "),
    (["missing.xml"], "no scene file missing.xml"),
    (["orbit", "--orbit", "30"], "animation 'orbit' moves by itself"),
    (["orbit", "--path", "path.json"], "animation 'orbit' moves by itself"),
    (["trench", "--path", "missing.json"], "no path at missing.json"),
    (["trench", "--path", "wrong.json"], "must hold an object with camera, movers or cut"),
    (["trench", "--path", "nobody.json"], "there is no shape 'nobody'"),
    (["trench", "--path", "bent.json"], "the camera's pose in frame 0"),
    (["trench", "--path", "late.json"], "path late.json: the camera's pose in frame 1 must be rigid"),
    (["trench", "--path", "uneven.json"], "camera has 3, mover '0' has 2"),
    (["trench", "--path", "cut.json"], "give --frames"),
    (["trench", "--up", "z"], "up is the axis of an orbit"),
    (["orbit", "--up", "z"], "up is the axis of an orbit"),
    (["cut", "--frames", "1"], "at least 2 frames"),
    (["--radius", "inf"], "method published-pipeline with radius inf: "),
    (["--set", "temporal.frames=5", "--method", "recommended-temporal"], "temporal.moving_frames must not exceed"),
    (["trench", "--path", "short.json", "--frames", "5"], "has 2 entries for 5 frames"),
    (["--method", "magic"], "method must be one of published-pipeline, "),
    (["--method", "broken.json"], "cannot take a method from broken.json"),
    (["--method", "gtao,n_slices=0"], "n_slices"),
    (["--set", "foo=1"], "there is no option 'foo'"),
    (["--set", "temporal.frames=none"], "temporal.frames must be a whole number"),
    (["--method", "gtao", "--method", "gtao"], "methods given more than once"),
    (["--frames", "0"], "--frames"),
    (["--spp", "20"], "spp must be a multiple of 8"),
    (["--radius", "-1"], "must be positive or inf, got -1"),
    (["--video", "avi"], "video must be one of auto, mp4, gif"),
    (["--fps", "0"], "fps must lie in"),
    (["--video", "gif", "--fps", "100"], "fps must lie in (0, 50]"),
    (["--error-limit", "nan"], "error_limit must lie in"),
    (["--resolution", "8"], "--resolution"),
    (["-o", "file.txt/out"], "a parent of it is a file"),
]


@pytest.mark.parametrize(
    ("options", "words"), BAD, ids=lambda value: " ".join(value) if isinstance(value, list) else ""
)
def test_bad_input_is_one_line_and_touches_nothing(command, tmp_path, options, words):
    pose = [[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 5], [0, 0, 0, 1]]
    contents = {
        "wrong.json": [1],
        "nobody.json": {"movers": {"nobody": [pose]}},
        "bent.json": {"camera": [[[2.0, 0, 0, 0], *pose[1:]]]},
        "late.json": {"camera": [pose, [*pose[:3], [0, 0, 1, 1]]]},
        "uneven.json": {"camera": [pose] * 3, "movers": {"0": [pose] * 2}},
        "cut.json": {"cut": 1},
        "short.json": {"camera": [pose] * 2},
        "broken.json": {"type": "Nothing"},
    }
    for name, content in contents.items():
        (tmp_path / name).write_text(json.dumps(content))
    (tmp_path / "file.txt").write_text("a file")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "record.json").write_text("earlier")
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    given = options if options[0] == "-o" or "-o" in options else ["-o", "out", *options]
    code, out, err = command(*QUICK[:5], *given)
    assert code == 2
    assert out == ""
    # Beside the line itself there may be the bar of a task that had begun.
    line = err.splitlines()[-1]
    assert line.startswith("gtao: ")
    assert words in line
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_options_of_all_methods_have_to_fit_them_all(command):
    code, _, err = command("still", "-o", "out", *QUICK, "--method", "gtao", "--method", "hbao", "--set", "n_slices=2")
    assert code == 2
    assert "n_slices" in err


def test_the_help_names_the_animations(command):
    code, out, _ = command("--help")
    assert code == 0
    text = " ".join(word for word in out.split() if word != "│")
    for name in gtao.render.animations.names():
        assert name in text
