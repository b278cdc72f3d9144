"""Gradients among other gradients: together and alone, in longer chains, in every mode that Dr.Jit offers."""

import numpy as np
import pytest
from drjit.llvm.ad import Float64, TensorXf64
from gradients._attached import (
    CAMERAS,
    DEPTH,
    NORMALS,
    WEIGHTS,
    problem,
    pullback,
)
from gradients._methods import METHODS, ao, hbao
from oracles import gradients as oracle

import drjit as dr  # isort: skip

import gtao


@pytest.mark.parametrize("name", ["sphere", "hbao by sample"])
def test_a_gradient_does_not_depend_on_what_else_is_attached(name):
    build = problem(METHODS[name])
    values = {"view_z": DEPTH, "normal_v": NORMALS} | CAMERAS["perspective"]
    together = pullback(build, values)
    for number in ("view_z", "normal_v", "cx"):
        alone = pullback(build, {number: values[number]})[number]
        assert alone == pytest.approx(together[number], rel=1e-10, abs=1e-12), number


def frame(z):
    return gtao.GBuffer(z, TensorXf64(NORMALS), problem(ao())({})[0].camera)


def test_gradients_pass_through_what_comes_before_and_after():
    """Depth from a parameter, two estimates of it, and a loss of both."""
    methods = ao(radius=0.9), hbao(attenuation="horizon")

    def loss(t):
        z = TensorXf64(DEPTH) * dr.exp(t)
        first, second = (gtao.ambient_occlusion(frame(z), m).visibility.array for m in methods)
        return dr.mean(dr.square(first - 0.5) + first * second)

    def value(t):
        return loss(dr.opaque(Float64, t)).numpy()[0]

    found = oracle.derivative(value)
    assert found.resolved
    t = dr.opaque(Float64, 0.0)
    dr.enable_grad(t)
    dr.backward(loss(t))
    assert found.agrees(dr.grad(t)[0])
    t = dr.opaque(Float64, 0.0)
    dr.enable_grad(t)
    result = loss(t)
    dr.forward(t)
    assert found.agrees(dr.grad(result)[0])
    t = dr.opaque(Float64, 0.0)
    dr.enable_grad(t)
    result = loss(t)
    dr.set_grad(t, 1.0)
    assert found.agrees(dr.forward_to(result)[0])


@pytest.mark.parametrize("name", ["sphere", "linear fetch", "weighted pyramid", "running thickness"])
@pytest.mark.parametrize("derived", [False, True])
def test_a_frame_gives_its_gradients_twice(name, derived):
    """What a frame keeps between estimates must not be a graph that the first backward pass has used up."""
    z, n, fx = TensorXf64(DEPTH), TensorXf64(1.001 * NORMALS), dr.opaque(Float64, 21.0)
    dr.enable_grad(z, n, fx)
    camera = gtao.PerspectiveCamera(*DEPTH.shape[::-1], fx=fx)
    g = gtao.GBuffer(z, None if derived else n, camera)
    results = []
    # What has been looked at before is kept, too.
    dr.eval(g.normal_v, g.position_v)
    for _ in range(2):
        for v in (z, n, fx):
            dr.set_grad(v, 0)
        visibility = gtao.ambient_occlusion(g, METHODS[name]).visibility.array
        dr.backward(dr.sum(visibility * Float64(WEIGHTS.ravel())))
        results.append([dr.grad(v).numpy().copy() for v in (z, n, fx)])
    for first, second in zip(*results, strict=True):
        assert second == pytest.approx(first, rel=1e-12, abs=1e-13)
    assert np.any(results[0][1] != 0) != derived


def test_an_evaluated_image_still_has_its_gradient():
    z = TensorXf64(DEPTH)
    dr.enable_grad(z)
    visibility = gtao.ambient_occlusion(frame(z), ao(radius=0.9)).visibility
    shown = visibility.numpy().copy()
    dr.backward(dr.sum(visibility.array * Float64(WEIGHTS.ravel())))
    reference = pullback(problem(ao(radius=0.9)), {"view_z": DEPTH})["view_z"]
    assert dr.grad(z).numpy() == pytest.approx(reference, rel=1e-12, abs=1e-14)
    detached = gtao.ambient_occlusion(frame(TensorXf64(DEPTH)), ao(radius=0.9)).visibility.numpy()
    # The operation with gradients makes the same image as the one without.
    assert shown == pytest.approx(detached, abs=1e-14)
