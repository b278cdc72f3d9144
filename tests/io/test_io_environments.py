"""Environment maps through files."""

import _radiance_hdr as pictures
import numpy as np
import pytest

from gtao import lighting
from gtao.errors import ConfigError, ImageError, ShapeError
from gtao.io import read_channels, read_environment, write_channels, write_environment

TURN = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0.0]])


@pytest.fixture
def image():
    return np.random.default_rng(0).random((6, 12, 3)).astype(np.float32)


def _channels(image, prefix=""):
    return {f"{prefix}{name}": image[..., i] for i, name in enumerate("RGB")}


@pytest.mark.parametrize("to_world", [np.eye(3), TURN, lighting.axes("x y -z")])
def test_there_and_back(tmp_path, image, to_world):
    env = lighting.EnvironmentMap(image, to_world)
    write_environment(tmp_path / "sky.exr", env)
    back = read_environment(tmp_path / "sky.exr")
    np.testing.assert_array_equal(back.radiance, env.radiance)
    np.testing.assert_array_equal(back.to_world, env.to_world)
    channels, _ = read_channels(tmp_path / "sky.exr")
    assert sorted(channels) == ["B", "G", "R"]


def test_a_given_frame_wins(tmp_path, image):
    write_environment(tmp_path / "sky.exr", lighting.EnvironmentMap(image, TURN))
    np.testing.assert_array_equal(read_environment(tmp_path / "sky.exr", np.eye(4)).to_world, np.eye(3))


def test_other_programs_files(tmp_path, image):
    """A layer, an alpha channel beside it, and no frame."""
    channels = {**_channels(image, "sky."), "sky.A": np.ones((6, 12))}
    write_channels(tmp_path / "sky.exr", channels)
    back = read_environment(tmp_path / "sky.exr")
    np.testing.assert_array_equal(back.radiance, image)
    np.testing.assert_array_equal(back.to_world, np.eye(3))


def test_luminance(tmp_path, image):
    write_channels(tmp_path / "sky.exr", {"Y": image[..., 0]})
    np.testing.assert_array_equal(read_environment(tmp_path / "sky.exr").radiance, image[..., :1].repeat(3, -1))


def test_pictures_under_any_name(tmp_path):
    pixels = pictures.rgbe(5, 4, 8)
    (tmp_path / "sky.exr").write_bytes(pictures.header("-Y 4 +X 8") + pixels.tobytes())
    back = read_environment(tmp_path / "sky.exr", TURN)
    np.testing.assert_array_equal(back.radiance, pictures.decoded(pixels))
    np.testing.assert_array_equal(back.to_world, TURN)


def test_mitsuba_reads_what_we_write(tmp_path, image):
    from gtao.render.variant import ensure_variant

    ensure_variant()
    import mitsuba as mi

    write_environment(tmp_path / "sky.exr", lighting.EnvironmentMap(image))
    np.testing.assert_array_equal(np.array(mi.Bitmap(str(tmp_path / "sky.exr"))), image)


def test_broken_texels(tmp_path, image):
    image[1, 2, 0], image[3, 4], image[0, 0, 1] = np.inf, -1, -np.inf
    write_channels(tmp_path / "sky.exr", _channels(image))
    with pytest.raises(ImageError, match=r"of 72 texels 2 are NaN or infinite and 2 negative; repair=True"):
        read_environment(tmp_path / "sky.exr")
    repaired = read_environment(tmp_path / "sky.exr", repair=True).radiance
    largest = image[np.isfinite(image)].max()
    assert repaired[1, 2, 0] == largest
    assert (repaired[3, 4] == 0).all()
    assert repaired[0, 0, 1] == 0
    whole = np.isfinite(image) & (image >= 0)
    np.testing.assert_array_equal(repaired[whole], image[whole])


def test_half_floats_that_overflowed(tmp_path, image):
    """NaN and infinity as other programs store them, which our writer refuses to write."""
    import OpenEXR

    half = image.astype(np.float16)
    half[0, 0], half[1, 1] = np.nan, np.inf
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {k: np.ascontiguousarray(v) for k, v in _channels(half).items()}).write(
        str(tmp_path / "sky.exr")
    )
    with pytest.raises(ImageError, match="2 are NaN or infinite and 0 negative"):
        read_environment(tmp_path / "sky.exr")
    repaired = read_environment(tmp_path / "sky.exr", repair=True).radiance
    assert (repaired[0, 0] == 0).all()
    assert (repaired[1, 1] == half[np.isfinite(half)].max()).all()


def test_refusals(tmp_path, image):
    path = tmp_path / "sky.exr"
    with pytest.raises(ImageError, match="there is no such file"):
        read_environment(path)
    path.write_bytes(b"no image")
    with pytest.raises(ImageError, match="not an OpenEXR image"):
        read_environment(path)
    write_channels(path, {"R": image[..., 0], "G": image[..., 1], "Z": image[..., 2]})
    with pytest.raises(ImageError, match=r"lacks one of the channels R, G, B \(it has G, R, Z\)"):
        read_environment(path)
    write_channels(path, {**_channels(image, "a."), **_channels(image, "b.")})
    with pytest.raises(ImageError, match=r"several channels R \(a\.R, b\.R\)"):
        read_environment(path)
    write_channels(path, _channels(image[:1]))
    with pytest.raises(ImageError, match="12x1 texels; 2x2 is least"):
        read_environment(path)
    write_channels(path, _channels(image), {"environment_to_world": [1, 2]})
    with pytest.raises(ImageError, match="environment_to_world in its header is no 3x3 matrix"):
        read_environment(path)
    write_channels(path, _channels(image))
    with pytest.raises(ConfigError, match="to_world must be a rotation"):
        read_environment(path, 2 * np.eye(3))
    with pytest.raises(ShapeError, match="to_world must be a 3x3"):
        read_environment(path, [1, 2, 3])
    with pytest.raises(ConfigError, match=r"must be a gtao\.lighting\.EnvironmentMap, got ndarray"):
        write_environment(path, image)
    with pytest.raises(ImageError, match=r"give a name that ends in \.exr"):
        write_environment(tmp_path / "sky.hdr", lighting.EnvironmentMap(image))
    assert not (tmp_path / "sky.hdr").exists()
    (tmp_path / "folder.exr").mkdir()
    with pytest.raises(ImageError, match="it is a folder"):
        write_environment(tmp_path / "folder.exr", lighting.EnvironmentMap(image))
