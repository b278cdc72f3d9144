"""Depth layers through EXR: ``Z``, ``ZBack`` and what lies behind."""

import numpy as np
import pytest
from _scene import HEIGHT, WIDTH, camera, depth_and_normals, vector, write_exr

import gtao
from gtao.errors import ImageError, ShapeError
from gtao.io import read_channels, read_gbuffer, write_channels, write_gbuffer

Z, N = depth_and_normals()
INF = np.float32(np.inf)


def layers(n=3):
    """A body of 0.1 to 0.6, a sheet and a body that is never left, one behind the other; the first never left, too."""
    rng = np.random.default_rng(4)
    front = np.stack([Z, Z + 1, Z + 2])
    back = np.stack([Z + rng.uniform(0.1, 0.6, Z.shape).astype(np.float32), Z + 1, np.full_like(Z, INF)])
    back[0, 5:8], front[1:, 5:8], back[1:, 5:8] = INF, INF, INF
    return gtao.DepthLayers(front[:n], back[:n])


def frame(n=3):
    return gtao.GBuffer(Z, N, camera(near=0.25), layers=layers(n))


@pytest.mark.parametrize("n", [1, 2, 3])
def test_layers_come_back(tmp_path, n):
    g = frame(n)
    write_gbuffer(tmp_path / "g.exr", g)
    channels, _ = read_channels(tmp_path / "g.exr")
    names = ["Z", "ZBack", "layers.01.Z", "layers.01.ZBack", "layers.02.Z", "layers.02.ZBack"]
    assert [name for name in names if name in channels] == names[: 2 * n]
    assert np.array_equal(channels["ZBack"], g.layers.back.numpy()[0])
    for normals in ("file", "derive"):
        back = read_gbuffer(tmp_path / "g.exr", normals=normals)
        assert np.array_equal(back.view_z.numpy(), Z)
        assert np.array_equal(back.layers.front.numpy(), g.layers.front.numpy())
        assert np.array_equal(back.layers.back.numpy(), g.layers.back.numpy())
    assert np.array_equal(back.layers.thickness.numpy(), g.layers.thickness.numpy())


def test_a_frame_without_layers_has_none(tmp_path):
    write_gbuffer(tmp_path / "g.exr", gtao.GBuffer(Z, N, camera()))
    assert read_gbuffer(tmp_path / "g.exr").layers is None


def test_double_precision_is_written_as_single(tmp_path):
    single = layers()
    double = gtao.DepthLayers(single.front.numpy().astype(float), single.back.numpy().astype(float))
    write_gbuffer(tmp_path / "g.exr", gtao.GBuffer(Z.astype(float), N.astype(float), camera(), layers=double))
    back = read_gbuffer(tmp_path / "g.exr").layers
    assert np.array_equal(back.back.numpy(), single.back.numpy())


def test_layers_of_others_are_not_ours(tmp_path):
    """A flattened deep image has a ZBack as well, which may be anything."""
    path = write_exr(tmp_path / "f.exr", {"Z": Z, "ZBack": Z - 1, **vector("N", N)})
    assert read_gbuffer(path, camera(), normal_frame="view").layers is None


def test_damaged_layers_are_refused(tmp_path):
    write_gbuffer(tmp_path / "g.exr", frame())
    channels, metadata = read_channels(tmp_path / "g.exr")
    for name, values, words in (
        ("ZBack", Z - 1, "layer 0 ends before it begins"),
        ("layers.01.Z", Z, "layer 1 begins before layer 0 ends"),
        ("layers.02.ZBack", np.zeros((HEIGHT, WIDTH), np.float32), "back must be positive"),
    ):
        write_channels(tmp_path / "d.exr", {**channels, name: values}, metadata["manifest"])
        with pytest.raises(ShapeError, match=rf"the layers of .*d\.exr cannot be used: {words}"):
            read_gbuffer(tmp_path / "d.exr")


def test_a_layer_without_its_back_ends_the_list(tmp_path):
    write_gbuffer(tmp_path / "g.exr", frame())
    channels, metadata = read_channels(tmp_path / "g.exr")
    del channels["layers.01.ZBack"]
    write_channels(tmp_path / "d.exr", channels, metadata["manifest"])
    assert read_gbuffer(tmp_path / "d.exr").layers.n_layers == 1


def test_a_channel_of_a_layer_given_twice(tmp_path):
    with pytest.raises(ImageError, match="channel ZBack is given twice"):
        write_gbuffer(tmp_path / "g.exr", frame(), extra={"ZBack": Z})
