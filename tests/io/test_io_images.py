"""Any flat EXR in, exact float32 EXR out, one line for the rest."""

import struct
from pathlib import Path

import _child
import numpy as np
import OpenEXR
import pytest
from _scene import write_exr, write_parts

from gtao.errors import ConfigError, ImageError, RecordError
from gtao.io import read_channels, write_channels

RNG = np.random.default_rng(3)
A = RNG.random((6, 8), dtype=np.float32)
B = RNG.random((6, 8), dtype=np.float32)


def window(x0, y0, width, height):
    return (np.array([x0, y0], np.int32), np.array([x0 + width - 1, y0 + height - 1], np.int32))


class TestRoundTrip:
    def test_every_float_survives(self, tmp_path):
        bits = RNG.integers(0, 2**32, 5000, dtype=np.uint32)
        values = bits.view(np.float32)
        values = values[~np.isnan(values)][:4800].reshape(48, 100)
        values[0, :6] = [np.inf, -np.inf, 0.0, -0.0, np.finfo(np.float32).tiny / 8, np.finfo(np.float32).max]
        write_channels(tmp_path / "a.exr", {"Z": values})
        channels, metadata = read_channels(tmp_path / "a.exr")
        assert channels["Z"].dtype == np.float32
        assert np.array_equal(channels["Z"].view(np.uint32), values.view(np.uint32))
        assert (metadata["width"], metadata["height"]) == (100, 48)
        assert metadata["manifest"] is None

    def test_names_manifest_and_arrays_of_the_caller(self, tmp_path):
        given = {"Z": A, "visibility.mean": B, "ünïcode.R": A[:, ::-1]}
        write_channels(tmp_path / "a.exr", given, {"seed": 3, "radius": np.inf, "name": "ü"})
        channels, metadata = read_channels(tmp_path / "a.exr")
        assert set(channels) == set(given)
        for name, values in given.items():
            assert isinstance(values, np.ndarray)
            assert np.array_equal(channels[name], values)
        assert metadata["manifest"] == {"seed": 3, "radius": "inf", "name": "ü"}

    def test_same_input_same_bytes(self, tmp_path):
        for name in ("a.exr", "b.exr"):
            write_channels(tmp_path / name, {"Z": A, "B": B}, {"b": 1, "a": 2})
        assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()

    @pytest.mark.parametrize("dtype", [bool, np.uint8, np.int32, np.float16, np.float64, ">f4"])
    def test_other_types_become_float32(self, tmp_path, dtype):
        values = (A * 100).astype(dtype)
        write_channels(tmp_path / "a.exr", {"Z": values})
        assert np.array_equal(read_channels(tmp_path / "a.exr")[0]["Z"], values.astype(np.float32))


class TestRefusedOnWriting:
    @pytest.mark.parametrize(
        ("channels", "message"),
        [
            ({}, "no channels were given"),
            ({"Z": np.array([[1.0, np.nan]])}, "channel 'Z' is NaN at 1 pixels"),
            ({"Z": np.zeros(3)}, r"channel 'Z' must be a non-empty \(H, W\) array"),
            ({"Z": np.zeros((0, 3))}, "must be a non-empty"),
            ({"Z": np.zeros((2, 2), complex)}, "array of numbers"),
            ({"Z": np.zeros((2, 2)), "N.X": np.zeros((2, 3))}, "different shapes"),
            ({"Z": np.array([[2**24 + 1]])}, "integers that float32 cannot"),
            ({"": A}, "must have 1 to 255 characters"),
            ({"x" * 256: A}, "must have 1 to 255 characters"),
        ],
    )
    def test_one_line_and_no_file(self, tmp_path, channels, message):
        with pytest.raises(ImageError, match=message) as caught:
            write_channels(tmp_path / "a.exr", channels)
        assert "\n" not in str(caught.value)
        assert list(tmp_path.iterdir()) == []

    def test_a_manifest_that_json_cannot_hold(self, tmp_path):
        with pytest.raises(RecordError, match="NaN"):
            write_channels(tmp_path / "a.exr", {"Z": A}, {"a": float("nan")})
        assert list(tmp_path.iterdir()) == []

    def test_failure_inside_the_library(self, tmp_path, monkeypatch):
        class Broken:
            def __init__(self, *_):
                pass

            def write(self, path):
                Path(path).write_bytes(b"half")
                raise RuntimeError("disk on fire")

        monkeypatch.setattr(OpenEXR, "File", Broken)
        with pytest.raises(ImageError, match=r"cannot write .*a\.exr: disk on fire"):
            write_channels(tmp_path / "a.exr", {"Z": A})
        assert list(tmp_path.iterdir()) == []


class TestReading:
    def test_types_are_kept_channel_by_channel(self, tmp_path):
        given = {"AO": A.astype(np.float16), "Z": B, "id": np.arange(48, dtype=np.uint32).reshape(6, 8) + 2**31}
        channels, _ = read_channels(write_exr(tmp_path / "a.exr", given))
        for name, values in given.items():
            assert channels[name].dtype == values.dtype
            assert np.array_equal(channels[name], values)

    def test_nan_is_read_as_stored(self, tmp_path):
        values = A.copy()
        values[2, 3] = np.nan
        channels, _ = read_channels(write_exr(tmp_path / "a.exr", {"Z": values}))
        assert np.array_equal(channels["Z"], values, equal_nan=True)

    def test_tiles(self, tmp_path):
        big = RNG.random((70, 90), dtype=np.float32)
        header = {"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()}
        channels, _ = read_channels(write_exr(tmp_path / "a.exr", {"Z": big}, header))
        assert np.array_equal(channels["Z"], big)

    def test_parts(self, tmp_path):
        parts = {
            "rgba": {"R": A, "Z": B},
            "depth": {"Z": A + 1, "depth.Z": B + 1},
            "View.Normal": {"View.Normal.X": A + 2},
        }
        channels, _ = read_channels(write_parts(tmp_path / "a.exr", parts))
        assert {name: values.flat[0] for name, values in channels.items()} == {
            "rgba.R": A[0, 0],
            "rgba.Z": B[0, 0],
            "depth.Z": A[0, 0] + 1,
            "depth.depth.Z": B[0, 0] + 1,
            "View.Normal.X": A[0, 0] + 2,
        }

    def test_attributes(self, tmp_path):
        _, metadata = read_channels(write_exr(tmp_path / "a.exr", {"Z": A}, {"comments": "hello", "fps": 3}))
        assert metadata["attributes"]["comments"] == "hello"

    def test_no_noise_and_no_open_files(self, tmp_path, capfd):
        path = write_exr(tmp_path / "a.exr", {"Z": A})
        path.write_bytes(path.read_bytes()[:-20])
        with pytest.raises(ImageError):
            read_channels(path)
        print("still here")
        captured = capfd.readouterr()
        assert captured.out == "still here\n"
        assert captured.err == ""


class TestWindows:
    """An 8x6 data window with its corner at (2, 1)."""

    def write(self, tmp_path, display):
        header = {"dataWindow": window(2, 1, 8, 6), "displayWindow": window(*display)}
        return write_exr(tmp_path / "a.exr", {"Z": A, "id": np.full((6, 8), 7, np.uint32)}, header)

    @pytest.mark.parametrize(
        "display",
        [
            (0, 0, 12, 10),  # data inside
            (4, 2, 3, 3),  # overscan on all sides
            (0, 3, 6, 9),  # partly outside
            (-3, -2, 9, 5),  # negative corner
        ],
    )
    def test_display_window_is_the_frame(self, tmp_path, display):
        channels, metadata = read_channels(self.write(tmp_path, display))
        x0, y0, width, height = display
        assert channels["Z"].shape == (height, width)
        for y in range(height):
            for x in range(width):
                inside = 2 <= x0 + x < 10 and 1 <= y0 + y < 7
                expected = A[y0 + y - 1, x0 + x - 2] if inside else 0
                assert channels["Z"][y, x] == expected
                assert channels["id"][y, x] == (7 if inside else 0)
        assert metadata["display_window"] == display
        assert metadata["data_window"] == (2, 1, 8, 6)

    def test_data_window_on_request(self, tmp_path):
        channels, metadata = read_channels(self.write(tmp_path, (4, 2, 3, 3)), window="data")
        assert np.array_equal(channels["Z"], A)
        assert (metadata["width"], metadata["height"]) == (8, 6)

    def test_parts_with_different_windows(self, tmp_path):
        display = {"displayWindow": window(0, 0, 12, 10)}
        base = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        parts = [
            OpenEXR.Part(base | display | {"dataWindow": window(0, 0, 8, 6)}, {"R": A.copy()}, "a"),
            OpenEXR.Part(base | display | {"dataWindow": window(3, 2, 8, 6)}, {"Z": B.copy()}, "b"),
        ]
        OpenEXR.File(parts).write(str(tmp_path / "a.exr"))
        channels, metadata = read_channels(tmp_path / "a.exr", window="data")
        assert metadata["data_window"] == (0, 0, 11, 8)
        assert np.array_equal(channels["a.R"][:6, :8], A)
        assert np.array_equal(channels["b.Z"][2:8, 3:11], B)

    def test_apart(self, tmp_path):
        path = self.write(tmp_path, (40, 0, 12, 10))
        with pytest.raises(ImageError, match="no data inside its display window; use window='data'"):
            read_channels(path)
        assert np.array_equal(read_channels(path, window="data")[0]["Z"], A)

    def test_unknown_window(self, tmp_path):
        with pytest.raises(ConfigError, match="window must be 'display' or 'data', got 'all'"):
            read_channels(self.write(tmp_path, (0, 0, 12, 10)), window="all")


class TestRefusedOnReading:
    def refuse(self, path, message):
        with pytest.raises(ImageError, match=message) as caught:
            read_channels(path)
        assert "\n" not in str(caught.value)
        assert str(path) in str(caught.value)

    def test_missing(self, tmp_path):
        self.refuse(tmp_path / "a.exr", "there is no such file; check the path")

    def test_folder_and_device(self, tmp_path):
        self.refuse(tmp_path, "not a regular file")
        self.refuse("/dev/null", "not a regular file")

    @pytest.mark.parametrize("content", [b"", b"\x89PNG\r\n\x1a\n", b"hello", b"\x76\x2f\x31"])
    def test_something_else(self, tmp_path, content):
        (tmp_path / "a.exr").write_bytes(content)
        self.refuse(tmp_path / "a.exr", "it is empty|it is not an OpenEXR image")

    def test_unreadable(self, tmp_path, monkeypatch):
        path = write_exr(tmp_path / "a.exr", {"Z": A})

        def refuse(*_, **__):
            raise PermissionError(13, "Permission denied")

        monkeypatch.setattr(type(path), "open", refuse)  # the tests may run as root
        self.refuse(path, "permission denied; check the path and its permissions")

    def test_subsampled(self, tmp_path):
        path = write_exr(tmp_path / "a.exr", {"RY": A})
        data = path.read_bytes()
        start = data.index(b"RY\0") + 3 + 8  # after the name: type, flags, then the sampling in x and y
        assert struct.unpack_from("<2i", data, start) == (1, 1)
        path.write_bytes(data[:start] + struct.pack("<2i", 2, 2) + data[start + 8 :])
        self.refuse(path, r"channel RY is subsampled \(2x2\)")

    def test_deep(self, tmp_path):
        deep = np.empty((2, 3), object)
        for i in np.ndindex(2, 3):
            deep[i] = np.ones(1 + i[1], np.float32)
        header = {"compression": OpenEXR.ZIPS_COMPRESSION, "type": OpenEXR.deepscanline}
        self.refuse(write_exr(tmp_path / "a.exr", {"Z": deep}, header), "it holds deep data; flatten")

    @pytest.mark.parametrize("text", ["{", "[1]", ""])
    def test_damaged_manifest(self, tmp_path, text):
        path = write_exr(tmp_path / "a.exr", {"Z": A}, {"gtao": text})
        self.refuse(path, "its header attribute 'gtao' is not a JSON object")

    def test_one_damaged_part_of_two(self, tmp_path):
        path = write_parts(tmp_path / "a.exr", {"a": {"Z": A}, "b": {"Z": B}})
        path.write_bytes(path.read_bytes()[:-8])
        self.refuse(path, "1 of its parts are damaged")


def patch_window(data, name, corners):
    """The bytes of an EXR file with another ``name`` window in the header."""
    start = data.index(name.encode() + b"\0box2i\0") + len(name) + 1 + 6 + 4
    return data[:start] + struct.pack("<4i", *corners) + data[start + 16 :]


BOMBS = """
import numpy as np
from pathlib import Path
from gtao.errors import ImageError
from gtao.io import read_channels
out = []
for path in sorted(Path(sys.argv[1]).glob("*.exr")):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    try:
        read_channels(path)
        out.append("read")
    except ImageError as error:
        out.append(str(error).partition(": ")[2])
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 64 << 10, path  # KiB
print(json.dumps(out))
"""


def test_headers_that_ask_for_terabytes_cost_nothing(tmp_path):
    data = write_exr(tmp_path / "a", {"Z": A, "Y": B}).read_bytes()
    corners = [(0, 0, 2**30, 2**30), (0, 0, 0, 2**29), (0, 0, 2**29, 0), (-(2**30), 0, 2**30, 5), (0, 0, 9999, 9999)]
    for i, c in enumerate(corners):
        (tmp_path / f"data{i}.exr").write_bytes(patch_window(data, "dataWindow", c))
        (tmp_path / f"display{i}.exr").write_bytes(patch_window(data, "displayWindow", c))
    # The last display window is large but sane: 100 Mpixel of zeros that the caller asked for.
    (tmp_path / "display4.exr").unlink()
    messages = _child.run(BOMBS, tmp_path)
    assert len(messages) == 9
    # OpenEXR itself refuses corners that overflow; long lines of pixels are up to us.
    assert sum("pixels; the file is damaged" in message for message in messages) == 4
    assert "damaged or cut short" in messages[4]  # 100 Mpixel would be fine, were they there


DAMAGE = """
import random
import numpy as np
from pathlib import Path
from gtao.errors import ImageError
from gtao.io import read_channels
random = random.Random(5)

def cut(data):
    # Every third length, and each of the last ones, where only pixels are missing.
    return [data[:n] for n in (*range(0, len(data) - 40, 3), *range(len(data) - 40, len(data)))]

def alter(data):
    variants = []
    for _ in range(150):
        copy = bytearray(data)
        for _ in range(random.randint(1, 3)):
            copy[random.randrange(len(data))] = random.randrange(256)
        variants.append(bytes(copy))
    return variants

result = {}
for path in sorted(Path(sys.argv[1]).glob("*.exr")):
    for make in (cut, alter):
        refused, variants = 0, make(path.read_bytes())
        for variant in variants:
            Path(sys.argv[1], "damaged").write_bytes(variant)
            try:
                channels, metadata = read_channels(Path(sys.argv[1], "damaged"), window="data")
            except ImageError as error:
                assert "\\n" not in str(error)
                refused += 1
            else:
                shape = (metadata["height"], metadata["width"])
                assert all(values.shape == shape for values in channels.values())
        result[f"{path.stem} {make.__name__}"] = [refused, len(variants)]
print(json.dumps(result))
"""


def test_a_file_cut_anywhere_is_refused_and_altered_bytes_never_crash(tmp_path):
    tiles = {"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()}
    write_channels(tmp_path / "zip.exr", {"Z": A, "N.X": B}, {"seed": 1})
    write_exr(tmp_path / "piz.exr", {"Z": A, "N.X": B}, {"compression": OpenEXR.PIZ_COMPRESSION})
    write_exr(tmp_path / "none.exr", {"Z": A.astype(np.float16)}, {"compression": OpenEXR.NO_COMPRESSION})
    write_exr(tmp_path / "tiles.exr", {"Z": A}, tiles)
    write_parts(tmp_path / "parts.exr", {"a": {"Z": A}, "b": {"Z": B}})
    result = _child.run(DAMAGE, tmp_path)
    assert len(result) == 10
    for name, (refused, n) in result.items():
        if name.endswith("cut"):
            assert refused == n > 100, name
        else:
            assert 0 < refused <= n, name
