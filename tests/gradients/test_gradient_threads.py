"""Two threads find the gradients that one thread finds."""

import drjit as dr
import numpy as np
import pytest
from drjit.llvm.ad import Float, TensorXf

import gtao


@pytest.fixture
def threads():
    before = dr.thread_count()
    yield dr.set_thread_count
    dr.set_thread_count(before)


METHODS = {
    "sphere": gtao.GTAO(radius=0.3, n_slices=1, n_steps=3),
    "linear fetch": gtao.GTAO(radius=0.3, n_slices=1, n_steps=2, fetch="linear"),
    "by sample": gtao.HBAO(radius=0.3, n_directions=2, n_steps=3),
    "pyramid": gtao.GTAO(radius=0.3, n_slices=1, n_steps=3, pyramid=gtao.DepthPyramid(filter="min", level_offset=1.0)),
}


# Below 2^20 texels every thread adds up its own copy of a gradient, above they share one.
@pytest.mark.parametrize(
    ("name", "size"), [(name, 256) for name in METHODS] + [("sphere", 1100), ("linear fetch", 1030)]
)
def test_gradients_of_two_threads(threads, name, size):
    rng = np.random.default_rng(0)
    depth = (3 + 0.1 * rng.random((size, size))).astype(np.float32)
    normals = rng.normal((0, 0, 3), 1, (size, size, 3))
    normals = (normals / np.linalg.norm(normals, axis=-1, keepdims=True)).astype(np.float32)
    camera = gtao.PerspectiveCamera(size, size, 1.0)
    weights = Float(rng.normal(size=size * size).astype(np.float32))

    def gradients(n_threads):
        threads(n_threads)
        z, n = TensorXf(depth), TensorXf(normals)
        dr.enable_grad(z, n)
        visibility = gtao.ambient_occlusion(gtao.GBuffer(z, n, camera), METHODS[name]).visibility
        dr.backward(dr.sum(visibility.array * weights))
        return [dr.grad(v).numpy().copy() for v in (z, n)]

    for one, two in zip(gradients(1), gradients(2), strict=True):
        # Float32 sums in another order; a lost contribution is as large as the gradient itself.
        scale = np.abs(one).max()
        assert np.abs(one - two).max() <= 1e-5 * scale
        assert np.abs(one).mean() > 1e-4 * scale
