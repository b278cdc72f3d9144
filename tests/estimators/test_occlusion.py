"""The image-level estimator: what comes in, what goes out, and its gradient."""

import math
import struct

import drjit as dr
import numpy as np
import pytest
from drjit.llvm.ad import TensorXf64

import gtao

RNG = np.random.default_rng(3)
HEIGHT, WIDTH = 12, 16
CAMERA = gtao.PerspectiveCamera(WIDTH, HEIGHT, 1.0)
DEPTH = 3 + 0.5 * RNG.random((HEIGHT, WIDTH))
NORMALS = RNG.normal(size=(HEIGHT, WIDTH, 3)) * 0.3 + [0, 0, 1]
NORMALS /= np.linalg.norm(NORMALS, axis=-1, keepdims=True)

# Central differences with h = 1e-6 in float64: rounding 1e-16 / h = 1e-10, truncation h² = 1e-12, relative to
# gradients of order 1 through intermediate values of order 10.
STEP, TOLERANCE = 1e-6, 1e-6


def summed(z, normals=NORMALS, **options):
    g = gtao.GBuffer(z, normals if dr.is_tensor_v(normals) else TensorXf64(normals), CAMERA)
    return dr.sum(gtao.ambient_occlusion(g, gtao.GTAO(**options)).visibility, axis=None)


GRADIENT_CASES = {
    "cosine": {},
    "uniform": {"weighting": "uniform"},
    "published measure": {"slice_measure": "screen"},
    "finite radius": {"radius": 1.0},
    "falloff": {"radius": 1.0, "falloff": gtao.LinearFalloff(start=0.3, end=1.0)},
    "linear fetch": {"fetch": "linear"},
    "without snapping": {"snap_to_texel": False},
}


@pytest.mark.parametrize("name", GRADIENT_CASES)
def test_reverse_mode_is_the_derivative(name):
    options = {"n_slices": 3, "n_steps": 4} | GRADIENT_CASES[name]
    depth = DEPTH.copy()
    depth[3:6, 4:9] = np.inf
    z = TensorXf64(depth)
    dr.enable_grad(z)
    dr.backward(summed(z, **options))
    gradient = dr.grad(z).numpy()
    assert np.all(np.isfinite(gradient))
    assert np.all(gradient[~np.isfinite(depth)] == 0)
    surface = np.argwhere(np.isfinite(depth))
    for i, j in surface[np.random.default_rng(0).choice(len(surface), 12, replace=False)]:
        values = []
        for h in (STEP, -STEP):
            moved = depth.copy()
            moved[i, j] += h
            values.append(summed(TensorXf64(moved), **options).array[0])
        assert gradient[i, j] == pytest.approx((values[0] - values[1]) / (2 * STEP), rel=TOLERANCE, abs=TOLERANCE)


def test_gradient_of_the_normals():
    normals = TensorXf64(NORMALS)
    dr.enable_grad(normals)
    dr.backward(summed(TensorXf64(DEPTH), normals, n_slices=3, n_steps=4))
    gradient = dr.grad(normals).numpy()
    direction = np.random.default_rng(1).normal(size=NORMALS.shape)
    # The G-buffer normalises, so moving a normal along itself changes nothing.
    values = [summed(TensorXf64(DEPTH), NORMALS + h * direction, n_slices=3, n_steps=4).array[0] for h in (1e-6, -1e-6)]
    assert np.sum(gradient * direction) == pytest.approx((values[0] - values[1]) / 2e-6, rel=TOLERANCE)


def test_a_gradient_through_too_many_steps_is_refused_and_not_wrong():
    z = TensorXf64(DEPTH)
    dr.enable_grad(z)
    # Horizons that sink again depend on every sample.
    thick = {"falloff": gtao.NoCut(), "thickness": gtao.RunningThickness(blend=0.1)}
    with pytest.raises(gtao.ConfigError, match="n_steps <= 32"):
        summed(z, n_slices=2, n_steps=64, **thick)


def frame(**options):
    return gtao.GBuffer(DEPTH.astype(np.float32), NORMALS.astype(np.float32), CAMERA)


def test_the_same_input_gives_the_same_bits():
    first, second = (gtao.ambient_occlusion(frame(), gtao.GTAO(noise="white", seed=7)).visibility.numpy() for _ in "ab")
    assert np.array_equal(first, second)


@pytest.mark.parametrize("noise", ["spatial_4x4", "interleaved_gradient", "white"])
def test_frames_differ_and_average_to_the_dense_estimate(noise):
    dense = gtao.ambient_occlusion(frame(), gtao.GTAO(n_slices=64, n_steps=8, noise="none")).visibility.numpy()
    frames = [
        gtao.ambient_occlusion(frame(), gtao.GTAO(n_slices=1, n_steps=8, noise=noise), frame_index=i).visibility.numpy()
        for i in range(24)
    ]
    single = np.sqrt(np.mean((frames[0] - dense) ** 2))
    mean = np.sqrt(np.mean((np.mean(frames, axis=0) - dense) ** 2))
    assert not np.array_equal(frames[0], frames[1])
    # 24 independent frames would divide the noise by 4.9; what remains is the bias between offset grids.
    assert mean < single / 2


def test_the_seed_matters_to_white_noise_only():
    def image(noise, seed):
        return gtao.ambient_occlusion(frame(), gtao.GTAO(noise=noise, seed=seed)).visibility.numpy()

    assert not np.array_equal(image("white", 0), image("white", 1))
    assert np.array_equal(image("spatial_4x4", 0), image("spatial_4x4", 1))


def test_background_is_open_and_throws_no_shadow():
    depth = DEPTH.copy()
    depth[:, 8:] = np.inf
    g = gtao.GBuffer(depth.astype(np.float32), NORMALS.astype(np.float32), CAMERA)
    whole = gtao.ambient_occlusion(g, gtao.GTAO(n_slices=8, n_steps=16)).visibility.numpy()
    left = gtao.GBuffer(
        depth[:, :8].astype(np.float32), NORMALS[:, :8].astype(np.float32), CAMERA.crop(0, 0, 8, HEIGHT)
    )
    cropped = gtao.ambient_occlusion(left, gtao.GTAO(n_slices=8, n_steps=512)).visibility.numpy()
    assert np.all(whole[:, 8:] == 1)
    assert np.all(np.isfinite(whole))
    # Leaving the frame and looking at the background are the same: no occluder. Steps fall on other texels there.
    dense = gtao.ambient_occlusion(g, gtao.GTAO(n_slices=8, n_steps=512)).visibility.numpy()
    assert np.max(np.abs(dense[:, :8] - cropped)) < 0.02


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (5, 1), (2, 2)])
@pytest.mark.parametrize("fetch", ["nearest", "linear"])
def test_tiny_images(shape, fetch):
    height, width = shape
    camera = gtao.PerspectiveCamera(width, height, 1.0)
    g = gtao.GBuffer(np.full(shape, 2.0, np.float32), None, camera)
    v = gtao.ambient_occlusion(g, gtao.GTAO(fetch=fetch, snap_to_texel=True)).visibility.numpy()
    assert v.shape == shape
    assert np.all(np.isfinite(v))
    # A wall that faces the camera is open; texels beside the slice and four slices off axis cost up to a percent.
    assert v == pytest.approx(1.0, abs=1e-3 if fetch == "linear" and min(shape) > 1 else 1e-2)


def test_a_radius_below_a_pixel_leaves_a_smooth_surface_open():
    g = gtao.GBuffer(np.full((8, 8), 2.0, np.float32), None, gtao.PerspectiveCamera(8, 8, 1.0))
    v = gtao.ambient_occlusion(g, gtao.GTAO(radius=1e-3)).visibility.numpy()
    # The normal faces the camera, slices of an unoccluded surface seen off axis vary by the error of 4 slices.
    assert v == pytest.approx(1.0, abs=2e-3)


def test_visibility_grows_as_the_radius_shrinks():
    means = [
        gtao.ambient_occlusion(frame(), gtao.GTAO(radius=r, n_slices=8, n_steps=16)).visibility.numpy().mean()
        for r in (0.1, 0.3, 1.0, math.inf)
    ]
    assert means == sorted(means, reverse=True)
    assert means[0] - means[-1] > 0.05


def test_the_pixel_clamp_shortens_the_search():
    free, clamped = (
        gtao.ambient_occlusion(frame(), gtao.GTAO(n_slices=8, n_steps=16, max_radius_px=m)).visibility.numpy().mean()
        for m in (None, 1.0)
    )
    assert clamped > free


def test_float64_in_float64_out():
    g = gtao.GBuffer(DEPTH, NORMALS, CAMERA)
    assert gtao.ambient_occlusion(g).visibility.numpy().dtype == np.float64
    assert gtao.ambient_occlusion(frame()).visibility.numpy().dtype == np.float32


def test_float32_agrees_with_float64():
    single = gtao.ambient_occlusion(frame(), gtao.GTAO(n_slices=8)).visibility.numpy()
    double = gtao.ambient_occlusion(gtao.GBuffer(DEPTH, NORMALS, CAMERA), gtao.GTAO(n_slices=8)).visibility.numpy()
    # Rounding reaches 1e-5; a tap that crosses into the next texel changes a pixel more, and is rare.
    assert np.quantile(np.abs(single - double), 0.9) < 1e-5


def test_results_show_themselves():
    ao = gtao.ambient_occlusion(frame())
    png = ao._repr_png_()
    assert png.startswith(b"\x89PNG")
    assert struct.unpack(">II", png[16:24]) == (WIDTH, HEIGHT)
    assert f"{WIDTH}x{HEIGHT}" in repr(ao)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("not a buffer",), "must be a gtao.GBuffer"),
        ((None, "gtao"), "must be one of gtao.GTAO"),
    ],
)
def test_wrong_arguments(arguments, message):
    g, *rest = arguments
    with pytest.raises(gtao.ConfigError, match=message):
        gtao.ambient_occlusion(frame() if g is None else g, *rest)


@pytest.mark.parametrize("index", [-1, 1.5, True])
def test_wrong_frame_index(index):
    with pytest.raises(gtao.ConfigError, match="frame_index"):
        gtao.ambient_occlusion(frame(), frame_index=index)


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
@pytest.mark.parametrize(("far", "near", "radius"), [(100, 5, 1), (1000, 5, 1), (1000, 5, 10), (10000, 5, 1)])
def test_single_precision_survives_an_occluder_many_radii_in_front(far, near, radius, weighting):
    """A thin column close to the camera before a wall: the radius is tiny beside their distance."""
    camera = gtao.PerspectiveCamera(160, 120, 1.0)
    depth = np.full((120, 160), float(far))
    depth[:, 77:83] = near
    method = gtao.GTAO(radius=radius, n_slices=8, n_steps=16, weighting=weighting)
    normals = np.tile([0.0, 0.0, 1.0], (120, 160, 1))
    single, double = (
        gtao.ambient_occlusion(gtao.GBuffer(depth.astype(t), normals.astype(t), camera), method).visibility.numpy()
        for t in (np.float32, np.float64)
    )
    assert single.min() >= 0
    # Single pixels differ where a sample lies exactly on the rim of the sphere or between two texels.
    assert np.mean(np.abs(single - double) > 1e-3) < 1e-3
