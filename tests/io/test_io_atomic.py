"""Files appear whole or not at all."""

import errno
import os
import stat

import _child
import pytest

from gtao.errors import ImageError, RecordError
from gtao.io.atomic import atomic_path, ensure_writable, write_text


def names(folder):
    return sorted(p.name for p in folder.iterdir())


def test_writes_makes_folders_and_leaves_nothing_else(tmp_path):
    path = tmp_path / "new" / "folder" / "a.txt"
    write_text(path, "gänz")
    assert path.read_text(encoding="utf-8") == "gänz"
    assert names(path.parent) == ["a.txt"]


def test_temporary_file_lies_beside_the_target_with_its_suffix(tmp_path):
    with atomic_path(tmp_path / "a.npz") as partial:
        assert partial.parent == tmp_path
        assert partial.suffix == ".npz"
        assert not (tmp_path / "a.npz").exists()
        partial.write_bytes(b"x")
    assert names(tmp_path) == ["a.npz"]


def test_new_files_follow_the_umask_and_old_ones_keep_their_mode(tmp_path):
    path = tmp_path / "a"
    before = os.umask(0o027)
    try:
        write_text(path, "1")
    finally:
        os.umask(before)
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    path.chmod(0o664)
    write_text(path, "2")
    assert stat.S_IMODE(path.stat().st_mode) == 0o664


def test_a_link_is_followed(tmp_path):
    (tmp_path / "real").write_text("old")
    (tmp_path / "link").symlink_to("real")
    write_text(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "new"


@pytest.mark.parametrize("existing", [None, "old"])
def test_a_failing_body_changes_nothing(tmp_path, existing):
    path = tmp_path / "a"
    if existing:
        path.write_text(existing)

    def fail():
        with atomic_path(path) as partial:
            partial.write_text("half")
            raise KeyError("body")

    with pytest.raises(KeyError, match="body"):
        fail()
    assert names(tmp_path) == (["a"] if existing else [])
    if existing:
        assert path.read_text() == existing


def test_a_full_disk_is_one_line(tmp_path):
    def fill():
        with atomic_path(tmp_path / "a"), open("/dev/full", "w") as full:
            full.write("x")

    with pytest.raises(ImageError, match=r"cannot write .*a: no space left on the device; free some space"):
        fill()
    assert names(tmp_path) == []


def test_errors_of_our_own_pass_through(tmp_path):
    def fail():
        with atomic_path(tmp_path / "a"):
            raise ImageError("mine")

    with pytest.raises(ImageError, match=r"^mine$"):
        fail()


@pytest.mark.parametrize("write", [lambda p: write_text(p, "x"), ensure_writable])
class TestUnwritable:
    def test_folder(self, tmp_path, write):
        with pytest.raises(ImageError, match="it is a folder; give the name of a file"):
            write(tmp_path)

    def test_device_survives(self, write):
        with pytest.raises(ImageError, match="device or a pipe"):
            write("/dev/null")
        assert stat.S_ISCHR(os.stat("/dev/null").st_mode)

    def test_parent_is_a_file(self, tmp_path, write):
        (tmp_path / "file").write_text("")
        with pytest.raises(ImageError, match="a parent of it is a file, not a folder; choose another place"):
            write(tmp_path / "file" / "a.exr")

    def test_no_such_place(self, write):
        with pytest.raises(ImageError, match=r"cannot write /proc/gtao/a\.exr: .*; choose another place"):
            write("/proc/gtao/a.exr")

    def test_permission(self, tmp_path, write, monkeypatch):
        def refuse(*_):
            raise PermissionError(errno.EACCES, "refused")

        monkeypatch.setattr(os, "open", refuse)  # the tests may run as root, whom no mode stops
        with pytest.raises(ImageError, match="permission denied; choose another place or make the folder writable"):
            write(tmp_path / "a")

    def test_read_only_file(self, tmp_path, write, monkeypatch):
        (tmp_path / "a").write_text("keep")
        monkeypatch.setattr(os, "access", lambda *_: False)
        with pytest.raises(ImageError, match="permission denied"):
            write(tmp_path / "a")
        assert (tmp_path / "a").read_text() == "keep"

    def test_name_too_long(self, tmp_path, write):
        with pytest.raises(ImageError, match="the name is too long; choose a shorter one"):
            write(tmp_path / ("x" * 300))

    def test_loop_of_links(self, tmp_path, write):
        (tmp_path / "a").symlink_to("b")
        (tmp_path / "b").symlink_to("a")
        with pytest.raises(ImageError, match="cannot write"):
            write(tmp_path / "a")

    def test_null_byte(self, write):
        with pytest.raises(ImageError, match="cannot write"):
            write("a\0b")


def test_the_error_class_is_the_callers(tmp_path):
    with pytest.raises(RecordError):
        write_text(tmp_path, "x", error=RecordError)


def test_ensure_writable_leaves_no_trace(tmp_path):
    (tmp_path / "a").write_text("keep")
    ensure_writable(tmp_path / "a")
    ensure_writable(tmp_path / "b")
    ensure_writable(tmp_path / "c" / "d" / "e")
    assert names(tmp_path) == ["a"]
    assert (tmp_path / "a").read_text() == "keep"


def test_remains_of_dead_writers_are_removed_and_of_living_ones_kept(tmp_path):
    script = """
from gtao.io import atomic_path
context = atomic_path(sys.argv[1])
print(json.dumps([os.getpid(), context.__enter__().name]), flush=True)
os._exit(0)  # no finally block runs
"""
    dead, left = _child.run(script, tmp_path / "a.txt")
    assert names(tmp_path) == [left]
    living = left.replace(f"-{dead}-", f"-{os.getppid()}-")
    foreign = left.replace(f"-{dead}-", f"x-{dead}-")
    other = left.replace(".a.txt.", ".b.txt.")
    for name in (living, foreign, other):
        (tmp_path / name).write_text("half")
    write_text(tmp_path / "a.txt", "whole")
    assert names(tmp_path) == sorted([living, foreign, other, "a.txt"])


KILLED = """
import random
import numpy as np
from types import SimpleNamespace
from gtao.io import TransportCache, read_channels, write_channels, write_text
folder, random_time = sys.argv[1], random.Random(7)
rng = np.random.default_rng(0)
n = 2000
walks = rng.multinomial(16, [0.4, 0.3, 0.2, 0.1], size=(2, n)).transpose(0, 2, 1).astype(np.uint16)
transport = SimpleNamespace(
    escaped=walks[:, :3], remaining=walks[:, 3], pixel=np.arange(n, dtype=np.uint32), edge=np.zeros(n, bool),
    width=50, height=40, spp=32, n_batches=2, n_bounces=3, seed=0)
noise = rng.random((200, 300), dtype=np.float32)
cache = TransportCache(folder)

def text(i):
    write_text(f"{folder}/text", f"{i}:" + "x" * 300_000 + "end")

def image(i):
    write_channels(f"{folder}/image.exr", {"Z": noise + np.float32(i)}, {"i": i})

def counts(i):
    cache.put({"a": 1}, transport)

def text_is_whole():
    content = open(f"{folder}/text").read()
    return content.endswith("xend") and len(content.partition(":")[2]) == 300_003

def image_is_whole():
    channels, metadata = read_channels(f"{folder}/image.exr")
    return np.array_equal(channels["Z"], noise + np.float32(metadata["manifest"]["i"]))

def counts_are_whole():
    stored = cache.get({"a": 1})
    return stored is not None and np.array_equal(stored.escaped, transport.escaped)

results = []
for write, whole, path in (
    (text, text_is_whole, f"{folder}/text"),
    (image, image_is_whole, f"{folder}/image.exr"),
    (counts, counts_are_whole, str(cache.path({"a": 1}))),
):
    for _ in range(10):
        child = os.fork()
        if child == 0:
            i = 0
            while True:
                write(i)
                i += 1
        while not os.path.exists(path):
            time.sleep(0.001)
        time.sleep(random_time.uniform(0.0, 0.04))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        results.append(whole())
    write(0)
left = [name for name in os.listdir(folder) if "partial" in name]
print(json.dumps({"whole": results, "left": left, "damaged": cache.damaged}))
"""


def test_writers_killed_at_random_leave_whole_files(tmp_path):
    result = _child.run(KILLED, tmp_path)
    assert result["whole"] == [True] * 30
    assert result["left"] == []
    assert result["damaged"] == []
