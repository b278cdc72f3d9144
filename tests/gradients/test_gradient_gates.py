"""What a gradient costs, without a clock: launches, operations and memory."""

import drjit as dr
import numpy as np
import pytest
from drjit.llvm.ad import Float, TensorXf

import gtao

# A search or its adjoint has hundreds of operations; adding up gradients, means and conversions have tens.
LARGE = 150
METHODS = {
    "sphere": {"radius": 0.5},
    "falloff": {"radius": 0.5, "falloff": gtao.LinearFalloff(start=0.2, end=0.5)},
    "unlimited uniform": {"weighting": "uniform"},
    "linear fetch": {"radius": 0.5, "fetch": "linear"},
}


def arrays(width=64, height=48):
    rng = np.random.default_rng(1)
    z = (3 + 0.1 * rng.random((height, width))).astype(np.float32)
    n = rng.normal((0, 0, 4), 1, (height, width, 3))
    n = (n / np.linalg.norm(n, axis=-1, keepdims=True)).astype(np.float32)
    # Where NumPy's memory begins is part of the kernels that read it.
    return tuple(TensorXf(dr.opaque(TensorXf(a).array), a.shape) for a in (z, n))


def attached(*tensors):
    result = tuple(type(t)(t) for t in tensors)
    dr.enable_grad(*result)
    return result


def frame(z, n, **options):
    height, width = z.shape
    return gtao.GBuffer(z, n, gtao.PerspectiveCamera(width, height, 1.0), **options)


def step(z, n, method):
    """One step of gradient descent, as anybody would write it."""
    z, n = attached(z, n)
    visibility = gtao.ambient_occlusion(frame(z, n, validate=False), method).visibility
    dr.backward(dr.mean(dr.square(visibility - 0.5), axis=None))
    dr.eval(dr.grad(z), dr.grad(n))
    dr.sync_thread()


def kernels(call):
    """Operation counts of all kernels that a call launches, largest first."""
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        call()
        dr.sync_thread()
        return sorted((k["operation_count"] for k in launched()), reverse=True)


def launched():
    return [k for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT]


def large(counts):
    return [c for c in counts if c > LARGE]


@pytest.mark.parametrize("name", METHODS)
def test_a_step_is_two_large_kernels(name):
    method = gtao.GTAO(n_slices=1, n_steps=8, **METHODS[name])
    counts = kernels(lambda: step(*arrays(), method))
    # The linear fetch also prepares the field that it reads.
    assert len(large(counts)) == (2 if name != "linear fetch" else 3), counts
    # The gradient of the loss, and the sum of the two gradients of a depth: as the shaded point and as a sample.
    assert len(counts) <= len(large(counts)) + 2, counts


def adjoint(n_steps, options, n_slices=1):
    """Operations of the backward pass alone."""
    z, n = attached(*arrays())
    method = gtao.GTAO(n_slices=n_slices, n_steps=n_steps, **options)

    def forward_and_back():
        visibility = gtao.ambient_occlusion(frame(z, n, validate=False), method).visibility
        dr.eval(visibility)
        # An operation records with the flags that it was made with.
        dr.kernel_history_clear()
        dr.backward(dr.sum(visibility, axis=None))
        dr.eval(dr.grad(z), dr.grad(n))

    return kernels(forward_and_back)[0]


@pytest.mark.parametrize("name", METHODS)
def test_the_adjoint_does_not_grow_with_the_steps(name):
    few = adjoint(8, METHODS[name])
    assert few > LARGE
    # 96 steps are more than a search unrolls, and their numbers have twice as many bits.
    for n_steps in (32, 96):
        assert adjoint(n_steps, METHODS[name]) <= 1.03 * few


def test_the_adjoint_of_many_slices_is_a_loop():
    assert adjoint(3, METHODS["sphere"], n_slices=16) <= 1.03 * adjoint(3, METHODS["sphere"], n_slices=9)


@pytest.mark.parametrize("name", METHODS)
def test_the_search_for_gradients_costs_little_more(name):
    """Remembering which step won is a selection per sample."""
    method = gtao.GTAO(n_slices=1, n_steps=8, **METHODS[name])

    def search(z, n):
        return kernels(lambda: dr.eval(gtao.ambient_occlusion(frame(z, n, validate=False), method).visibility))[0]

    assert search(*attached(*arrays())) <= 1.15 * search(*arrays())


@pytest.mark.parametrize("name", ["sphere", "falloff", "unlimited uniform"])
def test_the_fused_form_is_one_large_kernel(name):
    z, n = arrays()
    method = gtao.GTAO(n_slices=1, n_steps=8, **METHODS[name])
    counts = kernels(lambda: fused(frame(z, n, validate=False), method))
    assert len(large(counts)) == 1, counts
    assert len(counts) <= 2, counts


def fused(g, method):
    result = gtao.value_and_gradient(lambda v: dr.square(v - 0.5), g, method)
    dr.eval(result)
    dr.sync_thread()


@pytest.mark.parametrize("numbers", [("fx",), ("fx", "fy", "cx", "cy")])
@pytest.mark.parametrize("depth", [False, True])
def test_a_camera_behind_derived_normals_adds_one_large_kernel_to_each_pass(numbers, depth):
    """However many numbers of it are asked for, the adjoint of the normals is not repeated for each."""
    z, _ = arrays()
    values = {"fx": 60.0, "fy": 61.0, "cx": 33.0, "cy": 23.0}

    def once():
        attached_to = {name: dr.opaque(Float, values[name]) for name in numbers}
        leaf = type(z)(z)
        dr.enable_grad(*attached_to.values(), *([leaf] if depth else []))
        camera = gtao.PerspectiveCamera(z.shape[1], z.shape[0], **(values | attached_to))
        method = gtao.GTAO(radius=0.5, n_slices=1, n_steps=8)
        visibility = gtao.ambient_occlusion(gtao.GBuffer(leaf, None, camera, validate=False), method).visibility
        dr.backward(dr.sum(visibility, axis=None))
        dr.eval(dr.grad(leaf), *map(dr.grad, attached_to.values()))
        assert all(dr.grad(value)[0] != 0 for value in attached_to.values())

    counts = kernels(once)
    # Normals and search, and the adjoint of each.
    assert len(large(counts)) == 4, counts


def test_a_second_step_compiles_nothing():
    """Neither new depths, nor radii."""
    z, n = arrays()

    def once(radius):
        r = dr.opaque(Float, radius)
        dr.enable_grad(r)
        step(z * dr.opaque(Float, radius), n, gtao.GTAO(radius=r, n_slices=1))

    once(0.5)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        once(0.7)
        history = launched()
    assert len(history) > 2
    assert all(k["cache_hit"] for k in history)


def test_memory_beyond_the_frame():
    """Per pixel a byte of two winners, one of the mask, the image, and the gradients of the loss, depths and normal."""
    width, height = 1024, 512
    method = gtao.GTAO(radius=0.5, n_slices=1, n_steps=8, falloff=gtao.LinearFalloff(start=0.2, end=0.5))
    backend, threads = dr.backend_v(Float), dr.thread_count()
    try:
        # Every thread has a copy of the gradient of the samples.
        dr.set_thread_count(1)
        for _ in range(2):  # the first time, kernels are compiled
            z, n = attached(*arrays(width, height))
            g = frame(z, n, validate=False)
            dr.eval(g.view_z, g.normal_v)
            dr.sync_thread()
            dr.flush_malloc_cache()
            dr.detail.malloc_clear_statistics()
            before = dr.detail.malloc_watermark(backend)
            visibility = gtao.ambient_occlusion(g, method).visibility
            dr.backward(dr.mean(dr.square(visibility - 0.5), axis=None))
            dr.eval(dr.grad(z), dr.grad(n))
            dr.sync_thread()
            extra = (dr.detail.malloc_watermark(backend) - before) / (width * height)
            del z, n, g, visibility
    finally:
        dr.set_thread_count(threads)
    # As built now: 33 bytes, of which 20 are the gradients of the frame.
    assert extra <= 33.5, f"{extra:.1f} bytes per pixel"
