"""Estimates with masks and scrambled sequences: in bands, in double precision, with gradients."""

import drjit as dr
import numpy as np
import pytest
from drjit.auto.ad import TensorXf64

import gtao

HEIGHT, WIDTH = 70, 66
CAMERA = gtao.PerspectiveCamera(WIDTH, HEIGHT, 1.0)


def depths():
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    return 3 + 0.3 * np.sin(x / 5) * np.cos(y / 7)


@pytest.mark.parametrize("noise", ["blue_noise", "sobol", "interleaved_gradient_golden", "spatial_4x4_spread"])
def test_bands_are_rows_of_the_frame(noise):
    """Rows below the mask's 64, too."""
    g = gtao.GBuffer(np.float32(depths()), None, CAMERA)
    method = gtao.GTAO(radius=1.0, n_slices=2, n_steps=3, noise=noise, seed=9)
    whole, bands = (
        gtao.ambient_occlusion(g, method, frame_index=5, max_pixels=n).visibility.numpy() for n in (None, 9 * WIDTH)
    )
    assert np.array_equal(whole, bands)


@pytest.mark.parametrize("noise", ["blue_noise", "sobol"])
def test_gradients_are_differences(noise):
    """Along a direction, in double precision: no mask is differentiated, and none is in the way."""
    method = gtao.GTAO(radius=1.0, n_slices=1, n_steps=3, noise=noise, fetch="linear", falloff=gtao.NoCut())
    rng = np.random.default_rng(3)
    normals = np.broadcast_to([0.0, 0.0, 1.0], (HEIGHT, WIDTH, 3))
    direction, weights = rng.normal(size=(HEIGHT, WIDTH)), rng.random((HEIGHT, WIDTH))

    def loss(z):
        g = gtao.GBuffer(z, TensorXf64(normals), CAMERA)
        return dr.sum(gtao.ambient_occlusion(g, method, frame_index=3).visibility * TensorXf64(weights), axis=None)

    z = TensorXf64(depths())
    dr.enable_grad(z)
    dr.backward(loss(z))
    found = float(np.sum(dr.grad(z).numpy() * direction))
    h = 1e-7
    low, high = (float(loss(TensorXf64(depths() + d * direction)).array[0]) for d in (-h, h))
    # Second differences of order h, rounding 1e-12 / h; where two samples tie, one pixel's share of either.
    assert found == pytest.approx((high - low) / (2 * h), rel=1e-4, abs=1e-3)
