"""Histories on disk: to the bit, checksummed, whole or not at all."""

import json

import numpy as np
import pytest

import gtao
from gtao.errors import RecordError
from gtao.io import read_history, write_history

HEIGHT, WIDTH = 10, 13
CAMERAS = {
    "perspective": gtao.PerspectiveCamera(WIDTH, HEIGHT, fx=11.3, fy=12.7, cx=6.1, near=0.1),
    "parallel": gtao.OrthographicCamera(WIDTH, HEIGHT, 2.7, cx=6.3),
}


def pose(k):
    c, s = np.cos(0.03 * k), np.sin(0.03 * k)
    return [[c, 0, s, 0.1 * k], [0, 1, 0, -0.02 * k], [-s, 0, c, 0.05 * k], [0, 0, 0, 1]]


def step(
    history,
    k,
    *,
    camera=CAMERAS["perspective"],
    dtype=np.float32,
    directions=True,
    posed=True,
    motion=False,
    recommended=False,
):
    """One frame of a camera that moves, with noise in every channel."""
    rng = np.random.default_rng(k)
    z = (2 + rng.random((HEIGHT, WIDTH))).astype(dtype)
    z[2:4, 3] = np.inf
    moved = rng.standard_normal((HEIGHT, WIDTH, 3)).astype(dtype) if motion else None
    g = gtao.GBuffer(z, None, camera, motion=moved, view_to_world=pose(k) if posed else None)

    def image(*channels):
        return g.types.Tensor(rng.random((HEIGHT, WIDTH, *channels)).astype(dtype))

    more = {"mean_direction": image(3), "visibility_sh": image(9), "unshaped": image()} if directions else {}
    ao = gtao.AmbientOcclusion(visibility=image(), **more, normal_v=g.normal_v, config=gtao.GTAO())
    temporal = gtao.TemporalFilter.recommended() if recommended else gtao.TemporalFilter()
    result = temporal.step(ao, g, history)
    return {name: getattr(result, name).numpy().copy() for name in ("visibility", *more)}


KINDS = {
    "a moving camera": {},
    "double precision": {"dtype": np.float64},
    "parallel projection": {"camera": CAMERAS["parallel"]},
    "visibility alone, without poses": {"directions": False, "posed": False},
    "motion of its own": {"motion": True, "posed": False},
    "deviations": {"recommended": True},
}


@pytest.mark.parametrize("options", KINDS.values(), ids=KINDS)
def test_frames_after_reading_are_those_of_a_run_without_a_break(options, tmp_path):
    whole, broken = gtao.History(), gtao.History()
    for k in range(8):
        want = step(whole, k, **options)
        got = step(broken, k, **options)
        write_history(tmp_path / "history.npz", broken)
        broken = read_history(tmp_path / "history.npz")
        for name in want:
            assert np.array_equal(want[name], got[name]), (name, k)
    assert broken.frame_index == whole.frame_index == 8
    assert (broken.camera, broken.view_to_world) == (whole.camera, whole.view_to_world)
    if "recommended" in options:
        assert all(map(np.array_equal, whole.contents.normal, broken.contents.normal))
    for name in ("visibility", "count", "view_z", "motion", "mean_direction", "visibility_sh", "unshaped", "deviation"):
        a, b = getattr(whole, name), getattr(broken, name)
        assert (a is None) == (b is None), name
        if a is not None:
            assert a.numpy().dtype == b.numpy().dtype
            assert np.array_equal(a.numpy(), b.numpy())


def test_an_empty_history(tmp_path):
    write_history(tmp_path / "history.npz", gtao.History())
    history = read_history(tmp_path / "history.npz")
    assert (history.is_empty, history.frame_index) == (True, 0)


def test_the_same_history_is_the_same_file(tmp_path):
    for name in ("a", "b"):
        history = gtao.History()
        step(history, 0)
        write_history(tmp_path / name, history)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def changed(path, **changes):
    """The same file with other arrays or numbers; its checksum stays."""
    with np.load(path) as stored:
        arrays = {name: stored[name] for name in stored.files}
    header = json.loads(str(arrays["header"])) | changes.pop("header", {})
    arrays |= {"header": np.array(json.dumps(header))} | changes
    np.savez(path, **arrays)


def test_what_cannot_be_read_is_refused_in_one_line(tmp_path):
    path, history = tmp_path / "history.npz", gtao.History()
    with pytest.raises(RecordError, match="no history at"):
        read_history(path)
    step(history, 0)
    write_history(path, history)
    whole = path.read_bytes()
    for wrong in (whole[: len(whole) // 2], b"", b"something else"):
        path.write_bytes(wrong)
        with pytest.raises(RecordError, match=r"not a whole history .*; remove it and begin with a new one$"):
            read_history(path)
    path.write_bytes(whole)
    changed(path, count=np.zeros((1, HEIGHT * WIDTH), np.float32))
    with pytest.raises(RecordError, match="damaged"):
        read_history(path)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"header": {"schema": 99}}, "schema 99, this gtao knows 1"),
        ({"header": {"camera": {"type": "fisheye"}}}, "camera type must be one of"),
        ({"count": np.ones((1, 3), np.float32)}, r"count has shape \(1, 3\)"),
        ({"header": {"view_to_world": [[1, 2]]}}, "must be a 4x4 matrix"),
    ],
)
def test_what_contradicts_itself_is_refused(changes, message, tmp_path, monkeypatch):
    path, history = tmp_path / "history.npz", gtao.History()
    step(history, 0)
    write_history(path, history)
    changed(path, **changes)
    # A writer of another version signs what it writes.
    monkeypatch.setattr("gtao.io.history._digest", lambda *_: str(np.load(path)["sha256"]))
    with pytest.raises(RecordError, match=message):
        read_history(path)


def test_an_error_leaves_the_old_file(tmp_path):
    path, history = tmp_path / "history.npz", gtao.History()
    write_history(path, history)
    before = path.read_bytes()
    with pytest.raises(gtao.ConfigError, match=r"must be a gtao\.History, got NoneType"):
        write_history(path, None)
    with pytest.raises(RecordError, match="it is a folder"):
        write_history(tmp_path, history)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["history.npz"]
