"""Radiance pictures: every encoding and order, against a writer of the tests, Mitsuba, and damage."""

import os
from pathlib import Path

import _radiance_hdr as pictures
import numpy as np
import pytest

from gtao.errors import ImageError
from gtao.io import read_radiance_hdr

FOLDER = Path(os.environ.get("GTAO_SCENES", Path(__file__).resolve().parents[3] / "shared" / "scenes")) / "hdr"

HEIGHT, WIDTH = 6, 700
PIXELS = pictures.rgbe(1, HEIGHT, WIDTH)
IMAGE = pictures.decoded(PIXELS)
HEADER = pictures.header(f"-Y {HEIGHT} +X {WIDTH}", "FORMAT=32-bit_rle_rgbe")
ENCODINGS = {"flat": pictures.flat, "old runs": pictures.old_runs, "new runs": pictures.new_runs}


@pytest.fixture
def picture(tmp_path):
    """A function that reads bytes."""

    def read(data):
        path = tmp_path / "sky.hdr"
        path.write_bytes(data)
        return read_radiance_hdr(path)

    return read


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_encodings(picture, encoding):
    image = picture(HEADER + ENCODINGS[encoding](PIXELS))
    assert image.dtype == np.float32
    np.testing.assert_array_equal(image, IMAGE)


def test_runs_of_more_than_a_byte(picture):
    """(1, 1, 1, n) after another one counts 256 times as much: 600 equal pixels are 1 + 87 + 2 · 256."""
    row = np.tile(np.array([[[9, 8, 7, 130]]], np.uint8), (1, 600, 1))
    data = pictures.old_runs(row)
    assert data == bytes([9, 8, 7, 130, 1, 1, 1, 87, 1, 1, 1, 2])
    np.testing.assert_array_equal(picture(pictures.header("-Y 1 +X 600") + data), pictures.decoded(row))


def test_narrow_pictures_are_never_runs(picture):
    """Below 8 columns (2, 2) is the beginning of a pixel."""
    pixels = pictures.rgbe(2, 3, 7)
    pixels[:, 0, :3] = 2, 2, 0
    np.testing.assert_array_equal(picture(pictures.header("-Y 3 +X 7") + pixels.tobytes()), pictures.decoded(pixels))


def test_mixed_rows(picture):
    """Each scan line says for itself how it is encoded."""
    data = pictures.new_runs(PIXELS[:2]) + pictures.flat(PIXELS[2:4]) + pictures.old_runs(PIXELS[4:])
    np.testing.assert_array_equal(picture(HEADER + data), IMAGE)


@pytest.mark.parametrize("y", "-+")
@pytest.mark.parametrize("x", "-+")
@pytest.mark.parametrize("columns_first", [False, True])
def test_orders(picture, x, y, columns_first):
    """-Y is from the top down, +X from the left to the right; what is named first changes slowest."""
    stored = PIXELS if y == "-" else PIXELS[::-1]
    stored = stored if x == "+" else stored[:, ::-1]
    axes = [f"{y}Y {HEIGHT}", f"{x}X {WIDTH}"]
    if columns_first:
        stored, axes = stored.transpose(1, 0, 2), axes[::-1]
    data = pictures.header(" ".join(axes)) + pictures.flat(np.ascontiguousarray(stored))
    np.testing.assert_array_equal(picture(data), IMAGE)


def test_exposure(picture):
    """What the header says was multiplied in, once or several times, is taken out again."""
    lines = ["EXPOSURE=4.0", "EXPOSURE= 0.5", "COLORCORR= 1 2 0.25", "PRIMARIES=0 0 0 0 0 0 0 0"]
    data = pictures.header(f"-Y {HEIGHT} +X {WIDTH}", *lines) + pictures.flat(PIXELS)
    np.testing.assert_array_equal(picture(data), IMAGE / np.array([2, 4, 0.5], np.float32))


def test_other_beginnings(picture):
    data = HEADER.replace(b"#?RADIANCE", b"#?RGBE").replace(b"\n", b"\r\n").replace(b"+X 700\r\n", b"+X 700\n")
    np.testing.assert_array_equal(picture(data + pictures.flat(PIXELS)), IMAGE)


def test_mitsuba_writes_and_reads_the_same(tmp_path):
    from gtao.render.variant import ensure_variant

    ensure_variant()
    import mitsuba as mi

    rng = np.random.default_rng(3)
    image = (rng.random((20, 40, 3)) * 10.0 ** rng.uniform(-3, 4, (20, 40, 1))).astype(np.float32)
    image[5:9, 3:30] = image[5, 3]
    path = tmp_path / "mitsuba.hdr"
    mi.Bitmap(image).write(str(path))
    ours = read_radiance_hdr(path)
    np.testing.assert_array_equal(ours, np.array(mi.Bitmap(str(path))))
    # Eight bits of mantissa for the brightest channel, truncated.
    assert (np.abs(ours - image) <= image.max(axis=-1, keepdims=True) / 128).all()


@pytest.mark.skipif(not FOLDER.is_dir(), reason=f"no folder of Radiance pictures at {FOLDER}; set GTAO_SCENES")
def test_real_pictures():
    from gtao.render.variant import ensure_variant

    ensure_variant()
    import mitsuba as mi

    paths = sorted(FOLDER.glob("*.hdr"))
    assert paths
    for path in paths:
        np.testing.assert_array_equal(read_radiance_hdr(path), np.array(mi.Bitmap(str(path)))[..., :3])


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_every_cut_is_found(picture, encoding):
    whole = HEADER + ENCODINGS[encoding](PIXELS)
    for length in [0, 5, *range(10, len(whole), len(whole) // 50), len(whole) - 1]:
        with pytest.raises(ImageError, match=r"^cannot read .*sky\.hdr: .*export"):
            picture(whole[:length])


def test_damage_is_an_image_or_one_line(picture):
    """Bytes at random: another picture, or an error of one line; never more than that."""
    rng = np.random.default_rng(0)
    for encode in ENCODINGS.values():
        whole = HEADER + encode(PIXELS)
        refusals = []
        for _ in range(60):
            data = bytearray(whole)
            for position in rng.integers(0, len(data) if rng.random() < 0.5 else len(HEADER) + 20, 3):
                data[position] = rng.integers(256)
            try:
                assert np.isfinite(picture(bytes(data))).all()
            except ImageError as error:
                refusals.append(str(error))
        assert len(refusals) > 5
        assert not any("\n" in refusal for refusal in refusals)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "it is not a Radiance picture"),
        (b"\x89PNG....", "it is not a Radiance picture"),
        (b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n1234", "its FORMAT is '32-bit_rle_xyze'; convert"),
        (b"#?RADIANCE\nEXPOSURE=none\n\n-Y 1 +X 1\n1234", "its header says 'EXPOSURE=none'"),
        (b"#?RADIANCE\nEXPOSURE=0\n\n-Y 1 +X 1\n1234", "its header says 'EXPOSURE=0'"),
        (b"#?RADIANCE\nEXPOSURE=1e-30\n\n-Y 1 +X 1\n\xff\xff\xff\xf0", "values beyond single precision"),
        (b"#?RADIANCE\n\n-Y 1 x 1\n1234", "its resolution line is '-Y 1 x 1', not like '-Y 512"),
        (b"#?RADIANCE\n\n-Y 1 +Y 1\n1234", "its resolution is '-Y 1 [+]Y 1'"),
        (b"#?RADIANCE\n\n-Y 0 +X 1\n1234", "its resolution is '-Y 0"),
        (b"#?RADIANCE\n\n-Y 99999 +X 99999\n1234", "99999x99999, more than"),
        (b"#?RADIANCE\n" + b"x" * 100000, "its header is damaged or cut short"),
        (pictures.header("-Y 1 +X 9") + b"\x02\x02\x00\x08" + b"\x89\x01" * 4, "row 0 of 1"),
        (pictures.header("-Y 1 +X 9") + b"\x02\x02\x01\x09" + b"\x89\x01" * 4, "row 0 of 1"),
        (pictures.header("-Y 1 +X 9") + b"\x02\x02\x00\x09" + b"\x8a\x01" * 4, "row 0 of 1"),
        (pictures.header("-Y 1 +X 9") + b"\x02\x02\x00\x09" + b"\x00" * 40, "row 0 of 1"),
        (pictures.header("-Y 1 +X 9") + b"\x01\x01\x01\x09" * 9, "row 0 of 1"),
        (pictures.header("-Y 1 +X 9") + b"\x09\x09\x09\x80" + b"\x01\x01\x01\x09" * 9, "row 0 of 1"),
    ],
)
def test_refusals(picture, data, words):
    with pytest.raises(ImageError, match=words):
        picture(data)


def test_missing_files(tmp_path):
    with pytest.raises(ImageError, match="there is no such file"):
        read_radiance_hdr(tmp_path / "none.hdr")
    with pytest.raises(ImageError, match="is a directory"):
        read_radiance_hdr(tmp_path)
