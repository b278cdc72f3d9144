"""Transport counts on disk and in the cache: exact, checksummed, whole or a miss."""

import dataclasses
import json
import os
import zipfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import gtao
from gtao.errors import RecordError
from gtao.io import StoredTransport, TransportCache, default_cache_directory, read_transport, write_transport

N_BATCHES, K, PER_BATCH = 4, 3, 16
ARRAYS = ("escaped", "remaining", "pixel", "edge")
COUNTS = ("width", "height", "spp", "n_batches", "n_bounces", "seed")


def transport(n=30, dtype=np.uint16, **changes):
    rng = np.random.default_rng(11)
    walks = rng.multinomial(PER_BATCH, [0.4, 0.3, 0.2, 0.1], size=(N_BATCHES, n)).astype(dtype)
    fields = {
        "escaped": walks[:, :, :K].transpose(0, 2, 1),
        "remaining": walks[:, :, K],
        "pixel": np.sort(rng.choice(9 * 7, n, replace=False)).astype(np.uint32),
        "edge": rng.random(n) < 0.2,
        "width": 9,
        "height": 7,
        "spp": N_BATCHES * PER_BATCH,
        "n_batches": N_BATCHES,
        "n_bounces": K,
        "seed": 5,
    }
    return SimpleNamespace(**{**fields, **changes})


def assert_same(stored, original):
    for name in ARRAYS:
        assert getattr(stored, name).dtype == getattr(original, name).dtype
        assert np.array_equal(getattr(stored, name), getattr(original, name))
    assert all(getattr(stored, name) == getattr(original, name) for name in COUNTS)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.uint32])
def test_round_trip(tmp_path, dtype):
    original = transport(dtype=dtype)
    write_transport(tmp_path / "t.npz", original, {"name": "bowl", "radius": np.inf})
    stored = read_transport(tmp_path / "t.npz")
    assert_same(stored, original)
    assert stored.metadata == {"name": "bowl", "radius": "inf"}


def test_no_surface_at_all(tmp_path):
    write_transport(tmp_path / "t.npz", transport(n=0))
    assert read_transport(tmp_path / "t.npz").pixel.shape == (0,)


def test_fields_are_those_of_the_renderer(tmp_path):
    from gtao.render import Transport

    write_transport(tmp_path / "t.npz", transport())
    stored = read_transport(tmp_path / "t.npz")
    assert set(stored.fields()) == {f.name for f in dataclasses.fields(Transport)}
    again = Transport(**stored.fields())
    assert_same(again, transport())
    expected = transport().escaped.sum(axis=(0)) / (N_BATCHES * PER_BATCH)
    assert np.allclose(again.T.reshape(K, -1)[:, transport().pixel], expected, atol=1e-7)


def test_same_input_same_bytes(tmp_path):
    for name in ("a.npz", "b.npz"):
        write_transport(tmp_path / name, transport(), {"b": 1, "a": 2})
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_counts_are_compressed(tmp_path):
    big = transport(n=60)
    write_transport(tmp_path / "t.npz", big)
    with zipfile.ZipFile(tmp_path / "t.npz") as archive:
        info = archive.getinfo("escaped.npy")
    assert info.compress_size < 0.7 * info.file_size


def spoiled(name, index, value):
    array = np.array(getattr(transport(), name))
    array[index] = value
    return transport(**{name: array})


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        (spoiled("escaped", (0, 0, 0), 99), "1 pixels have lost or gained paths"),
        (spoiled("remaining", (slice(None), 3), 99), "4 pixels have lost"),
        (spoiled("pixel", -1, 63), "pixel must rise strictly and stay below 63"),
        (spoiled("pixel", 1, 0), "pixel must rise strictly"),
        (transport(edge=np.zeros(29, bool)), r"edge has shape \(29,\), expected \(30,\)"),
        (transport(edge=np.zeros(30)), "edge has type float64, expected bool"),
        (transport(n_bounces=4), r"escaped has shape \(4, 3, 30\), expected \(4, 4, 30\)"),
        (transport(escaped=transport().escaped.astype(float)), "escaped has type float64, expected unsigned"),
        (transport(spp=65), "spp 65 is no multiple of n_batches 4"),
        (transport(width=0), "width must be a positive integer, got 0"),
    ],
)
def test_counts_that_do_not_add_up_are_not_written(tmp_path, bad, message):
    with pytest.raises(RecordError, match=message):
        write_transport(tmp_path / "t.npz", bad)
    assert list(tmp_path.iterdir()) == []


def test_missing(tmp_path):
    with pytest.raises(RecordError, match="no transport file at"):
        read_transport(tmp_path / "t.npz")


def test_cut_anywhere(tmp_path):
    path = tmp_path / "t.npz"
    write_transport(path, transport())
    data = path.read_bytes()
    for n in range(0, len(data), 7):
        path.write_bytes(data[:n])
        with pytest.raises(RecordError, match="remove it and render again") as caught:
            read_transport(path)
        assert "\n" not in str(caught.value)


def test_altered_bytes_are_noticed_or_harmless(tmp_path):
    """A byte of the archive's own bookkeeping may be idle; the counts are then still right."""
    path = tmp_path / "t.npz"
    original = transport()
    write_transport(path, original)
    data = path.read_bytes()
    rng = np.random.default_rng(0)
    refused = 0
    for _ in range(400):
        copy = bytearray(data)
        copy[rng.integers(len(data))] ^= 1 << rng.integers(8)
        path.write_bytes(copy)
        try:
            stored = read_transport(path)
        except RecordError:
            refused += 1
        else:
            assert_same(stored, original)
    assert refused > 300


def rewrite(path, **changes):
    """A well-formed archive with other content."""
    with np.load(path) as stored:
        content = {name: stored[name] for name in stored.files}
    np.savez_compressed(path, **{**content, **changes})


def test_an_exchanged_array_is_noticed(tmp_path):
    path = tmp_path / "t.npz"
    write_transport(path, transport())
    edge = ~transport().edge
    rewrite(path, edge=edge)  # the counts still add up
    with pytest.raises(RecordError, match="its checksum differs"):
        read_transport(path)


def test_a_newer_layout_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr("gtao.io.transport.SCHEMA", 2)
    write_transport(tmp_path / "t.npz", transport())
    monkeypatch.undo()
    with pytest.raises(RecordError, match="has schema 2, this gtao knows 1"):
        read_transport(tmp_path / "t.npz")


def test_pickles_are_not_loaded(tmp_path):
    class Trap:
        def __reduce__(self):
            return os.abort, ()

    path = tmp_path / "t.npz"
    write_transport(path, transport())
    rewrite(path, escaped=np.array([Trap()], dtype=object))
    with pytest.raises(RecordError, match="not a whole transport file"):
        read_transport(path)


KEY = {"scene": "ab12", "camera": {"fx": 1.5, "near": 0.0}, "spp": 64, "seed": 5, "radius": np.inf}


class TestCache:
    def test_hit_and_miss(self, tmp_path):
        cache = TransportCache(tmp_path / "cache")
        assert cache.get(KEY) is None
        path = cache.put(KEY, transport(), {"name": "bowl"})
        assert path == cache.path(KEY)
        stored = TransportCache(tmp_path / "cache").get(dict(reversed(KEY.items())))
        assert isinstance(stored, StoredTransport)
        assert_same(stored, transport())
        assert stored.metadata["name"] == "bowl"
        assert cache.get({**KEY, "seed": 6}) is None
        assert cache.damaged == []

    def test_every_part_of_the_key_matters(self, tmp_path):
        cache = TransportCache(tmp_path)
        keys = [KEY, {**KEY, "camera": {"fx": 1.5}}, {**KEY, "radius": 1}, {**KEY, "spp": "64"}]
        assert len({cache.path(key) for key in keys}) == 4

    @pytest.mark.parametrize(
        "damage", [lambda d: d[:-30], lambda d: b"", lambda d: d[:200] + d[200:240][::-1] + d[240:]]
    )
    def test_a_damaged_entry_is_removed_and_a_miss(self, tmp_path, damage):
        cache = TransportCache(tmp_path)
        path = cache.put(KEY, transport())
        path.write_bytes(damage(path.read_bytes()))
        assert cache.get(KEY) is None
        assert not path.exists()
        assert len(cache.damaged) == 1
        assert path.name in cache.damaged[0]
        cache.put(KEY, transport())
        assert_same(cache.get(KEY), transport())

    def test_an_entry_under_a_wrong_name_is_a_miss(self, tmp_path):
        cache = TransportCache(tmp_path)
        other = {**KEY, "seed": 6}
        cache.put(KEY, transport()).rename(cache.path(other))
        assert cache.get(other) is None
        assert "another key" in cache.damaged[0]

    def test_a_key_must_be_json(self, tmp_path):
        with pytest.raises(RecordError, match="NaN"):
            TransportCache(tmp_path).path({"a": float("nan")})

    def test_unwritable(self, tmp_path):
        (tmp_path / "file").write_text("")
        with pytest.raises(RecordError, match="cannot write"):
            TransportCache(tmp_path / "file").put(KEY, transport())


class TestDefaultDirectory:
    @pytest.fixture(autouse=True)
    def _clean(self, monkeypatch):
        for name in ("GTAO_CACHE_DIR", "XDG_CACHE_HOME"):
            monkeypatch.delenv(name, raising=False)

    def test_own_variable_comes_first(self, monkeypatch, tmp_path):
        monkeypatch.setenv("GTAO_CACHE_DIR", str(tmp_path / "mine"))
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
        assert default_cache_directory() == tmp_path / "mine"

    def test_own_variable_that_cannot_be_written_is_an_error(self, monkeypatch, tmp_path):
        (tmp_path / "file").write_text("")
        monkeypatch.setenv("GTAO_CACHE_DIR", str(tmp_path / "file"))
        with pytest.raises(RecordError, match="cannot write"):
            default_cache_directory()

    def test_xdg_then_home(self, monkeypatch, tmp_path):
        monkeypatch.setenv("HOME", str(tmp_path / "home"))
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
        assert default_cache_directory() == tmp_path / "xdg" / "gtao"
        monkeypatch.setenv("XDG_CACHE_HOME", "relative")
        assert default_cache_directory() == tmp_path / "home" / ".cache" / "gtao"

    def test_nothing_writable(self, monkeypatch, tmp_path):
        (tmp_path / "file").write_text("")
        monkeypatch.setenv("HOME", str(tmp_path / "file"))
        assert default_cache_directory() == Path(os.environ.get("TMPDIR", "/tmp")) / "gtao-cache"


def test_metadata_may_hold_a_camera(tmp_path):
    cam = gtao.PerspectiveCamera(9, 7, fov_y=1.0)
    write_transport(tmp_path / "t.npz", transport(), {"camera": cam})
    stored = read_transport(tmp_path / "t.npz")
    assert gtao.camera_from_dict(stored.metadata["camera"]) == cam
    assert json.dumps(stored.metadata)
