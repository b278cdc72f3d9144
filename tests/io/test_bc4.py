"""BC4: against all palettes there are, against decoders that others wrote, and its range of input."""

import io

import numpy as np
import pytest
from oracles import bc4 as oracle
from PIL import Image

from gtao.errors import ShapeError
from gtao.io import decode_bc4, encode_bc4, write_dds


def blocks(kind: str, n: int, seed: int = 3) -> np.ndarray:
    """(n, 4, 4) numbers in [0, 1] of a kind that tables have, or that is hard."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:4, :4] / 3
    offset, spread = rng.random((2, n, 1, 1))
    a, b, c = rng.normal(size=(3, n, 1, 1))
    plane = a * x + b * y + 0.3 * c * x * y
    noise = rng.random((n, 4, 4))
    made = {
        "random": noise,
        "random, narrow": offset + spread**3 * (noise - 0.5),
        "smooth": offset + 0.3 * spread**3 * plane,
        "saturated": np.rint(2 * offset) / 2 + 0.4 * plane,
        "edge": 1 / (1 + np.exp(-8 * plane)),
        "0, 1 and others": np.where(noise < 0.25, 0, np.where(noise > 0.75, 1, offset + 0.5 * spread * noise)),
        "two values": np.where(noise < 0.5, offset, spread),
        "bytes": np.rint(255 * noise) / 255,
        "narrower than a step": offset + 0.003 * noise,
        "constant": np.broadcast_to(offset, noise.shape),
    }[kind]
    return np.clip(made, 0, 1)


KINDS = (
    "random",
    "random, narrow",
    "smooth",
    "saturated",
    "edge",
    "0, 1 and others",
    "two values",
    "bytes",
    "narrower than a step",
    "constant",
)


@pytest.mark.parametrize("kind", KINDS)
def test_no_palette_does_better(kind):
    values = blocks(kind, 12)
    errors = ((decode_bc4(encode_bc4(values)) - values) ** 2).sum(axis=(1, 2))
    best = np.array([oracle.least_error(block) for block in values])
    # The search is in float32, which is off by up to 6e-8 for a number in [0, 1]. On 16 texels that comes to twice
    # 16 x 6e-8 x (their distance): 1e-9 where the distance is a tenth of a byte, a share of 1e-5 where it is 1/50.
    assert (errors <= best * (1 + 1e-5) + 1e-9).all()
    assert (errors >= best * (1 - 1e-5) - 1e-9).all()


def test_both_palettes_are_used():
    greater_first = [encode_bc4(blocks(kind, 50))[..., 0] > encode_bc4(blocks(kind, 50))[..., 1] for kind in KINDS]
    assert 0.2 < np.mean(greater_first) < 0.8


def test_many_blocks_are_each_what_they_are_alone():
    values = np.concatenate([blocks(kind, 30) for kind in KINDS])
    together = encode_bc4(values)
    assert np.array_equal(together[7::41], np.concatenate([encode_bc4(v[None]) for v in values[7::41]]))


def test_rows_of_an_image():
    values = np.random.default_rng(5).random((3, 8, 12))
    coded = encode_bc4(values)
    assert coded.shape == (3, 2, 3, 8)
    assert np.array_equal(coded[1, 1, 2], encode_bc4(values[1, 4:, 8:])[0, 0])
    assert decode_bc4(coded).shape == values.shape


def test_the_decoder_follows_the_definition():
    rng = np.random.default_rng(6)
    coded = rng.integers(0, 256, (2, 3, 4, 8), dtype=np.uint8)
    coded[0, 0, 0, 1] = coded[0, 0, 0, 0]
    decoded = decode_bc4(coded)
    assert decoded.dtype == np.float32
    for at in np.ndindex(2, 3, 4):
        tile = decoded[at[0], 4 * at[1] : 4 * at[1] + 4, 4 * at[2] : 4 * at[2] + 4]
        assert np.abs(tile - oracle.decode(coded[at].tobytes())).max() < 1e-7


def foreign(coded: np.ndarray, tmp_path) -> tuple[np.ndarray, np.ndarray]:
    """(H, W) bytes by Pillow and by texture2ddecoder."""
    texture2ddecoder = pytest.importorskip("texture2ddecoder", reason="texture2ddecoder is not installed")
    height, width = 4 * coded.shape[0], 4 * coded.shape[1]
    write_dds(tmp_path / "a.dds", coded, "BC4_UNORM")
    with Image.open(io.BytesIO((tmp_path / "a.dds").read_bytes())) as image:
        pillow = np.asarray(image)
    bgra = np.frombuffer(texture2ddecoder.decode_bc4(coded.tobytes(), width, height), np.uint8)
    return pillow, bgra.reshape(height, width, 4)[..., 2]


@pytest.mark.parametrize("kind", [*KINDS, "any bytes"])
def test_two_other_decoders_see_the_same(kind, tmp_path):
    """Both interpolate integers and drop the rest; ours is exact, and so less than a 255th above."""
    if kind == "any bytes":
        coded = np.random.default_rng(8).integers(0, 256, (5, 16, 8), dtype=np.uint8)
    else:
        coded = encode_bc4(np.hstack(blocks(kind, 16)))
    pillow, other = foreign(coded, tmp_path)
    assert np.array_equal(pillow, other)
    expected = np.block([[oracle.decode_bytes(b.tobytes()) for b in row] for row in coded])
    assert np.array_equal(pillow, expected)
    ours = decode_bc4(coded).astype(np.float64) * 255
    assert np.array_equal(np.floor(ours + 1e-4), pillow)


@pytest.mark.parametrize("shape", [(4,), (4, 6), (5, 8), (0, 4)])
def test_sizes_that_have_no_blocks(shape):
    with pytest.raises(ShapeError, match="multiples of 4"):
        encode_bc4(np.zeros(shape))


@pytest.mark.parametrize("value", [-1e-6, 1 + 1e-6, np.nan, np.inf])
def test_numbers_that_it_does_not_hold(value):
    image = np.zeros((4, 8))
    image[2, 3] = value
    with pytest.raises(ShapeError, match="holds numbers from 0 to 1"):
        encode_bc4(image)


@pytest.mark.parametrize("coded", [np.zeros((2, 8), np.uint8), np.zeros((1, 2, 7), np.uint8), np.zeros((1, 2, 8))])
def test_what_are_no_blocks(coded):
    with pytest.raises(ShapeError, match=r"must be \(…, H/4, W/4, 8\) bytes"):
        decode_bc4(coded)
