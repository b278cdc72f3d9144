"""The same estimate on the GPU. The arrays decide the backend, so nothing but the input differs."""

import numpy as np
import pytest

import gtao

pytestmark = pytest.mark.cuda


@pytest.mark.parametrize("options", [{}, {"radius": 0.5}, {"fetch": "linear"}, {"weighting": "uniform"}])
def test_cuda_agrees_with_llvm(options):
    from drjit.cuda.ad import TensorXf as OnGpu
    from drjit.llvm.ad import TensorXf as OnCpu

    rng = np.random.default_rng(0)
    depth = (3 + 0.2 * rng.random((24, 32))).astype(np.float32)
    camera = gtao.PerspectiveCamera(32, 24, 1.0)
    images = [
        gtao.ambient_occlusion(gtao.GBuffer(T(depth), None, camera), gtao.GTAO(**options)).visibility.numpy()
        for T in (OnGpu, OnCpu)
    ]
    # Rounding reaches 1e-5; a tap that crosses into the next texel changes a pixel more, and is rare.
    assert np.quantile(np.abs(images[0] - images[1]), 0.95) < 1e-5


def test_the_gpu_is_the_default_where_there_is_one():
    g = gtao.GBuffer(np.ones((4, 4), np.float32), None, gtao.OrthographicCamera(4, 4, 1.0))
    assert "cuda" in type(g.view_z).__module__
