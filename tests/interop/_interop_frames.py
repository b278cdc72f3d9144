"""A small frame without planes, and what Dr.Jit alone says about its gradients."""

import contextlib

import drjit as dr
import numpy as np

import gtao

HEIGHT, WIDTH = 6, 8
CAMERA = gtao.PerspectiveCamera(WIDTH, HEIGHT, 0.9)
_rng = np.random.default_rng(1)
DEPTH = 4 + _rng.uniform(-0.5, 0.5, (HEIGHT, WIDTH))
DEPTH[2, 5] = np.inf
#: About the view direction, not yet of unit length: moving them keeps what they are normalised to unit.
DIRECTIONS = np.concatenate([_rng.uniform(-0.4, 0.4, (HEIGHT, WIDTH, 2)), np.ones((HEIGHT, WIDTH, 1))], axis=-1)
NORMALS = DIRECTIONS / np.linalg.norm(DIRECTIONS, axis=-1, keepdims=True)
VISIBILITY = _rng.uniform(0.2, 0.9, (HEIGHT, WIDTH))
ALBEDO = _rng.uniform(0.1, 0.9, (HEIGHT, WIDTH, 3))
#: A loss of its own for every pixel, so that the adjoint of every one of them counts.
WEIGHTS = _rng.normal(size=(HEIGHT, WIDTH))
METHOD = gtao.GTAO(radius=1.0, n_slices=2, n_steps=4)
SOFT = gtao.GTAO(radius=1.0, n_slices=2, n_steps=4, falloff=gtao.LinearFalloff(start=0.3, end=0.9))


def tensor(values, single=False):
    """A Dr.Jit tensor of its own."""
    Float = gtao.backend.default_float() if single else dr.float64_array_t(gtao.backend.default_float())
    values = np.asarray(values, dtype=np.float32 if single else np.float64)
    return dr.tensor_t(Float)(dr.opaque(Float(values.ravel())), values.shape)


def drjit_gradients(method=METHOD, single=False):
    """Visibility and the gradients of its weighted sum with respect to depth and normals, by Dr.Jit alone."""
    z, n = tensor(DEPTH, single), tensor(NORMALS, single)
    dr.enable_grad(z, n)
    visibility = gtao.ambient_occlusion(gtao.GBuffer(z, n, CAMERA), method).visibility
    dr.set_grad(visibility, tensor(WEIGHTS, single))
    dr.enqueue(dr.ADMode.Backward, visibility)
    dr.traverse(dr.ADMode.Backward)
    return tuple(np.array(dr.detach(values).numpy()) for values in (visibility, dr.grad(z), dr.grad(n)))


@contextlib.contextmanager
def one_thread():
    """With several threads the order of additions, and with it the last digit of a gradient, is left to chance."""
    before = dr.thread_count()
    dr.set_thread_count(1)
    try:
        yield
    finally:
        dr.set_thread_count(before)


def same(found, expected):
    """Whether two arrays hold the same bits, or on a GPU, which adds in no fixed order, the same up to that."""
    found, expected = np.asarray(found), np.asarray(expected)
    if gtao.backend.require() == "llvm":
        return np.array_equal(found, expected)
    return np.allclose(found, expected, rtol=0, atol=20 * np.finfo(found.dtype).eps * np.abs(expected).max())
