"""DDS: the header field by field, readers that others wrote, and files that are damaged."""

import struct

import numpy as np
import pytest
from PIL import Image

from gtao.errors import ConfigError, ImageError, ShapeError
from gtao.io import DDS_FORMATS, encode_bc4, read_dds, write_dds


def texels(name: str, shape: tuple[int, ...], seed: int = 1) -> np.ndarray:
    """Numbers of the type of a format; of the compressed ones any bytes."""
    f = DDS_FORMATS[name]
    rng = np.random.default_rng(seed)
    shape = (*shape[:-2], shape[-2] // f.block, shape[-1] // f.block, f.n_stored)
    if f.dtype[1] == "f":
        return rng.random(shape).astype(f.dtype)
    return rng.integers(0, np.iinfo(f.dtype).max, shape, f.dtype, endpoint=True)


def words(path) -> tuple[int, ...]:
    """The header after the magic, as 32-bit numbers: 31 of the old one, 5 of DX10."""
    data = path.read_bytes()
    assert data[:4] == b"DDS "
    return struct.unpack("<36I", data[4:148])


@pytest.mark.parametrize("shape", [(8, 12), (5, 8, 12)], ids=["plane", "volume"])
@pytest.mark.parametrize("name", DDS_FORMATS)
def test_it_comes_back(tmp_path, name, shape):
    stored = texels(name, shape)
    write_dds(tmp_path / "a.dds", stored, name)
    back, told = read_dds(tmp_path / "a.dds")
    assert told == name
    assert back.dtype == stored.dtype
    assert np.array_equal(back, stored)
    assert (tmp_path / "a.dds").stat().st_size == 148 + stored.nbytes
    assert (tmp_path / "a.dds").read_bytes()[148:] == stored.tobytes()


@pytest.mark.parametrize(
    ("name", "number", "bits"),
    [
        ("R8_UNORM", 61, 8),
        ("R8G8_UNORM", 49, 16),
        ("R16_UNORM", 56, 16),
        ("R16G16_UNORM", 35, 32),
        ("R16_FLOAT", 54, 16),
        ("R16G16_FLOAT", 34, 32),
        ("R32_FLOAT", 41, 32),
        ("R32G32_FLOAT", 16, 64),
        ("BC4_UNORM", 80, 4),
        ("BC5_UNORM", 83, 8),
    ],
)
@pytest.mark.parametrize("depth", [None, 6])
def test_the_header(tmp_path, name, number, bits, depth):
    """Offsets and constants of DDS_HEADER and DDS_HEADER_DXT10."""
    write_dds(tmp_path / "a.dds", texels(name, (8, 20) if depth is None else (depth, 8, 20)), name)
    header = words(tmp_path / "a.dds")
    compressed, volume = bits == 4 or name == "BC5_UNORM", depth is not None
    flags = 0x1 | 0x2 | 0x4 | 0x1000 | 0x20000 | (0x80000 if compressed else 0x8) | (0x800000 if volume else 0)
    # Bytes of one row of texels, or of one slice of blocks.
    pitch = 20 * 8 * bits // 8 if compressed else 20 * bits // 8
    assert header[:7] == (124, flags, 8, 20, pitch, depth or 0, 1)
    assert header[7:18] == (0,) * 11
    assert header[18:26] == (32, 0x4, struct.unpack("<I", b"DX10")[0], 0, 0, 0, 0, 0)
    # A volume is called complex besides, since OpenImageIO takes none that is not.
    assert header[26:31] == ((0x1008, 0x200000) if volume else (0x1000, 0)) + (0, 0, 0)
    assert header[31:] == (number, 4 if volume else 3, 0, 1, 0)


def seen(path) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image)


def slice_of(tmp_path, path, k: int):
    """A slice of a volume as a plane of its own: other bytes of the header, the same texels."""
    stored, name = read_dds(path)
    write_dds(tmp_path / "slice.dds", stored[k], name)
    return tmp_path / "slice.dds"


@pytest.mark.parametrize("k", range(3))
def test_two_other_readers_agree_on_compressed_slices(tmp_path, k):
    texture2ddecoder = pytest.importorskip("texture2ddecoder", reason="texture2ddecoder is not installed")
    rng = np.random.default_rng(4)
    one, two = (encode_bc4(rng.random((3, 8, 16))) for _ in range(2))
    write_dds(tmp_path / "bc4.dds", one, "BC4_UNORM")
    write_dds(tmp_path / "bc5.dds", np.concatenate([one, two], axis=-1), "BC5_UNORM")
    grey, colour = (seen(slice_of(tmp_path, tmp_path / f"{name}.dds", k)) for name in ("bc4", "bc5"))

    # The whole file goes to the other one, from where the slice begins: 148 bytes of header, 8 or 16 of a block.
    def bgra(name, decode, block):
        data = (tmp_path / f"{name}.dds").read_bytes()[148 + k * 8 * block :]
        return np.frombuffer(decode(data[: 8 * block], 16, 8), np.uint8).reshape(8, 16, 4)

    assert np.array_equal(grey, bgra("bc4", texture2ddecoder.decode_bc4, 8)[..., 2])
    both = bgra("bc5", texture2ddecoder.decode_bc5, 16)
    assert np.array_equal(colour[..., :2], both[..., [2, 1]])
    assert np.array_equal(colour[..., 0], grey)


def test_the_first_slice_of_a_volume_needs_no_help(tmp_path):
    """Pillow takes a volume for the plane that it begins with, and so finds its size and format in the header."""
    coded = encode_bc4(np.random.default_rng(4).random((3, 8, 16)))
    write_dds(tmp_path / "a.dds", coded, "BC4_UNORM")
    assert np.array_equal(seen(tmp_path / "a.dds"), seen(slice_of(tmp_path, tmp_path / "a.dds", 0)))


class TestRefused:
    def test_an_unknown_format(self, tmp_path):
        with pytest.raises(ConfigError, match=r"DDS format must be one of R8_UNORM, .* got 'BC7'"):
            write_dds(tmp_path / "a.dds", np.zeros((4, 4, 1), np.uint8), "BC7")

    @pytest.mark.parametrize("shape", [(4, 4), (4, 4, 2), (2, 2, 4, 4, 1), (0, 4, 1)])
    def test_another_shape(self, tmp_path, shape):
        with pytest.raises(ShapeError, match=r"R8_UNORM needs \(H, W, 1\) or \(D, H, W, 1\)"):
            write_dds(tmp_path / "a.dds", np.zeros(shape, np.uint8), "R8_UNORM")

    def test_another_type(self, tmp_path):
        with pytest.raises(ShapeError, match="R16_FLOAT needs float16, got float32"):
            write_dds(tmp_path / "a.dds", np.zeros((4, 4, 1), np.float32), "R16_FLOAT")

    @pytest.mark.parametrize("shape", [(2049, 1, 1, 1), (1, 1, 2049, 1), (16385, 1, 1)])
    def test_more_than_direct3d_allows(self, tmp_path, shape):
        with pytest.raises(ShapeError, match=r"Direct3D allows (2048|16384) texels along a side"):
            write_dds(tmp_path / "a.dds", np.zeros(shape, np.uint8), "R8_UNORM")
        assert list(tmp_path.iterdir()) == []

    def test_no_place(self, tmp_path):
        (tmp_path / "a.dds").mkdir()
        with pytest.raises(ImageError, match="it is a folder"):
            write_dds(tmp_path / "a.dds", np.zeros((4, 4, 1), np.uint8), "R8_UNORM")

    def test_missing(self, tmp_path):
        with pytest.raises(ImageError, match="no such file"):
            read_dds(tmp_path / "a.dds")

    @pytest.mark.parametrize("content", [b"", b"DD", b"hello", b"\x89PNG\r\n\x1a\n" + bytes(200)])
    def test_something_else(self, tmp_path, content):
        (tmp_path / "a.dds").write_bytes(content)
        with pytest.raises(ImageError, match=r"cannot read .*a\.dds: it is not a DDS file"):
            read_dds(tmp_path / "a.dds")

    @pytest.mark.parametrize(
        ("word", "value", "says"),
        [
            (0, 123, "its header is damaged"),
            (2, 0, "its size is impossible: 8x0x5"),
            (2, 9, r"its size is impossible|holds 640 bytes"),
            (3, 2**31, "its size is impossible"),
            (5, 4, "it holds 160 bytes of texels, not 128"),
            (6, 4, "mipmaps"),
            (18, 31, "its header is damaged"),
            (19, 0, "without a DX10 header"),
            (20, struct.unpack("<I", b"ATI1")[0], "without a DX10 header"),
            (27, 0, "contradicts itself"),
            (31, 98, "DXGI_FORMAT 98, is none of R8_UNORM"),
            (32, 2, "contradicts itself"),
            (33, 4, "mipmaps or several textures"),
            (34, 6, "mipmaps or several textures"),
        ],
    )
    def test_headers_of_others(self, tmp_path, word, value, says):
        write_dds(tmp_path / "a.dds", texels("BC4_UNORM", (5, 8, 8)), "BC4_UNORM")
        data = bytearray((tmp_path / "a.dds").read_bytes())
        struct.pack_into("<I", data, 4 + 4 * word, value)
        (tmp_path / "a.dds").write_bytes(data)
        with pytest.raises(ImageError, match=says):
            read_dds(tmp_path / "a.dds")

    @pytest.mark.parametrize("name", ["R8_UNORM", "BC5_UNORM"])
    def test_cut_anywhere(self, tmp_path, name):
        write_dds(tmp_path / "a.dds", texels(name, (2, 4, 8)), name)
        data = (tmp_path / "a.dds").read_bytes()
        for n in range(len(data)):
            (tmp_path / "a.dds").write_bytes(data[:n])
            with pytest.raises(ImageError, match=r"cannot read .*(cut|not a DDS)"):
                read_dds(tmp_path / "a.dds")
        (tmp_path / "a.dds").write_bytes(data + b"\0")
        with pytest.raises(ImageError, match="cut or altered"):
            read_dds(tmp_path / "a.dds")
