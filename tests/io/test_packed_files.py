"""Packed files: whole, the same every time, read back as they were, and by others."""

import contextlib
import json
import struct
import zlib
from dataclasses import fields

import numpy as np
import pytest
from _directions import bent, estimate, random_directions
from PIL import Image

import gtao
from gtao.errors import ConfigError, ImageError, RecordError
from gtao.io import (
    PACKINGS,
    pack,
    packed_suffix,
    read_channels,
    read_directions,
    read_packed,
    unpack,
    write_channels,
    write_gbuffer,
    write_packed,
)
from gtao.io.png import read_png

PNGS = [name for name in PACKINGS if packed_suffix(name) == ".png"]


def path_of(folder, name):
    return folder / f"a{packed_suffix(name)}"


def assert_same(a, b):
    for field in fields(a):
        one, other = getattr(a, field.name), getattr(b, field.name)
        assert np.array_equal(one, other) if isinstance(other, np.ndarray) else one == other, field.name


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
@pytest.mark.parametrize("name", PACKINGS)
def test_there_and_back(tmp_path, name, weighting):
    path = path_of(tmp_path, name)
    write_packed(path, estimate(weighting), name)
    assert_same(read_packed(path), unpack(pack(estimate(weighting), name), name, weighting))
    first = path.read_bytes()
    write_packed(path, estimate(weighting), name)
    assert path.read_bytes() == first
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("name", PACKINGS)
def test_what_the_file_says_of_itself(tmp_path, name):
    write_packed(path_of(tmp_path, name), estimate(), name, manifest={"config": {"radius": np.inf}, "by": "Jürgen 中"})
    if name in PNGS:
        told = json.loads(read_png(path_of(tmp_path, name))[1]["gtao"])
    else:
        told = read_channels(path_of(tmp_path, name))[1]["manifest"]
    assert told["packing"] == {"name": name, "channels": list(PACKINGS[name].channels), "weighting": "cosine"}
    assert told["directions"]["frame"].startswith("view")
    assert (told["config"], told["by"]) == ({"radius": "inf"}, "Jürgen 中")
    assert told["made_by"] == f"gtao {gtao.__version__}"


@pytest.mark.parametrize("name", PNGS)
def test_another_reader_finds_the_same_numbers(tmp_path, name):
    write_packed(path_of(tmp_path, name), estimate(), name)
    texels = pack(estimate(), name)
    with Image.open(path_of(tmp_path, name)) as image:
        seen = np.asarray(image)
        assert json.loads(image.info["gtao"])["packing"]["name"] == name
    # Pillow drops the lower half of 16 bits.
    assert np.array_equal(seen, texels >> 8 if texels.dtype == np.uint16 else texels)


def test_mitsuba_reads_all_16_bits(tmp_path):
    from gtao.render.variant import ensure_variant

    ensure_variant()
    import mitsuba as mi

    write_packed(tmp_path / "a.png", estimate(), "octahedral16")
    assert np.array_equal(np.array(mi.Bitmap(str(tmp_path / "a.png"))), pack(estimate(), "octahedral16"))


@pytest.mark.parametrize("name", ["zh16", "sh16"])
def test_half_floats_in_the_file(tmp_path, name):
    write_packed(tmp_path / "a.exr", estimate(), name)
    channels, _ = read_channels(tmp_path / "a.exr")
    names = "RGBA" if name == "zh16" else [f"visibility_sh.{i:02d}" for i in range(9)]
    assert sorted(channels) == sorted(names)
    for i, channel in enumerate(names):
        assert channels[channel].dtype == np.float16
        assert np.array_equal(channels[channel], pack(estimate(), name)[..., i])


def test_half_floats_that_are_none(tmp_path):
    with pytest.raises(ImageError, match="channel 'Z' exceeds 65504, the largest half float"):
        write_channels(tmp_path / "a.exr", {"Z": np.array([[1.0, 7e4]])}, half=True)
    write_channels(tmp_path / "a.exr", {"Z": np.array([[1.0, np.inf, 1 / 3]])}, half=True)
    assert np.array_equal(read_channels(tmp_path / "a.exr")[0]["Z"], np.float16([[1, np.inf, 1 / 3]]))


class TestRefused:
    @pytest.mark.parametrize("name", PACKINGS)
    def test_a_name_that_says_otherwise(self, tmp_path, name):
        with pytest.raises(ImageError, match=f"packing {name} makes {packed_suffix(name)} files"):
            write_packed(tmp_path / "a.tga", estimate(), name)
        assert list(tmp_path.iterdir()) == []

    def test_an_unknown_packing(self, tmp_path):
        with pytest.raises(ConfigError, match="packing must be one of"):
            write_packed(tmp_path / "a.png", estimate(), "bc5")

    def test_no_place(self, tmp_path):
        (tmp_path / "a.png").mkdir()
        with pytest.raises(ImageError, match="it is a folder"):
            write_packed(tmp_path / "a.png", estimate())
        with pytest.raises(RecordError, match="NaN"):
            write_packed(tmp_path / "b.png", estimate(), manifest={"a": float("nan")})
        assert [p.name for p in tmp_path.iterdir()] == ["a.png"]

    @pytest.mark.parametrize("content", [b"", b"hello", b"\x89PNG\r\n\x1a\n", b"\x89PNG\r\n\x1a\n" + bytes(40)])
    def test_something_else(self, tmp_path, content):
        (tmp_path / "a.png").write_bytes(content)
        with pytest.raises(ImageError, match=r"cannot read .*a\.png"):
            read_packed(tmp_path / "a.png")

    def test_missing(self, tmp_path):
        with pytest.raises(ImageError, match="no such file"):
            read_packed(tmp_path / "a.png")

    @pytest.mark.parametrize("name", ["octahedral12", "octahedral16", "sh16"])
    def test_cut_anywhere_or_altered(self, tmp_path, name):
        path = path_of(tmp_path, name)
        write_packed(path, estimate(), name)
        data = path.read_bytes()
        for n in range(0, len(data) - 12, 97):
            path.write_bytes(data[:n])
            with pytest.raises(ImageError) as caught:
                read_packed(path)
            assert "\n" not in str(caught.value)
        rng = np.random.default_rng(7)
        for _ in range(60):
            altered = bytearray(data)
            altered[rng.integers(len(data))] ^= 1 << rng.integers(8)
            path.write_bytes(altered)
            with contextlib.suppress(ImageError):
                assert read_packed(path).visibility.ndim == 2

    def test_files_that_say_nothing(self, tmp_path):
        Image.fromarray(pack(estimate(), "rgba8")).save(tmp_path / "a.png")
        Image.fromarray(np.zeros((2, 2), np.uint8)).save(tmp_path / "grey.png")
        write_channels(tmp_path / "a.exr", {"R": np.zeros((2, 2))}, {"packing": {"name": "bc5", "weighting": "cosine"}})
        write_channels(tmp_path / "b.exr", {"R": np.zeros((2, 2))}, {"packing": "rgba8"})
        for name in ("a.png", "a.exr", "b.exr"):
            with pytest.raises(ImageError, match="does not say how it is packed"):
                read_packed(tmp_path / name)
        with pytest.raises(ImageError, match="it is not RGB or RGBA"):
            read_packed(tmp_path / "grey.png")

    def test_files_that_say_something_wrong(self, tmp_path):
        write_channels(tmp_path / "a.exr", {"R": np.ones((2, 2))}, {"packing": {"name": "zh16", "weighting": "cosine"}})
        with pytest.raises(ImageError, match="it lacks channels of its packing"):
            read_packed(tmp_path / "a.exr")
        write_packed(tmp_path / "a.png", bent(random_directions(3)), "octahedral8")
        data = (tmp_path / "a.png").read_bytes()
        (tmp_path / "a.png").write_bytes(renote(data, b"octahedral8", b"rgba8"))
        with pytest.raises(ImageError, match=r"texels of rgba8 must be \(H, W, 4\)"):
            read_packed(tmp_path / "a.png")

    def test_sixteen_bits_saved_by_another_program(self, tmp_path):
        path = tmp_path / "a.png"
        write_packed(path, estimate(), "octahedral16")
        texels = pack(estimate(), "octahedral16").astype(">u2")
        rows = b"".join(b"\0" + row.tobytes() for row in texels)  # no filter
        path.write_bytes(png(texels.shape, 16, 2, rows))
        with pytest.raises(ImageError, match="another program has saved it; pack again"):
            read_packed(path)
        path.write_bytes(png(texels.shape, 16, 0, rows))
        with pytest.raises(ImageError, match="it is interlaced or has no colour"):
            read_packed(path)
        path.write_bytes(png((2**16, 2**16), 16, 2, rows))
        with pytest.raises(ImageError, match="it has more than 268435456 pixels"):
            read_packed(path)


def chunk(kind, content):
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def png(shape, depth, colour_type, rows):
    header = struct.pack(">IIBBBBB", shape[1], shape[0], depth, colour_type, 0, 0, 0)
    chunks = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + chunks


def renote(data, old, new):
    """The same image with another word in its note."""
    at = data.index(b"tEXt") - 4
    (n,) = struct.unpack_from(">I", data, at)
    note = data[at + 8 : at + 8 + n].replace(old, new)
    return data[:at] + chunk(b"tEXt", note) + data[at + 12 + n :]


class TestDirectionsBesideAFrame:
    def write(self, path, **extra):
        g = gtao.GBuffer(np.ones((20, 24), np.float32), None, gtao.PerspectiveCamera(24, 20, 1.0))
        write_gbuffer(path, g, extra=extra, manifest={"directions": {"weighting": "uniform"}})

    def test_they_come_back(self, tmp_path):
        ao = estimate("uniform")
        extra = {"mean_direction": ao.mean_direction, "visibility_sh": ao.visibility_sh}
        self.write(tmp_path / "a.exr", **{"visibility.mean": ao.visibility}, **extra)
        read = read_directions(tmp_path / "a.exr")
        assert (read.weighting, read.bent_normal) == ("uniform", None)
        assert np.array_equal(read.mean_direction, ao.mean_direction.numpy())
        assert np.array_equal(read.visibility_sh, ao.visibility_sh.numpy())
        assert np.array_equal(pack(read, "sh16"), pack(ao, "sh16"))

    def test_there_are_none(self, tmp_path):
        self.write(tmp_path / "a.exr", **{"visibility.mean": estimate().visibility})
        with pytest.raises(ImageError, match=r"a\.exr has no visibility with directions; write it by gtao occlusion"):
            read_directions(tmp_path / "a.exr")
