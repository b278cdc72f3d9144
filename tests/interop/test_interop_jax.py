"""Estimators on JAX arrays: values and gradients in reverse mode, eagerly and compiled."""

import subprocess
import sys
from dataclasses import replace

import drjit as dr
import numpy as np
import pytest
from _interop_frames import (
    ALBEDO,
    CAMERA,
    DEPTH,
    DIRECTIONS,
    METHOD,
    NORMALS,
    SOFT,
    VISIBILITY,
    WEIGHTS,
    drjit_gradients,
    one_thread,
    same,
)

import gtao

jax = pytest.importorskip("jax", reason="JAX is not installed: pip install 'gtao[jax]'")

from jax import numpy as jnp  # noqa: E402  (skips come first)
from jax.test_util import check_grads  # noqa: E402  (skips come first)

from gtao.interop import jax as gj  # noqa: E402  (skips come first)


@pytest.fixture(autouse=True)
def _one_thread():
    with one_thread():
        yield


@pytest.fixture(autouse=True)
def _double_precision():
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    yield
    jax.config.update("jax_enable_x64", before)


def unit(directions):
    return directions / jnp.linalg.norm(directions, axis=-1, keepdims=True)


def reverse_check(function, *inputs):
    """Reverse mode against central differences in double precision."""
    # Differences are taken a step of 1e-6 apart, which leaves them ten of their digits at the most.
    check_grads(function, inputs, order=1, modes=["rev"], eps=1e-6, atol=1e-7, rtol=1e-6)


def weighted(z, n, method=METHOD):
    return (gj.ambient_occlusion(z, n, CAMERA, method) * WEIGHTS.astype(z.dtype)).sum()


@pytest.mark.parametrize("compiled", [False, True], ids=["eager", "jit"])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("method", [METHOD, SOFT], ids=["exact cut", "falloff"])
def test_values_and_gradients_are_those_of_drjit(method, dtype, compiled):
    def both(z, n):
        visibility, pull = jax.vjp(lambda z, n: gj.ambient_occlusion(z, n, CAMERA, method), z, n)
        return visibility, *pull(jnp.asarray(WEIGHTS, dtype))

    found = (jax.jit(both) if compiled else both)(jnp.asarray(DEPTH, dtype), jnp.asarray(NORMALS, dtype))
    for array, expected in zip(found, drjit_gradients(method, single=dtype == np.float32), strict=True):
        assert array.dtype == dtype
        assert same(array, expected)


@pytest.mark.parametrize("method", [METHOD, SOFT], ids=["exact cut", "falloff"])
def test_gradients_of_depth_and_normals_are_those_of_differences(method):
    # A random direction would move the background, which lies at infinity.
    nearest = np.where(np.isinf(DEPTH), 4.0, DEPTH)
    reverse_check(lambda z, m: gj.ambient_occlusion(z, unit(m), CAMERA, method), nearest, DIRECTIONS)
    reverse_check(lambda z: gj.ambient_occlusion(z, None, CAMERA, method), nearest)


@pytest.mark.parametrize(
    ("method", "values"),
    [
        (METHOD, {"radius": 1.0, "power": 1.3, "camera.fx": 6.0, "camera.cy": 3.2}),
        (SOFT, {"falloff.start": 0.3, "falloff.end": 0.9, "thin_occluder_compensation": 0.2}),
    ],
    ids=["exact cut", "falloff"],
)
def test_gradients_of_options_and_camera_are_those_of_differences(method, values):
    def visibility(*numbers):
        return gj.ambient_occlusion(DEPTH, NORMALS, CAMERA, method, parameters=dict(zip(values, numbers, strict=True)))

    reverse_check(visibility, *values.values())


def test_gradients_of_multibounce_are_those_of_differences():
    reverse_check(gj.multibounce, VISIBILITY, ALBEDO)
    reverse_check(lambda v: gj.multibounce(v, 0.5, gtao.SPHERE), VISIBILITY)
    reverse_check(lambda v, rho: gj.multibounce(v, rho), VISIBILITY, jnp.asarray(0.5))


def test_gradients_of_specular_occlusion_are_those_of_differences():
    occlusion = gtao.GTAO(radius=1.0, n_slices=2, n_steps=4, bent_normal=True)

    def reflected(z, directions, roughness, f0):
        return gj.specular_occlusion(z, unit(directions), CAMERA, roughness, f0, occlusion)

    nearest = np.where(np.isinf(DEPTH), 4.0, DEPTH)
    reverse_check(reflected, nearest, DIRECTIONS, np.full(CAMERA.shape, 0.9), ALBEDO)
    g = gtao.GBuffer(DEPTH, NORMALS, CAMERA)
    for f0, shape in ((0.04, CAMERA.shape), (ALBEDO[0, 0], (*CAMERA.shape, 3))):
        found = jax.jit(lambda z, f0=f0: gj.specular_occlusion(z, NORMALS, CAMERA, 0.5, f0))(DEPTH)
        assert found.shape == shape
        ao = gtao.ambient_occlusion(g, gtao.GTAO(weighting="uniform", bent_normal=True))
        assert np.array_equal(found, gtao.specular_occlusion(ao, g, 0.5, f0).numpy())


def test_coefficients_are_differentiated_through_a_function_of_ones_own():
    def visibility(v, rho, *coefficients):
        return gtao.multibounce(v, rho, replace(gtao.JIMENEZ2016, coefficients=coefficients))

    wrapped = gj.wrap(visibility, shape=ALBEDO.shape)
    reverse_check(lambda *numbers: wrapped(VISIBILITY, ALBEDO, *numbers), *gtao.JIMENEZ2016.coefficients)


def test_even_footprints_change_sides_from_frame_to_frame():
    g = gtao.GBuffer(DEPTH, NORMALS, CAMERA)
    images = []
    for k in range(2):
        filtered = gj.denoise(VISIBILITY, DEPTH, NORMALS, CAMERA, gtao.SpatialFilter(), frame_index=k)
        expected = gtao.denoise(
            gtao.AmbientOcclusion(visibility=g.types.Tensor(VISIBILITY)), g, gtao.SpatialFilter(), frame_index=k
        )
        images.append(np.asarray(filtered))
        np.testing.assert_array_equal(images[-1], expected.visibility.numpy())
    assert (images[0] != images[1]).any()


@pytest.mark.parametrize("spatial", [gtao.SpatialFilter(), gtao.PlaneAwareFilter()], ids=lambda f: type(f).__name__)
def test_gradients_of_filters_are_those_of_differences(spatial):
    nearest = np.where(np.isinf(DEPTH), 4.0, DEPTH)
    reverse_check(lambda v, z, m: gj.denoise(v, z, unit(m), CAMERA, spatial), VISIBILITY, nearest, DIRECTIONS)


def test_background_has_gradient_zero():
    gradient = jax.grad(weighted)(jnp.asarray(DEPTH), NORMALS)
    assert np.isfinite(gradient).all()
    assert gradient[2, 5] == 0


def test_only_what_is_differentiated_is_attached(monkeypatch):
    from gtao.interop import _jax_callbacks

    attached = []

    class Watched(_jax_callbacks.Call):
        def __init__(self, function, arguments, wanted):
            attached.append(list(wanted))
            super().__init__(function, arguments, wanted)

    monkeypatch.setattr(_jax_callbacks, "Call", Watched)
    jax.grad(weighted)(jnp.asarray(DEPTH), jnp.asarray(NORMALS))
    assert attached == [[False, False], [True, False]]
    attached.clear()
    # Compiled, the gradient alone needs no value.
    jax.jit(jax.grad(weighted, argnums=1))(jnp.asarray(DEPTH), jnp.asarray(NORMALS))
    assert attached == [[False, True]]


def test_batches_by_vmap():
    z = jnp.stack([jnp.asarray(DEPTH), 1.1 * DEPTH])
    found = jax.jit(jax.vmap(jax.grad(weighted), in_axes=(0, None)))(z, jnp.asarray(NORMALS))
    for i in range(2):
        assert same(found[i], jax.grad(weighted)(z[i], jnp.asarray(NORMALS)))


def test_frames_of_a_sequence_share_what_was_compiled():
    traced = []

    @jax.jit
    def visibility(frame_index):
        traced.append(True)
        return gj.ambient_occlusion(
            DEPTH, NORMALS, CAMERA, replace(METHOD, noise="interleaved_gradient"), frame_index=frame_index
        )

    g = gtao.GBuffer(DEPTH, NORMALS, CAMERA)
    for i in range(3):
        expected = gtao.ambient_occlusion(g, replace(METHOD, noise="interleaved_gradient"), frame_index=i)
        assert np.array_equal(visibility(i), expected.visibility.numpy())
    assert len(traced) == 1


def test_equal_calls_share_what_was_compiled():
    """A callback that JAX does not recognise is compiled again in every step."""
    compiled = []
    jax.monitoring.register_event_duration_secs_listener(
        lambda name, *_, **__: compiled.append(name) if "backend_compile" in name else None
    )
    z, n = jnp.asarray(DEPTH), jnp.asarray(NORMALS)
    gj.ambient_occlusion(z, n, CAMERA, gtao.GTAO(radius=0.77, n_slices=2, n_steps=4))
    assert compiled
    compiled.clear()
    gj.ambient_occlusion(z + 1, n, CAMERA, gtao.GTAO(radius=0.77, n_slices=2, n_steps=4), frame_index=3)
    assert len(compiled) <= 1  # z + 1


def test_the_callback_of_devices_without_shared_memory(monkeypatch):
    monkeypatch.setattr(jax, "default_backend", lambda: "gpu")
    found = jax.grad(weighted)(jnp.asarray(DEPTH), jnp.asarray(NORMALS))
    assert same(found, drjit_gradients()[1])


def test_single_precision_unless_double_is_enabled():
    jax.config.update("jax_enable_x64", False)
    z = jnp.asarray(DEPTH)
    assert z.dtype == gj.ambient_occlusion(z, NORMALS, CAMERA, METHOD).dtype == jnp.float32
    assert same(jax.grad(weighted)(z, jnp.asarray(NORMALS)), drjit_gradients(single=True)[1])


@pytest.mark.parametrize("dtype", [jnp.float16, jnp.bfloat16, jnp.int32])
def test_other_numbers_are_computed_with_in_single_precision(dtype):
    z = jnp.full(CAMERA.shape, 4).at[2:4, 2:5].set(3).astype(dtype)
    visibility = gj.ambient_occlusion(z, None, CAMERA, METHOD)
    assert visibility.dtype == jnp.float32
    assert np.array_equal(visibility, gj.ambient_occlusion(z.astype(jnp.float32), None, CAMERA, METHOD))
    if dtype != jnp.int32:
        gradient = jax.grad(lambda z: gj.ambient_occlusion(z, None, CAMERA, METHOD).sum())(z)
        assert gradient.dtype == dtype
        assert abs(gradient).max() > 0


def test_results_of_all_shapes():
    shapes = (VISIBILITY.shape, (), (VISIBILITY.size,))
    function = gj.wrap(lambda a, *, factor: (a * factor, dr.mean(a, axis=None), a.array), shape=shapes)

    def loss(x, k):
        a, b, c = function(x, factor=k)
        return a.sum() + b + c.sum()

    x, k = jax.grad(loss, argnums=(0, 1))(jnp.asarray(VISIBILITY), jnp.asarray(3.0))
    assert np.allclose(x, 3 + 1 / VISIBILITY.size + 1, rtol=1e-12)
    assert k == pytest.approx(VISIBILITY.sum(), rel=1e-12)
    # One of several results alone: the others' gradients are zeros that JAX only knows as such.
    only = jax.grad(lambda x: function(x, factor=jnp.asarray(3.0))[1])(jnp.asarray(VISIBILITY))
    assert np.allclose(only, 1 / VISIBILITY.size, rtol=1e-12)


def test_forward_mode_and_second_derivatives_are_refused():
    z, n = jnp.asarray(DEPTH), jnp.asarray(NORMALS)
    with pytest.raises(TypeError, match="forward-mode"):
        jax.jvp(lambda z: weighted(z, n), (z,), (z,))
    with pytest.raises(ValueError, match="do not support"):
        jax.grad(lambda z: jax.grad(weighted)(z, n).sum())(z)


def test_arguments_that_are_no_arrays():
    scale = gj.wrap(lambda a, factor: a * factor)
    assert np.allclose(scale(VISIBILITY, 2), 2 * VISIBILITY, rtol=1e-15)
    with pytest.raises(gtao.ConfigError, match=r"argument number 1 is neither an array nor hashable: a list"):
        scale(VISIBILITY, [2])
    with pytest.raises(gtao.ShapeError, match="none of the arguments"):
        scale(2.0, 2)
    for wrong in (VISIBILITY > 0.5, VISIBILITY.astype(complex)):
        with pytest.raises(gtao.ShapeError, match="real numbers, got"):
            scale(wrong, 2)


def test_errors_of_the_function_arrive_with_their_words():
    broken = jnp.asarray(np.where(np.isinf(DEPTH), -1.0, DEPTH))
    # JAX raises an error of its own, a ValueError from its interpreter and a RuntimeError from its compiler.
    for call in (gj.ambient_occlusion, jax.jit(gj.ambient_occlusion, static_argnums=(2, 3))):
        with pytest.raises((ValueError, RuntimeError), match="ShapeError: view_z must be positive"):
            jax.block_until_ready(call(broken, jnp.asarray(NORMALS), CAMERA, METHOD))
    assert gj.ambient_occlusion(broken, NORMALS, CAMERA, METHOD, validate=False).shape == CAMERA.shape
    with pytest.raises((ValueError, RuntimeError), match=r"returned shapes \(\(48,\),\) where \(\(6, 8\),\)"):
        jax.block_until_ready(gj.wrap(lambda a: a.array)(VISIBILITY))


@pytest.mark.slow
def test_one_processor_is_enough():
    """JAX has as many threads as processors, and a callback that waits for another of them would wait for ever."""
    script = """
import os
os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
import gtao, jax
camera, method = gtao.PerspectiveCamera(500, 500, 0.9), gtao.GTAO(radius=0.1, n_slices=1, n_steps=1)
loss = lambda z: (gtao.interop.jax.ambient_occlusion(1.01 * z, None, camera, method) * z).sum()
z = 4 + jax.random.uniform(jax.random.key(0), camera.shape)
for _ in range(20):
    # Not waited for, so that computations queue up behind each other.
    loss(z), jax.grad(loss)(z), jax.jit(jax.grad(loss))(z)
print(jax.block_until_ready(loss(z)).shape)
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=600)
    assert done.stdout.strip() == "()", done.stderr
