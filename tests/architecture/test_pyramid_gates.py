"""Noise-free gates on the depth pyramid: launches, operation counts and recompilation, never seconds."""

import drjit as dr
import numpy as np
import pytest
from drjit.llvm.ad import TensorXf

import gtao
from gtao import backend
from gtao.kernels import pyramid

HEIGHT, WIDTH = 48, 64
N_STEPS = 8
# Operations of the two launches that make five levels, as built now, with 2 % for changes inside Dr.Jit: rows of four
# texels that are read and written in one piece count once.
SLACK = 1.02
BUILD = {"weighted": (288, 267), "min": (110, 89), "max": (110, 89), "average": (193, 172)}
#: To choose a level, and to find a texel in it rather than in level 0, takes this many operations per sample.
PER_SAMPLE = 14


def frame(attached=False):
    rng = np.random.default_rng(1)
    z = TensorXf((3 + 0.1 * rng.random((HEIGHT, WIDTH))).astype(np.float32))
    n = np.zeros((HEIGHT, WIDTH, 3), np.float32)
    n[..., 2] = 1
    # Of its own, because NumPy aligns no rows.
    z, n = dr.opaque(z), dr.opaque(TensorXf(n))
    if attached:
        dr.enable_grad(z, n)
    camera = gtao.PerspectiveCamera(WIDTH, HEIGHT, 1.0)
    return z, n, gtao.GBuffer(z, n, camera, validate=False)


def method(name="weighted", radius=0.5, level_offset=1.0, n_levels=5, n_steps=N_STEPS):
    levels = None if name is None else gtao.DepthPyramid(filter=name, level_offset=level_offset, n_levels=n_levels)
    falloff = gtao.LinearFalloff(start=0.4 * radius, end=radius)
    return gtao.GTAO(radius=radius, n_slices=1, n_steps=n_steps, falloff=falloff, pyramid=levels)


def kernels(work):
    """What ``work`` launches."""
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        work()
        dr.sync_thread()
        return [k for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT]


def estimate(g, m):
    dr.eval(gtao.ambient_occlusion(g, m).visibility)


def step(m):
    """Gradients of a loss by depth and normals."""
    z, n, g = frame(attached=True)
    dr.backward(dr.mean(dr.square(gtao.ambient_occlusion(g, m).visibility - 0.5), axis=None))
    dr.eval(dr.grad(z), dr.grad(n))


def tangent(m):
    """The image's derivative along a direction of all depths."""
    z, _, g = frame(attached=True)
    visibility = gtao.ambient_occlusion(g, m).visibility
    dr.set_grad(z, TensorXf(np.ones(z.shape, np.float32)))
    dr.enqueue(dr.ADMode.Forward, z)
    dr.traverse(dr.ADMode.Forward)
    dr.eval(dr.grad(visibility))


@pytest.mark.parametrize("name", BUILD)
def test_two_launches_make_five_levels(name):
    *build, _ = kernels(lambda: estimate(frame()[2], method(name)))
    assert len(build) == 2
    for kernel, operations in zip(build, BUILD[name], strict=True):
        assert kernel["operation_count"] <= operations * SLACK
    # A thread makes a texel of level 2, then one of level 4, with all that is below.
    assert [k["size"] for k in build] == [WIDTH * HEIGHT // 16, WIDTH * HEIGHT // 256]


@pytest.mark.parametrize(("n_levels", "launches"), [(1, 0), (2, 1), (3, 1), (4, 2), (5, 2), (6, 3), (12, 3)])
def test_two_levels_per_launch(n_levels, launches):
    """Of a frame of 64 pixels there are seven levels."""
    assert len(kernels(lambda: estimate(frame()[2], method(n_levels=n_levels)))) == launches + 1


@pytest.mark.parametrize("n_levels", [2, 5, 12])
def test_a_sample_of_a_pyramid_costs_little_more(n_levels):
    """And no more with more levels."""
    _, _, g = frame()
    estimate(g, method(n_levels=n_levels))
    (exact,) = kernels(lambda: estimate(g, method(None)))
    (coarse,) = kernels(lambda: estimate(g, method(n_levels=n_levels)))
    extra = coarse["operation_count"] - exact["operation_count"]
    assert 0 < extra <= PER_SAMPLE * 2 * N_STEPS


def test_a_frame_makes_its_pyramid_once():
    _, _, g = frame()
    assert len(kernels(lambda: estimate(g, method()))) == 3
    assert len(kernels(lambda: estimate(g, method(level_offset=2.0)))) == 1


def test_values_change_without_recompiling():
    """Neither radius, nor the range of the filter that goes with it, nor the distance of the levels."""
    estimate(frame()[2], method())
    again = kernels(lambda: estimate(frame()[2], method(radius=0.7, level_offset=2.5)))
    assert len(again) == 3
    assert all(k["cache_hit"] for k in again)


def test_a_filter_does_compile_anew():
    """The gate above can fail."""
    hashes = {kernels(lambda: estimate(frame()[2], method(name)))[0]["hash"] for name in ("min", "max")}  # noqa: B023  (called at once)
    assert len(hashes) == 2


@pytest.mark.parametrize("derive", [step, tangent])
@pytest.mark.parametrize("name", ["weighted", "min"])
def test_derivatives_pass_the_levels_in_as_many_launches_as_made_them(name, derive):
    plain = kernels(lambda: derive(method(None)))
    coarse = kernels(lambda: derive(method(name)))
    assert len(coarse) == len(plain) + 2 + 2
    more_steps = kernels(lambda: derive(method(name, n_steps=2 * N_STEPS)))
    assert [k["size"] for k in more_steps] == [k["size"] for k in coarse]


@pytest.mark.parametrize("attached", ["depth", "range"])
def test_what_carries_gradients_does_not_matter(attached):
    """Those of the filter's range alone go the same way as those of depth, two launches and the sums for each."""
    Float = type(frame()[0].array)
    table, types = pyramid.Table.of(WIDTH, HEIGHT, 5), backend.types_of(Float)
    z, start, end = frame()[0].array, dr.opaque(Float, 0.1), dr.opaque(Float, 0.4)
    dr.enable_grad(*([z] if attached == "depth" else [start, end]))

    def gradients():
        levels = pyramid.build(z, table, "weighted", start, end, types)
        dr.eval(levels)
        dr.backward(levels)
        dr.eval(dr.grad([z, start, end]))

    sizes = [k["size"] for k in kernels(gradients)]
    fine, coarse = WIDTH * HEIGHT // 16, WIDTH * HEIGHT // 256
    assert [size for size in sizes if size > 1] == [fine, coarse, coarse, fine]
