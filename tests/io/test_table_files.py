"""Tables as files: what comes back, what others see in them, and what is refused."""

import contextlib
import json

import numpy as np
import pytest
from drjit.auto.ad import TensorXf
from PIL import Image

from gtao.data.specular import SpecularTable
from gtao.errors import ConfigError, ImageError, RecordError, ShapeError
from gtao.io import TABLE_ENCODINGS, decode_bc4, read_channels, read_dds, read_table, write_table

SHAPES = {
    "cone-cone": (5, 8, 12, 1),
    "brdf-3d": (3, 4, 8, 2),
    "brdf-4d": (2, 3, 8, 4, 2),
    "brdf-5d": (2, 3, 2, 4, 8, 2),
    "environment-brdf": (8, 16, 2),
}
#: Suffix -> encodings that it holds.
HELD = {
    ".npy": ("float", "half", "unorm16", "unorm8"),
    ".npz": ("float", "half", "unorm16", "unorm8"),
    ".exr": ("float", "half"),
    ".dds": ("half", "unorm16", "unorm8", "float", "bc4"),
    ".raw": ("float", "half", "unorm16", "unorm8", "bc4"),
    ".bin": ("float", "half", "unorm16", "unorm8", "bc4"),
}
#: Largest difference that rounding makes of a number in [0, 1]; BC4 has its own tests.
ROUNDING = {"float": 0.0, "half": 2.0**-12, "unorm16": 0.5 / 65535, "unorm8": 0.5 / 255}


def table(kind: str = "brdf-4d", **changes) -> SpecularTable:
    values = np.random.default_rng(2).random(SHAPES[kind]).astype(np.float32)
    values.flat[:2] = 0, 1
    told = {"axes": "linear", "settings": {"n_nodes": 64, "limit": np.inf, "note": "Jürgen 中"}, "source": "a record"}
    return SpecularTable(kind=kind, **{"values": values, **told, **changes})


def same_words(a: SpecularTable, b: SpecularTable) -> bool:
    return (a.kind, a.axes, a.size, a.n_channels, dict(a.settings), a.source) == (
        b.kind,
        b.axes,
        b.size,
        b.n_channels,
        dict(b.settings),
        b.source,
    )


def test_every_encoding_has_a_container():
    assert {encoding for held in HELD.values() for encoding in held} == set(TABLE_ENCODINGS)


@pytest.mark.parametrize("kind", SHAPES)
@pytest.mark.parametrize(("suffix", "encoding"), [(s, e) for s, held in HELD.items() for e in held if e != "bc4"])
def test_it_comes_back(tmp_path, kind, suffix, encoding):
    t = table(kind)
    write_table(tmp_path / f"a{suffix}", t, encoding)
    back = read_table(tmp_path / f"a{suffix}")
    assert same_words(back, t)
    assert back.values.dtype == np.float32
    # The decoded number is rounded to float32 once more.
    assert np.abs(back.values.astype(np.float64) - t.values).max() <= ROUNDING[encoding] + 6e-8 * (encoding != "float")
    assert (back.values.min(), back.values.max()) == (0, 1)


@pytest.mark.parametrize("suffix", HELD)
def test_the_default_encoding_is_the_first(tmp_path, suffix):
    write_table(tmp_path / f"a{suffix}", table())
    write_table(tmp_path / f"b{suffix}", table(), HELD[suffix][0])
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


@pytest.mark.parametrize("kind", SHAPES)
@pytest.mark.parametrize("suffix", [".dds", ".raw"])
def test_blocks(tmp_path, suffix, kind):
    t = table(kind)
    write_table(tmp_path / f"a{suffix}", t, "bc4")
    back = read_table(tmp_path / f"a{suffix}")
    assert same_words(back, t)
    # Random blocks leave 0.028 (half of a seventh, uniformly distributed, is 0.041); mixed-up blocks would leave 0.4.
    assert np.sqrt(np.mean((back.values - t.values) ** 2)) < 0.035


@pytest.mark.parametrize("encoding", TABLE_ENCODINGS)
def test_arrays_of_drjit_give_the_same_file(tmp_path, encoding):
    t = table()
    write_table(tmp_path / "a.raw", t, encoding)
    write_table(tmp_path / "b.raw", table(values=TensorXf(t.values)), encoding)
    assert (tmp_path / "a.raw").read_bytes() == (tmp_path / "b.raw").read_bytes()


@pytest.mark.parametrize("suffix", HELD)
def test_the_same_bytes_each_time_and_nothing_left_behind(tmp_path, suffix):
    write_table(tmp_path / f"a{suffix}", table())
    first = {p.name: p.read_bytes() for p in tmp_path.iterdir()}
    write_table(tmp_path / f"a{suffix}", table())
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == first
    assert set(first) == {f"a{suffix}"} | ({f"a{suffix}.json"} if suffix not in (".npz", ".exr") else set())


class TestSeenByOthers:
    def test_raw_bytes_by_their_description(self, tmp_path):
        """A program that has only the description finds a texel."""
        t = table()
        write_table(tmp_path / "a.raw", t, "unorm16")
        told = json.loads((tmp_path / "a.raw.json").read_text("utf-8"))
        assert told["layout"]["byte_order"] == "little"
        assert told["layout"]["slice"] == "z + n_z * w"
        assert told["layout"]["order"] == (
            "texels in the order of x, y, z, w, x fastest, the channels of each side by side"
        )
        n_x, n_y, n_z, _ = told["size"]
        numbers = np.frombuffer((tmp_path / "a.raw").read_bytes(), told["layout"]["dtype"]) / told["layout"]["one"]
        for x, y, z, w in ((0, 0, 0, 0), (3, 7, 2, 1), (1, 4, 0, 1)):
            for c, _ in enumerate(told["channels"]):
                at = (((z + n_z * w) * n_y + y) * n_x + x) * 2 + c
                assert abs(numbers[at] - t.values[w, z, y, x, c]) <= ROUNDING["unorm16"]

    @pytest.mark.parametrize(
        ("kind", "size", "channels", "slices"),
        [
            ("cone-cone", [12, 8, 5], ["S"], "z"),
            ("brdf-3d", [8, 4, 3], ["S_A", "S_B"], "z"),
            ("brdf-5d", [8, 4, 2, 3, 2], ["S_A", "S_B"], "z + n_z * (w + n_w * v)"),
            ("environment-brdf", [16, 8], ["A", "B"], None),
        ],
    )
    def test_what_the_description_says(self, tmp_path, kind, size, channels, slices):
        write_table(tmp_path / "a.dds", table(kind), "unorm8")
        told = json.loads((tmp_path / "a.dds.json").read_text("utf-8"))
        assert (told["kind"], told["axes"], told["size"], told["channels"]) == (kind, "linear", size, channels)
        assert told["encoding"] == "unorm8"
        assert told["layout"]["dds_format"] == ("R8_UNORM" if channels == ["S"] else "R8G8_UNORM")
        assert told["layout"].get("slice") == slices
        assert (told["settings"]["n_nodes"], told["settings"]["limit"], told["source"]) == (64, "inf", "a record")
        assert told["mapping"]["sample"] == "u = (c * (n - 1) + 0.5) / n"
        if kind == "cone-cone":
            assert told["coordinates"] == ["alpha_v", "alpha", "beta"]

    def test_numpy(self, tmp_path):
        write_table(tmp_path / "a.npy", table())
        write_table(tmp_path / "a.npz", table())
        assert np.array_equal(np.load(tmp_path / "a.npy"), table().values)
        assert np.array_equal(np.load(tmp_path / "a.npz")["texels"], table().values)

    @pytest.mark.parametrize("encoding", ["float", "half"])
    def test_mitsuba_reads_the_slices_of_an_image(self, tmp_path, encoding):
        from gtao.render.variant import ensure_variant

        ensure_variant()
        import mitsuba as mi

        t = table("cone-cone")
        write_table(tmp_path / "a.exr", t, encoding)
        image = np.array(mi.Bitmap(str(tmp_path / "a.exr"))).reshape(5, 8, 12)
        assert np.abs(image - t.values[..., 0]).max() <= ROUNDING[encoding]
        assert read_channels(tmp_path / "a.exr")[1]["manifest"]["table"]["kind"] == "cone-cone"

    @pytest.mark.parametrize("kind", ["cone-cone", "brdf-4d"])
    def test_a_volume_of_blocks_is_read_whole_by_another(self, tmp_path, kind):
        imagecodecs = pytest.importorskip("imagecodecs", reason="imagecodecs is not installed")
        t = table(kind)
        write_table(tmp_path / "a.dds", t, "bc4")
        seen = imagecodecs.dds_decode((tmp_path / "a.dds").read_bytes()).reshape(t.values.shape)
        # It drops what integers cannot hold.
        assert np.array_equal(seen, np.floor(read_table(tmp_path / "a.dds").values * 255.0 + 1e-4))

    @pytest.mark.parametrize("encoding", ["half", "float", "unorm16", "bc4"])
    @pytest.mark.parametrize("kind", ["cone-cone", "brdf-3d", "brdf-4d", "environment-brdf"])
    def test_an_engine_loads_the_volume(self, tmp_path, kind, encoding):
        core = pytest.importorskip("panda3d.core", reason="Panda3D is not installed")
        t = table(kind)
        write_table(tmp_path / "a.dds", t, encoding)
        texture = core.Texture()
        assert texture.read(core.Filename.from_os_specific(str(tmp_path / "a.dds")))
        n_x, n_y, *outer = t.size
        assert (texture.x_size, texture.y_size, texture.z_size) == (n_x, n_y, int(np.prod(outer)))
        assert texture.texture_type == (core.Texture.TT_3d_texture if outer else core.Texture.TT_2d_texture)
        assert texture.num_components == t.n_channels
        stored, _ = read_dds(tmp_path / "a.dds")
        seen = np.frombuffer(bytes(texture.get_ram_image()), stored.dtype).reshape(stored.shape)
        # Its first row is the lowest, and its first slice the last.
        upright = seen[tuple([slice(None, None, -1)] * (stored.ndim - 2))]
        if encoding != "bc4":
            assert np.array_equal(upright, stored)
            return
        assert texture.ram_image_compression == core.Texture.CM_rgtc
        for ours, theirs in zip(*(np.split(b, t.n_channels, axis=-1) for b in (stored, upright)), strict=True):
            # It turns the rows inside of blocks too.
            decoded = decode_bc4(theirs).reshape(*theirs.shape[:-2], 4, n_x)[..., ::-1, :]
            assert np.array_equal(decoded.reshape(*stored.shape[:-3], n_y, n_x), decode_bc4(ours))

    def test_a_plane_of_two_channels(self, tmp_path):
        write_table(tmp_path / "a.dds", table("environment-brdf"), "bc4")
        with Image.open(tmp_path / "a.dds") as image:
            seen = np.asarray(image)[..., :2]
        assert np.array_equal(seen, np.floor(read_table(tmp_path / "a.dds").values * 255.0 + 1e-4))


class TestRefused:
    @pytest.mark.parametrize("name", ["a.ktx", "a", "a.png", "a.json"])
    def test_another_suffix(self, tmp_path, name):
        for call in (lambda: write_table(tmp_path / name, table()), lambda: read_table(tmp_path / name)):
            with pytest.raises(ImageError, match=r"ends in one of \.npy, \.npz, \.exr, \.dds, \.raw, \.bin"):
                call()

    def test_an_encoding_that_the_file_does_not_hold(self, tmp_path):
        with pytest.raises(ConfigError, match=r"\.exr files hold the encodings float, half, got 'unorm8'"):
            write_table(tmp_path / "a.exr", table(), "unorm8")
        with pytest.raises(ConfigError, match="encoding must be one of unorm8"):
            write_table(tmp_path / "a.raw", table(), "bc7")

    @pytest.mark.parametrize("encoding", TABLE_ENCODINGS)
    @pytest.mark.parametrize("value", [np.nan, np.inf])
    def test_numbers_that_are_none(self, tmp_path, encoding, value):
        t = table()
        t.values[1, 2, 3, 2, 1] = value
        with pytest.raises(ShapeError, match="the table is not finite at 1 of its numbers"):
            write_table(tmp_path / "a.raw", t, encoding)
        assert list(tmp_path.iterdir()) == []

    @pytest.mark.parametrize("encoding", ["unorm8", "unorm16", "bc4"])
    @pytest.mark.parametrize("value", [-2e-6, 1 + 2e-6])
    def test_numbers_beyond_the_unit_range(self, tmp_path, encoding, value):
        t = table()
        t.values[0, 0, 0, 0, 0] = value
        with pytest.raises(ShapeError, match=f"encoding '{encoding}' holds numbers from 0 to 1, got .* choose 'half'"):
            write_table(tmp_path / "a.raw", t, encoding)
        t.values[0, 0, 0, 0, 0] = np.rint(value) + (value > 0.5 or -1) * 5e-7
        write_table(tmp_path / "a.raw", t, encoding)

    def test_numbers_beyond_half_floats(self, tmp_path):
        with pytest.raises(ShapeError, match="encoding 'half' holds numbers up to 65504"):
            write_table(tmp_path / "a.dds", table(values=7e4 * table().values), "half")

    def test_sides_that_have_no_blocks(self, tmp_path):
        t = table(values=np.zeros((3, 3, 6, 8, 2), np.float32))
        with pytest.raises(ShapeError, match="make height and width multiples of 4"):
            write_table(tmp_path / "a.dds", t, "bc4")

    def test_more_slices_than_direct3d_allows(self, tmp_path):
        t = table(values=np.zeros((46, 46, 2, 2, 1), np.float32))
        with pytest.raises(ShapeError, match="Direct3D allows 2048 texels along a side, got 2x2x2116"):
            write_table(tmp_path / "a.dds", t)
        assert list(tmp_path.iterdir()) == []

    def test_settings_that_json_does_not_hold(self, tmp_path):
        with pytest.raises(RecordError, match=r"settings of the table\.a is NaN"):
            write_table(tmp_path / "a.npz", table(settings={"a": np.nan}))

    @pytest.mark.parametrize("suffix", HELD)
    def test_missing(self, tmp_path, suffix):
        with pytest.raises(ImageError, match="no such file"):
            read_table(tmp_path / f"a{suffix}")
        (tmp_path / f"a{suffix}").write_bytes(b"hello")
        with pytest.raises(ImageError, match=r"cannot read .*a\."):
            read_table(tmp_path / f"a{suffix}")

    @pytest.mark.parametrize("suffix", [".npy", ".dds", ".raw"])
    def test_without_its_description(self, tmp_path, suffix):
        write_table(tmp_path / f"a{suffix}", table())
        (tmp_path / f"a{suffix}.json").unlink()
        with pytest.raises(ImageError, match=rf"no description of a table at .*a{suffix}\.json"):
            read_table(tmp_path / f"a{suffix}")

    @pytest.mark.parametrize("suffix", HELD)
    def test_cut_anywhere_or_altered(self, tmp_path, suffix):
        # Half floats hold these numbers.
        path, t = (
            tmp_path / f"a{suffix}",
            table("environment-brdf", values=np.arange(32, dtype=np.float32).reshape(4, 4, 2) / 32),
        )
        write_table(path, t)
        data = path.read_bytes()
        for n in range(0, len(data), 37):
            path.write_bytes(data[:n])
            with pytest.raises(ImageError) as caught:
                read_table(path)
            assert "\n" not in str(caught.value)
        rng = np.random.default_rng(7)
        for _ in range(60):
            altered = bytearray(data)
            altered[rng.integers(len(data))] ^= 1 << rng.integers(8)
            path.write_bytes(altered)
            # Bits that no check sum covers, as those of a date, may pass, but never other values.
            with contextlib.suppress(ImageError):
                assert np.array_equal(read_table(path).values, t.values)

    @pytest.mark.parametrize(
        ("name", "value", "says"),
        [
            ("kind", "brdf", "unknown kind of table 'brdf'"),
            ("kind", "cone-cone", "has 3 axes"),
            ("kind", 3, "its kind is no text"),
            ("schema", 2, "its description has schema 2, this gtao knows 1"),
            ("size", [4, 8, 3], "bytes of texels, not"),
            ("size", 4, "not iterable"),
            ("encoding", "half", "bytes of texels, not"),
            ("encoding", "dxt", "encoding must be one of"),
            ("sha256", "0" * 64, "not those that its description belongs to"),
            ("settings", [], "its settings are no object"),
            ("source", None, "its source is no text"),
        ],
    )
    def test_descriptions_that_say_something_wrong(self, tmp_path, name, value, says):
        write_table(tmp_path / "a.raw", table())
        told = json.loads((tmp_path / "a.raw.json").read_text("utf-8"))
        (tmp_path / "a.raw.json").write_text(json.dumps({**told, name: value}))
        with pytest.raises(ImageError, match=says):
            read_table(tmp_path / "a.raw")
        del told[name]
        (tmp_path / "a.raw.json").write_text(json.dumps(told))
        with pytest.raises(ImageError, match=f"its description lacks '{name}'"):
            read_table(tmp_path / "a.raw")

    def test_descriptions_that_are_none(self, tmp_path):
        write_table(tmp_path / "a.raw", table())
        for text in ("[]", "3", "null"):
            (tmp_path / "a.raw.json").write_text(text)
            with pytest.raises(ImageError, match="it says nothing about a table"):
                read_table(tmp_path / "a.raw")
        (tmp_path / "a.raw.json").write_text("{")
        with pytest.raises(ImageError, match="is not a description of a table"):
            read_table(tmp_path / "a.raw")

    def test_files_of_other_things(self, tmp_path):
        from gtao.io import write_channels

        write_channels(tmp_path / "a.exr", {"R": np.zeros((2, 2))})
        write_channels(tmp_path / "b.exr", {"Z": np.zeros((2, 2))}, {"table": {}})
        np.savez(tmp_path / "a.npz", a=np.zeros(3))
        np.save(tmp_path / "b.npz", np.zeros(3))
        (tmp_path / "b.npz.npy").rename(tmp_path / "b.npz")
        for name in ("a.exr", "b.exr", "a.npz", "b.npz"):
            with pytest.raises(ImageError, match=r"cannot read .*(table|description)"):
                read_table(tmp_path / name)
