"""Depth layers, a frame that carries them, and windows of both."""

import numpy as np
import pytest

import gtao
from gtao import DepthLayers, ShapeError

INF = np.inf
CAMERA = gtao.PerspectiveCamera(3, 2, 1.0)
#: (2, 2, 3): a body before a sheet, a sheet, a body that is never left; then background and two bodies.
FRONT = np.array([[[1, 2, 3], [INF, 1, 1.5]], [[4, INF, INF], [INF, 2, INF]]], np.float32)
BACK = np.array([[[1.5, 2, INF], [INF, 2, 4]], [[4, INF, INF], [INF, 2, INF]]], np.float32)
THICKNESS = [[0.5, 0, INF], [0, 1, 2.5]]


def frame(front=FRONT, back=BACK, **extra):
    return gtao.GBuffer(front[0], None, CAMERA, layers=DepthLayers(front, back), **extra)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_thickness_is_the_extent_of_the_first_body(dtype):
    layers = DepthLayers(FRONT.astype(dtype), BACK.astype(dtype))
    assert (layers.shape, layers.n_layers) == ((2, 2, 3), 2)
    thickness = layers.thickness.numpy()
    assert thickness.dtype == dtype
    np.testing.assert_array_equal(thickness, THICKNESS)
    np.testing.assert_array_equal(layers.back.numpy(), BACK)
    assert repr(layers) == "DepthLayers(3x2, 2 layers)"


def changed(array, value, index=(0, 1, 1)):
    array = array.copy()
    array[index] = value
    return array


@pytest.mark.parametrize(
    ("front", "back", "message"),
    [
        (FRONT[0], BACK[0], r"front must have shape \(layers, height, width\)"),
        (FRONT[:0], BACK[:0], "a layer at least"),
        (FRONT, BACK[:1], r"back must have shape \(2, 2, 3\)"),
        (changed(FRONT, np.nan), BACK, "front must be positive distances, inf where there is no body, but 1 are not"),
        (FRONT, changed(BACK, np.nan), "back must be positive"),
        (changed(FRONT, 0.0), BACK, "front must be positive"),
        (changed(FRONT, -INF), BACK, "front must be positive"),
        (FRONT, changed(BACK, 0.5), "layer 0 ends before it begins at 1 pixels"),
        (FRONT, changed(BACK, 2.5), "layer 1 begins before layer 0 ends at 1 pixels"),
        (changed(FRONT, 5.0, (1, 0, 2)), changed(BACK, 5.0, (1, 0, 2)), "layer 1 begins before layer 0 ends"),
        (changed(FRONT, INF, (1, 0, 0)), BACK, "layer 1 ends before it begins"),
        (FRONT, BACK.astype(np.float64), "both be single or both be double"),
        ([[[1.0]]], BACK, "front must have shape"),
    ],
)
def test_bad_layers_are_named(front, back, message):
    with pytest.raises(ShapeError, match=message):
        DepthLayers(front, back)


def test_a_frame_checks_that_the_layers_are_its_own():
    g = frame()
    assert isinstance(g.layers, DepthLayers)
    assert repr(g) == "GBuffer(3x2, perspective, layers)"
    assert gtao.GBuffer(FRONT[0], None, CAMERA).layers is None
    with pytest.raises(ShapeError, match=r"layers must be gtao\.DepthLayers, got ndarray"):
        gtao.GBuffer(FRONT[0], None, CAMERA, layers=FRONT)
    with pytest.raises(ShapeError, match="the layers are of a frame of 2x2, not 3x2"):
        gtao.GBuffer(FRONT[0], None, CAMERA, layers=DepthLayers(FRONT[..., :2], BACK[..., :2]))
    with pytest.raises(ShapeError, match="both be single or both be double"):
        gtao.GBuffer(FRONT[0].astype(float), None, CAMERA, layers=DepthLayers(FRONT, BACK))
    for view_z in (FRONT[0] * np.float32(1.001), np.where(np.isinf(FRONT[0]), 9, FRONT[0]), changed(FRONT, INF)[0]):
        with pytest.raises(ShapeError, match="the first layer must begin at view_z, but does not at"):
            gtao.GBuffer(view_z, None, CAMERA, layers=DepthLayers(FRONT, BACK))
    with pytest.raises(ShapeError, match="the first layer must begin at view_z"):
        gtao.GBuffer(FRONT[0] + 1, None, CAMERA).with_layers(DepthLayers(FRONT, BACK))
    derived = gtao.GBuffer(FRONT[0], None, CAMERA).with_layers(DepthLayers(FRONT, BACK))
    assert derived.normals_derived
    np.testing.assert_array_equal(derived.layers.back.numpy(), BACK)
    # What a conversion between units and back leaves behind.
    gtao.GBuffer(FRONT[0] * np.float32(1 + 2e-7), None, CAMERA, layers=DepthLayers(FRONT, BACK))


def test_a_window_of_a_frame():
    rng = np.random.default_rng(0)
    view_z = rng.uniform(1, 2, (6, 8)).astype(np.float32)
    view_z[2, 3] = INF
    normal = rng.normal(size=(6, 8, 3))
    normal[..., 2] += 3
    normal = (normal / np.linalg.norm(normal, axis=-1, keepdims=True)).astype(np.float32)
    albedo = rng.uniform(size=(6, 8, 3)).astype(np.float32)
    motion = rng.normal(size=(6, 8, 2)).astype(np.float32)
    front = np.stack([view_z, view_z + 3])
    layers = DepthLayers(front, front + np.float32(0.5))
    camera = gtao.PerspectiveCamera(8, 6, 0.9, cx=3.0)
    g = gtao.GBuffer(view_z, normal, camera, albedo, motion, layers)
    part = g.crop(2, 1, 5, 4)
    rows, columns = slice(1, 5), slice(2, 7)
    assert part.camera == camera.crop(2, 1, 5, 4)
    np.testing.assert_array_equal(part.view_z.numpy(), view_z[rows, columns])
    np.testing.assert_array_equal(part.normal_v.numpy(), g.normal_v.numpy()[rows, columns])
    np.testing.assert_array_equal(part.albedo.numpy(), albedo[rows, columns])
    np.testing.assert_array_equal(part.motion.numpy(), motion[rows, columns])
    np.testing.assert_array_equal(part.layers.front.numpy(), front[:, rows, columns])
    np.testing.assert_array_equal(part.layers.back.numpy(), front[:, rows, columns] + np.float32(0.5))
    np.testing.assert_allclose(part.position_v.numpy(), g.position_v.numpy()[rows, columns], rtol=1e-6)
    assert not part.normals_derived
    # Derived normals are those of the whole frame, not derived again from the window.
    derived = gtao.GBuffer(view_z, None, camera)
    inner = derived.crop(2, 1, 5, 4)
    assert inner.normals_derived
    np.testing.assert_array_equal(inner.normal_v.numpy(), derived.normal_v.numpy()[rows, columns])


@pytest.mark.parametrize("region", [(-1, 0, 2, 2), (0, 0, 4, 2), (0, 1, 3, 2), (0, 0, 0, 1), (0, -1, 3, 2)])
def test_a_window_lies_within_the_frame(region):
    for thing in (frame(), frame().layers):
        with pytest.raises(ShapeError, match=r"does not lie within an image of 3x2"):
            thing.crop(*region)
