"""What NumPy shares with Dr.Jit, and what it does not."""

import dataclasses

import numpy as np
import pytest
from _interop_frames import CAMERA, DEPTH, METHOD, NORMALS

import gtao


def test_frames_do_not_see_later_changes_of_their_arrays():
    z, n = DEPTH.astype(np.float32), NORMALS.astype(np.float32)
    expected = gtao.ambient_occlusion(gtao.GBuffer(z.copy(), n.copy(), CAMERA), METHOD).visibility.numpy()
    lazy = gtao.ambient_occlusion(gtao.GBuffer(z, n, CAMERA), METHOD)
    z[:], n[:] = 1.0, 0.0
    assert np.array_equal(lazy.visibility.numpy(), expected)


def test_a_result_is_a_view_unless_it_is_copied():
    if gtao.backend.require() != "llvm":
        pytest.skip("the memory of a GPU is copied anyway")
    ao = gtao.ambient_occlusion(gtao.GBuffer(DEPTH, NORMALS, CAMERA), METHOD)
    view, copy = ao.visibility.numpy(), ao.visibility.numpy().copy()
    view[0, 0] = 7.0
    assert ao.visibility.numpy()[0, 0] == 7.0
    assert copy[0, 0] <= 1.5


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64, np.int32, ">f4"])
def test_precision_follows_the_depth(dtype):
    z = np.full(CAMERA.shape, 4, dtype)
    z[2:4, 2:5] = 3
    g = gtao.GBuffer(z, None, CAMERA)
    found = gtao.ambient_occlusion(g, dataclasses.replace(METHOD, noise="none")).visibility.numpy()
    assert found.dtype == (np.float64 if dtype == np.float64 else np.float32)
