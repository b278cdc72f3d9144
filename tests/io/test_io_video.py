"""Videos hold the frames that were written, one after the other, and come whole or not at all."""

import builtins
import os
import stat
import subprocess
import weakref

import numpy as np
import pytest
from PIL import Image

from gtao import io
from gtao.errors import ConfigError, ImageError, ShapeError

RAMP = np.arange(256, dtype=np.uint8)
needs_ffmpeg = pytest.mark.skipif(io.find_ffmpeg() is None, reason="no FFmpeg: pip install 'gtao[video]'")


def frame(i, height=48, width=64):
    """A grey ramp that gets brighter, with a square that moves."""
    image = np.tile((RAMP[: 3 * width : 3] // 2 + 2 * i)[:, None], (height, 1, 3)).astype(np.uint8)
    image[8:24, 4 * i : 4 * i + 16] = (200, 60, 30)
    return image


def decoded(path):
    """(N, H, W, 3) frames of an MP4, and what FFmpeg says of it."""
    program = io.find_ffmpeg()
    told = subprocess.run([program, "-hide_banner", "-i", path], capture_output=True, text=True).stderr
    raw = subprocess.run(
        [program, "-v", "error", "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"],
        capture_output=True,
        check=True,
    ).stdout
    size = next(word for word in told.replace(",", " ").split() if "x" in word and word.replace("x", "").isdigit())
    width, height = map(int, size.split("x"))
    return np.frombuffer(raw, np.uint8).reshape(-1, height, width, 3), told


@needs_ffmpeg
def test_an_mp4_is_what_browsers_play_and_shows_the_frames(tmp_path):
    given = [frame(i) for i in range(9)]
    assert io.write_video(tmp_path / "a.mp4", iter(given), 12) == 9
    shown, told = decoded(tmp_path / "a.mp4")
    assert shown.shape == (9, 48, 64, 3)
    assert "h264" in told
    assert "yuv420p" in told
    assert "12 fps" in told
    # Colours at half the resolution blur the square's edges; brightness is kept to a few of 255 steps.
    for i, (before, after) in enumerate(zip(given, shown, strict=True)):
        grey = np.abs(before.astype(float).mean(-1) - after.astype(float).mean(-1))
        assert grey[28:].max() <= 4, i
        assert (
            np.abs(before[12:20, 4 * i + 6 : 4 * i + 10].astype(float) - after[12:20, 4 * i + 6 : 4 * i + 10]).max()
            < 12
        )
    # The index lies before the pictures, so that a browser starts before it has everything.
    data = (tmp_path / "a.mp4").read_bytes()
    assert 0 < data.index(b"moov") < data.index(b"mdat")


@needs_ffmpeg
def test_every_grey_survives(tmp_path):
    image = np.tile(RAMP[:, None, None].repeat(3, -1).repeat(4, 1).reshape(1, 1024, 3), (16, 1, 1))
    io.write_video(tmp_path / "a.mp4", [image] * 3, 24)
    shown, _ = decoded(tmp_path / "a.mp4")
    # 219 levels of brightness stand for 256, and their coding adds a step.
    assert np.abs(shown[-1].astype(int) - image).max() <= 3


@needs_ffmpeg
def test_odd_sizes_are_filled_up(tmp_path):
    odd = frame(0)[:47, :63]
    io.write_video(tmp_path / "a.mp4", [odd], 24)
    shown, _ = decoded(tmp_path / "a.mp4")
    assert shown.shape == (1, 48, 64, 3)
    assert np.abs(shown[0, :47, :60].astype(int) - odd[:, :60]).mean() < 4
    assert np.abs(shown[0, 47].astype(int) - shown[0, 46]).mean() < 2


@pytest.mark.parametrize("name", [pytest.param("a.mp4", marks=needs_ffmpeg), "a.gif"])
def test_the_same_frames_give_the_same_bytes(tmp_path, name):
    for folder in ("one", "two"):
        io.write_video(tmp_path / folder / name, (frame(i) for i in range(5)), 24)
    assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def gif(path):
    with Image.open(path) as image:
        for i in range(image.n_frames):
            image.seek(i)
            yield np.asarray(image.convert("RGB")), image.info["duration"], image.info.get("loop")


def test_a_gif_shows_the_frames_at_their_pace_for_ever(tmp_path):
    greys = RAMP[:, None].repeat(3, 1)
    given = [np.tile((RAMP[:64] + 4 * i)[:, None], (10, 1, 3)) for i in range(9)]
    assert io.write_video(tmp_path / "a.gif", given, 24, palette=greys) == 9
    shown, times, loops = zip(*gif(tmp_path / "a.gif"), strict=True)
    assert all(np.array_equal(a, b) for a, b in zip(shown, given, strict=True))
    # 9/24 s is 37.5 hundredths; no frame is more than half of one from its place.
    assert sum(times) in (370, 380)
    assert set(times) == {40, 50}
    assert loops[0] == 0


def test_a_gif_without_a_palette_takes_that_of_its_first_frame(tmp_path):
    io.write_video(tmp_path / "a.gif", (frame(i) for i in range(3)), 10)
    shown, times, _ = zip(*gif(tmp_path / "a.gif"), strict=True)
    assert times == (100,) * 3
    assert np.abs(shown[0].astype(int) - frame(0)).max() < 8
    assert tuple(shown[2][12, 16]) == pytest.approx((200, 60, 30), abs=8)


@pytest.mark.parametrize("name", [pytest.param("a.mp4", marks=needs_ffmpeg), "a.gif"])
def test_frames_are_not_held_together(tmp_path, name):
    alive, most = [], 0

    class Held(np.ndarray):
        pass

    def frames():
        nonlocal most
        for i in range(12):
            image = frame(i).view(Held)
            alive.append(weakref.ref(image))
            most = max(most, sum(ref() is not None for ref in alive))
            yield image

    assert io.write_video(tmp_path / name, frames(), 24) == 12
    # The one that is written, the one that is made, and the first of a generator that waits.
    assert most <= 3


@pytest.mark.parametrize("name", [pytest.param("a.mp4", marks=needs_ffmpeg), "a.gif"])
@pytest.mark.parametrize(
    ("frames", "words"),
    [
        ([], "there is no frame for a"),
        ([frame(0), frame(0)[:20]], "frame 1 has shape"),
        ([frame(0).astype(float)], "of uint8, got"),
        ([frame(0)[..., 0]], "of uint8, got"),
    ],
)
def test_wrong_frames_leave_nothing(tmp_path, name, frames, words):
    with pytest.raises(ShapeError, match=words):
        io.write_video(tmp_path / name, frames, 24)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", [pytest.param("a.mp4", marks=needs_ffmpeg), "a.gif"])
def test_a_source_that_fails_leaves_the_earlier_file(tmp_path, name):
    (tmp_path / name).write_text("earlier")

    def broken():
        yield frame(0)
        raise ImageError("no more")

    with pytest.raises(ImageError, match="no more"):
        io.write_video(tmp_path / name, broken(), 24)
    assert (tmp_path / name).read_text() == "earlier"
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("a.avi", {}, "must end in .mp4 or .gif"),
        ("a", {}, "must end in .mp4 or .gif"),
        ("a.gif", {"fps": 0}, "fps must lie in"),
        ("a.gif", {"fps": 60}, r"\(0, 50\] in a .gif"),
        ("a.mp4", {"fps": float("nan")}, "fps must lie in"),
        ("a.gif", {"palette": np.zeros((300, 3), np.uint8)}, "palette must hold 1 to 256"),
        ("a.gif", {"palette": np.zeros((2, 3))}, "palette must hold"),
    ],
)
def test_wrong_options_are_told(tmp_path, name, options, words):
    with pytest.raises(ConfigError, match=words):
        io.write_video(tmp_path / name, [frame(0)], **options)


def no_imageio(monkeypatch):
    real = builtins.__import__

    def without(name, *rest, **options):
        if name == "imageio_ffmpeg":
            raise ImportError(name)
        return real(name, *rest, **options)

    monkeypatch.setattr(builtins, "__import__", without)


def test_without_ffmpeg_one_is_told_what_to_install(tmp_path, monkeypatch):
    no_imageio(monkeypatch)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert io.find_ffmpeg() is None
    with pytest.raises(ConfigError, match=r"pip install 'gtao\[video\]'"):
        io.write_video(tmp_path / "a.mp4", [frame(0)])
    assert io.write_video(tmp_path / "a.gif", [frame(0)]) == 1


def test_an_ffmpeg_on_the_path_does_and_its_failure_is_told(tmp_path, monkeypatch):
    program = tmp_path / "bin" / "ffmpeg"
    program.parent.mkdir()
    program.write_text("#!/bin/sh\necho 'first' >&2\necho \"Unknown encoder 'libx264'\" >&2\nexit 1\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    no_imageio(monkeypatch)
    monkeypatch.setenv("PATH", f"{program.parent}{os.pathsep}{os.environ['PATH']}")
    assert io.find_ffmpeg() == str(program)
    with pytest.raises(ImageError, match=r"cannot write .*/a\.mp4: .*Unknown encoder"):
        io.write_video(tmp_path / "a.mp4", (frame(i) for i in range(200)))
    assert not (tmp_path / "a.mp4").exists()


@pytest.mark.parametrize(
    ("program", "words"),
    [
        ("/nonexist", "FFmpeg at /nonexist does not run: No such file"),
        ("/bin/false", "FFmpeg at /bin/false ended with status 1"),
        ("/bin/true", "FFmpeg at /bin/true ended with status 0"),
    ],
)
def test_an_ffmpeg_that_does_not_run_is_found_before_the_work(tmp_path, monkeypatch, program, words):
    monkeypatch.setattr(io.video, "find_ffmpeg", lambda: program)
    assert io.ffmpeg_fault().startswith(words)
    with pytest.raises(ConfigError, match=f"cannot write a.mp4: {words}"):
        io.check_video("a.mp4", 24)
    io.check_video("a.gif", 24)
    with pytest.raises(ImageError, match=f"cannot write {tmp_path / 'a.mp4'}: {words}") as error:
        io.write_video(tmp_path / "a.mp4", [frame(0)] * 3)
    assert ".partial" not in str(error.value)
    assert list(tmp_path.iterdir()) == []


def test_what_ffmpeg_says_of_the_file_that_it_writes_names_no_passing_one(tmp_path, monkeypatch):
    program = tmp_path / "ffmpeg"
    program.write_text('#!/bin/sh\nfor last; do :; done\necho "$last: no codec" >&2\nexit 1\n')
    program.chmod(0o700)
    monkeypatch.setattr(io.video, "find_ffmpeg", lambda: str(program))
    with pytest.raises(ImageError, match="says 'the file: no codec'"):
        io.write_video(tmp_path / "a.mp4", [frame(0)])


@needs_ffmpeg
def test_an_ffmpeg_that_runs_has_no_fault():
    assert io.ffmpeg_fault() is None
