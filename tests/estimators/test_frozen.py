"""Estimates inside ``dr.freeze``: recorded once, replayed for other frames, equal to the same function not frozen."""

import drjit as dr
import numpy as np
import pytest
from drjit.auto.ad import TensorXf

import gtao

HEIGHT, WIDTH = 32, 40
CAMERA = gtao.PerspectiveCamera(WIDTH, HEIGHT, 1.0)
FALLOFF = gtao.LinearFalloff(start=0.3, end=0.5)
METHODS = {
    "horizons": gtao.GTAO(radius=0.5, n_slices=2, n_steps=4, falloff=FALLOFF),
    "exact cut": gtao.GTAO(radius=0.5, n_slices=2, n_steps=4),
    "linear fetch": gtao.GTAO(radius=0.5, n_slices=2, n_steps=4, fetch="linear"),
    "pyramid": gtao.GTAO(radius=0.5, n_slices=2, n_steps=4, pyramid=gtao.DepthPyramid()),
    "blue noise": gtao.GTAO(radius=0.5, n_slices=2, n_steps=4, falloff=FALLOFF, noise="blue_noise"),
    "Sobol": gtao.GTAO(radius=0.5, n_slices=2, n_steps=4, falloff=FALLOFF, noise="sobol"),
    "HBAO": gtao.HBAO(radius=0.5, n_directions=4, n_steps=4),
    "bitmask": gtao.VisibilityBitmask(radius=0.5, n_slices=2, n_steps=4),
}
DIFFERENTIABLE = ("horizons", "exact cut", "linear fetch", "pyramid", "blue noise", "Sobol", "HBAO")
N_FRAMES = 3


def arrays(seed, shape=(HEIGHT, WIDTH)):
    rng = np.random.default_rng(seed)
    z = 3 + 0.2 * rng.random(shape)
    z[rng.random(shape) < 0.05] = np.inf
    n = rng.normal(size=(*shape, 3)) + np.array([0, 0, 2])
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    return own(z), own(n)


def own(array):
    """A tensor with memory of its own: where NumPy's lies in memory would be part of the recording."""
    return dr.opaque(TensorXf(np.float32(array)))


def visibility(z, n, camera, method):
    return gtao.ambient_occlusion(gtao.GBuffer(z, n, camera, validate=False), method).visibility


def step(z, n, target, camera, method):
    """Loss and gradients: a whole step, because gradients do not flow through a frozen function."""
    inputs = [x for x in (z, n) if x is not None]
    dr.enable_grad(*inputs)
    loss = dr.mean(dr.square(visibility(z, n, camera, method) - target), axis=None)
    dr.backward(loss)
    return loss, *map(dr.grad, inputs)


@pytest.mark.parametrize("derived", [False, True], ids=["normals", "derived"])
@pytest.mark.parametrize("name", METHODS)
def test_a_frozen_estimate_sees_the_frame_that_it_is_given(name, derived):
    frozen = dr.freeze(visibility)
    results = []
    for seed in range(N_FRAMES):
        z, n = arrays(seed)
        n = None if derived else n
        results.append(frozen(z, n, CAMERA, METHODS[name]).numpy())
        np.testing.assert_array_equal(results[-1], visibility(z, n, CAMERA, METHODS[name]).numpy())
    assert frozen.n_recordings == 1
    assert np.abs(results[0] - results[1]).max() > 0.01


@pytest.mark.parametrize("derived", [False, True], ids=["normals", "derived"])
@pytest.mark.parametrize("name", DIFFERENTIABLE)
def test_a_frozen_step_makes_the_gradients_of_its_frame(name, derived):
    frozen = dr.freeze(step)
    gradients = []
    for seed in range(N_FRAMES):
        target = own(np.random.default_rng(100 + seed).random((HEIGHT, WIDTH)))
        found, expected = (
            [x.numpy() for x in f(z, None if derived else n, target, CAMERA, METHODS[name])]
            for f in (frozen, step)
            for z, n in [arrays(seed)]
        )
        for a, b in zip(found, expected, strict=True):
            # Two threads add in any order.
            np.testing.assert_allclose(a, b, rtol=1e-4, atol=1e-5 * np.abs(b).max())
        gradients.append(found[1])
    assert frozen.n_recordings == 1
    assert np.abs(gradients[0] - gradients[1]).max() > 1e-4


def test_another_camera_method_or_size_is_recorded_anew():
    frozen = dr.freeze(visibility)
    z, n = arrays(0)
    narrow = gtao.PerspectiveCamera(WIDTH, HEIGHT, 0.7)
    small = gtao.PerspectiveCamera(WIDTH // 2, HEIGHT // 2, 1.0)
    calls = [
        (z, n, CAMERA, METHODS["horizons"]),
        (z, n, narrow, METHODS["horizons"]),
        (z, n, CAMERA, METHODS["exact cut"]),
        (*arrays(1, small.shape), small, METHODS["horizons"]),
    ]
    for number, call in enumerate(calls, start=1):
        np.testing.assert_array_equal(frozen(*call).numpy(), visibility(*call).numpy())
        assert frozen.n_recordings == number


def test_what_cannot_be_recorded_is_said_in_words():
    """A NumPy array would end the process."""
    z, n = arrays(0)

    @dr.freeze
    def looked_at(z, n):
        return gtao.GBuffer(z, n, CAMERA).view_z

    for frozen, call, message in (
        (looked_at, (z, n), "validate=False"),
        (dr.freeze(visibility), (z.numpy(), n, CAMERA, METHODS["horizons"]), "view_z must be a Dr.Jit tensor"),
    ):
        with pytest.raises(RuntimeError) as error:
            frozen(*call)
        assert message in str(error.value.__cause__)
