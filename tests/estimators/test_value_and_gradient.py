"""The loss and its gradients in one launch, and estimates in bands: the same numbers on other ways."""

import drjit as dr
import numpy as np
import pytest

import gtao

drjit_ad = pytest.importorskip("drjit.llvm.ad", reason="this Dr.Jit has no LLVM backend")
Float64, TensorXf64 = drjit_ad.Float64, drjit_ad.TensorXf64

RNG = np.random.default_rng(3)
HEIGHT, WIDTH = 17, 22
DEPTH = 3 + 0.5 * RNG.random((HEIGHT, WIDTH))
DEPTH[2:5, 3:9] = np.inf
NORMALS = RNG.normal((0, 0, 2.5), size=(HEIGHT, WIDTH, 3))
NORMALS /= np.linalg.norm(NORMALS, axis=-1, keepdims=True)
CAMERA = gtao.PerspectiveCamera(WIDTH, HEIGHT, 0.8)
# The same operations in another order: rounding of float64.
ROUNDING = 1e-12

METHODS = {
    "1 slice": gtao.GTAO(radius=0.8, n_slices=1, n_steps=5),
    "3 slices, falloff": gtao.GTAO(
        radius=1.0, n_slices=3, n_steps=4, fetch="linear", falloff=gtao.LinearFalloff(start=0.2, end=0.9), power=1.4
    ),
    "more slices than are unrolled": gtao.GTAO(radius=0.8, n_slices=7, n_steps=3, noise="white"),
    "through every sample": gtao.HBAO(radius=0.8, n_directions=4, n_steps=4),
}


def loss(visibility):
    return dr.square(visibility - 0.4)


def frame(derived=False, attach=True):
    view_z, normals = TensorXf64(DEPTH), TensorXf64(NORMALS)
    if attach:
        dr.enable_grad(view_z, normals)
    return view_z, normals, gtao.GBuffer(view_z, None if derived else normals, CAMERA)


@pytest.mark.parametrize("derived", [False, True], ids=["normals", "derived normals"])
@pytest.mark.parametrize("name", METHODS)
def test_it_is_what_backward_gives(name, derived):
    view_z, normals, g = frame(derived)
    visibility = gtao.ambient_occlusion(g, METHODS[name], frame_index=2).visibility
    total = dr.sum(loss(visibility).array)
    dr.backward(total)
    _, _, still = frame(derived, attach=False)
    result = gtao.value_and_gradient(loss, still, METHODS[name], frame_index=2)
    assert result.value[0] == pytest.approx(total[0], rel=ROUNDING)
    np.testing.assert_allclose(result.visibility.numpy(), visibility.numpy(), atol=ROUNDING)
    np.testing.assert_allclose(result.view_z.numpy(), dr.grad(view_z).numpy(), atol=ROUNDING)
    assert np.abs(result.view_z.numpy()).max() > 0.1
    if derived:
        assert result.normal_v is None
    else:
        np.testing.assert_allclose(result.normal_v.numpy(), dr.grad(normals).numpy(), atol=ROUNDING)
        assert np.abs(result.normal_v.numpy()).max() > 0.1


def test_the_frame_and_its_gradients_stay_as_they_are():
    view_z, _, g = frame()
    gtao.value_and_gradient(loss, g, METHODS["1 slice"])
    assert not np.any(dr.grad(view_z).numpy())
    assert g.view_z is not view_z
    dr.backward(dr.sum(gtao.ambient_occlusion(g, METHODS["1 slice"]).visibility.array))
    assert np.any(dr.grad(view_z).numpy())


def test_options_that_carry_gradients_receive_theirs():
    radii = Float64(0.8), Float64(0.8)
    dr.enable_grad(radii)
    _, _, g = frame(attach=False)
    gtao.value_and_gradient(loss, g, gtao.GTAO(radius=radii[0], n_slices=2))
    dr.backward(dr.sum(loss(gtao.ambient_occlusion(g, gtao.GTAO(radius=radii[1], n_slices=2)).visibility).array))
    assert dr.grad(radii[0])[0] == pytest.approx(dr.grad(radii[1])[0], rel=ROUNDING)
    assert abs(dr.grad(radii[0])[0]) > 0.1


def test_one_large_launch_for_the_estimate_the_loss_and_the_gradients():
    _, _, g = frame(attach=False)
    method = METHODS["1 slice"]
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        gtao.value_and_gradient(loss, g, method)
        counts = [k["operation_count"] for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT]
    # The other one adds the two gradients of the depth.
    assert sorted(counts)[:-1] == [n for n in sorted(counts) if n < 20]
    assert len(counts) <= 2


@pytest.mark.parametrize(
    ("bad", "error", "message"),
    [
        (lambda v: dr.sum(v.array), gtao.ShapeError, "one number for each pixel"),
        (lambda v: dr.square(dr.detach(v)), gtao.ConfigError, "does not depend on the visibility"),
        (lambda v: 0.5, gtao.ShapeError, "got float"),
    ],
)
def test_a_loss_that_is_none_is_refused_in_words(bad, error, message):
    _, _, g = frame(attach=False)
    with pytest.raises(error, match=message):
        gtao.value_and_gradient(bad, g)


def test_a_frame_that_is_none_is_refused_in_words():
    with pytest.raises(gtao.ConfigError, match=r"gtao\.GBuffer"):
        gtao.value_and_gradient(loss, DEPTH)


# 17 rows in bands of 1, 5 and 16 rows, the last of which overlaps the one before; and all at once.
@pytest.mark.parametrize("max_pixels", [1, 5 * WIDTH, 16 * WIDTH + 3, HEIGHT * WIDTH, 10**9])
@pytest.mark.parametrize("name", METHODS)
def test_bands_give_the_same_values_and_gradients(name, max_pixels):
    def run(**options):
        view_z, normals, g = frame()
        radius = Float64(0.8)
        dr.enable_grad(radius)
        method = (
            METHODS[name] if "falloff" in name else gtao.method_from_dict(METHODS[name].to_dict() | {"radius": radius})
        )
        visibility = gtao.ambient_occlusion(g, method, **options).visibility
        dr.backward(dr.sum(loss(visibility).array))
        return [visibility.numpy(), *(dr.grad(a).numpy() for a in (view_z, normals, radius))]

    for banded, whole in zip(run(max_pixels=max_pixels), run(), strict=True):
        np.testing.assert_allclose(banded, whole, atol=ROUNDING)


@pytest.mark.parametrize("name", METHODS)
def test_bands_without_gradients_give_the_same_bits(name):
    _, _, g = frame(attach=False)
    banded = gtao.ambient_occlusion(g, METHODS[name], max_pixels=3 * WIDTH).visibility.numpy()
    assert np.array_equal(banded, gtao.ambient_occlusion(g, METHODS[name]).visibility.numpy())


def test_forward_mode_in_bands():
    tangents = []
    for options in ({}, {"max_pixels": 4 * WIDTH}):
        view_z, _, g = frame()
        dr.set_grad(
            view_z, TensorXf64(np.where(np.isfinite(DEPTH), np.cos(np.arange(DEPTH.size)).reshape(DEPTH.shape), 0))
        )
        visibility = gtao.ambient_occlusion(g, METHODS["1 slice"], **options).visibility
        dr.forward_to(visibility)
        tangents.append(dr.grad(visibility).numpy())
    np.testing.assert_allclose(*tangents, atol=ROUNDING)
    assert np.abs(tangents[0]).max() > 0.1


@pytest.mark.parametrize("value", [0, -5, 2.5, True, "all"])
def test_max_pixels_is_a_positive_number(value):
    _, _, g = frame(attach=False)
    with pytest.raises(gtao.ConfigError, match="max_pixels must be a positive integer"):
        gtao.ambient_occlusion(g, max_pixels=value)


def test_ground_truths_come_in_one_piece():
    _, _, g = frame(attach=False)
    with pytest.raises(gtao.ConfigError, match="leave max_pixels out"):
        gtao.ambient_occlusion(g, gtao.HeightfieldRayMarch(radius=1.0), max_pixels=100)
