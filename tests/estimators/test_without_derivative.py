"""What would have a derivative of zero everywhere is refused, and no gradient is lost between types."""

import drjit as dr
import numpy as np
import pytest

import gtao

drjit_ad = pytest.importorskip("drjit.llvm.ad", reason="this Dr.Jit has no LLVM backend")
Float64 = drjit_ad.Float64

RNG = np.random.default_rng(5)
DEPTH = 3 + 0.4 * RNG.random((12, 15))
NORMALS = RNG.normal((0, 0, 3), size=(12, 15, 3))
NORMALS /= np.linalg.norm(NORMALS, axis=-1, keepdims=True)
CAMERA = gtao.PerspectiveCamera(15, 12, 0.9)
LINEAR = gtao.LinearFalloff(start=0.2, end=0.6)


def number(value):
    result = Float64(value)
    dr.enable_grad(result)
    return result


@pytest.mark.parametrize(
    ("option", "method"),
    [
        ("radius", lambda x: gtao.GTAO(radius=x(0.9), falloff=LINEAR, fetch="linear")),
        ("radius_multiplier", lambda x: gtao.GTAO(radius_multiplier=x(1.5))),
        (
            "radius_multiplier",
            lambda x: gtao.GTAO(radius=0.9, radius_multiplier=x(1.5), falloff=LINEAR, fetch="linear"),
        ),
        (
            "thin_occluder_compensation",
            lambda x: gtao.GTAO(radius=0.8, falloff=gtao.SampleCut(end=0.7), thin_occluder_compensation=x(0.3)),
        ),
        (
            "thin_occluder_compensation",
            lambda x: gtao.GTAO(radius=0.8, falloff=gtao.NoCut(), thin_occluder_compensation=x(0.3)),
        ),
        ("min_step_px", lambda x: gtao.GTAO(radius=0.8, fetch="linear", step_law="beyond", min_step_px=x(1.2))),
    ],
)
def test_what_changes_nothing_says_so(option, method):
    g = gtao.GBuffer(DEPTH, NORMALS, CAMERA)
    with pytest.raises(gtao.ConfigError, match=f"{option} of this method has no derivative"):
        gtao.ambient_occlusion(g, method(number))
    # The same without a gradient is an ordinary method.
    assert np.isfinite(gtao.ambient_occlusion(g, method(float)).visibility.numpy()).all()


@pytest.mark.parametrize("precision", ["TensorXf", "TensorXf64"])
@pytest.mark.parametrize("of_depth", ["drjit.llvm.ad", "drjit.llvm"])
def test_normals_keep_their_gradient_whatever_the_type_of_the_depth(precision, of_depth):
    def gradient(depth_type):
        normals = drjit_ad.TensorXf64(NORMALS)
        dr.enable_grad(normals)
        g = gtao.GBuffer(depth_type(DEPTH), normals, CAMERA)
        dr.backward(dr.sum(gtao.ambient_occlusion(g, gtao.GTAO(radius=0.8)).visibility.array))
        return dr.grad(normals).numpy()

    expected = gradient(drjit_ad.TensorXf64)
    assert np.abs(expected).max() > 0.1
    module = pytest.importorskip(of_depth, reason=f"no module {of_depth}")
    # Horizons of a depth in single precision, whose winners are the same ones here.
    np.testing.assert_allclose(gradient(getattr(module, precision)), expected, atol=1e-4)


def test_suspended_gradients_and_what_is_no_loss_are_refused_in_words():
    g = gtao.GBuffer(DEPTH, NORMALS, CAMERA)
    with dr.suspend_grad(), pytest.raises(gtao.ConfigError, match="suspended"):
        gtao.value_and_gradient(lambda v: v * v, g)
    with pytest.raises(gtao.ConfigError, match="function of the visibility"):
        gtao.value_and_gradient(3, g)
    with pytest.raises(gtao.ShapeError, match="NoneType"):
        gtao.value_and_gradient(lambda v: None, g)
