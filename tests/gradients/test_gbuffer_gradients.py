"""What a frame derives from its depth, normals and camera, against differences: all of it in double precision."""

import drjit as dr
import numpy as np
import pytest
from drjit.llvm.ad import Float, Float64, TensorXf64
from oracles.gradients import derivative

import gtao
from gtao.kernels import pyramid

HEIGHT, WIDTH = 14, 17
LEVELS = pyramid.Table.of(WIDTH, HEIGHT, 3)
NUMBERS = {"fx": 15.0, "fy": 13.0, "cx": 8.3, "cy": 6.1}
RNG = np.random.default_rng(3)


def depth():
    """Noise with a step and a hole: every side of a derived normal is the better one somewhere."""
    z = 2 + 0.3 * RNG.random((HEIGHT, WIDTH))
    z[:, 12:] *= 1.5
    z[4:6, 7:9] = np.inf
    return z


def normals():
    n = RNG.normal(size=(HEIGHT, WIDTH, 3)) + np.array([0, 0, 2])
    return n / np.linalg.norm(n, axis=-1, keepdims=True)


Z, N = depth(), normals()
SURFACE = np.argwhere(np.isfinite(Z))
INPUTS = {"view_z": Z, "normal_v": N, **NUMBERS}
QUANTITIES = {
    "position": lambda g: g.position_v.array,
    "normal": lambda g: g.normal_v.array,
    "affine": lambda g: g.affine_field(),
    **{name: lambda g, name=name: g.depth_pyramid(LEVELS, name, 0.1, 0.4) for name in pyramid.FILTERS},
}


def frame(kind, values, derived=False):
    n, numbers = values["normal_v"], {k: values[k] for k in NUMBERS}
    if kind == "perspective":
        camera = gtao.PerspectiveCamera(WIDTH, HEIGHT, **numbers)
    else:
        view_width, view_height = numbers.pop("fx"), numbers.pop("fy")
        camera = gtao.OrthographicCamera(WIDTH, HEIGHT, view_height, view_width=view_width, **numbers)
    return gtao.GBuffer(values["view_z"], None if derived else n, camera)


def weighted(flat):
    """A weighted sum; values of the background are infinite in some buffers."""
    w = np.random.default_rng(5).normal(size=dr.width(flat))
    return dr.sum(dr.select(dr.isfinite(flat), flat, 0) * Float64(w))


def attached(values):
    result = {k: TensorXf64(v) if np.ndim(v) else dr.opaque(Float64, v) for k, v in values.items()}
    dr.enable_grad(*result.values())
    return result


def differences(value, name, index=None):
    """Derivative of a function of the inputs with respect to one of them."""

    def moved(t):
        if index is None:
            return value(INPUTS | {name: INPUTS[name] + t})
        array = INPUTS[name].copy()
        array[index] += t
        return value(INPUTS | {name: array})

    found = derivative(moved)
    assert found.resolved
    return found


def check(kind, quantity, derived, names):
    x = attached(INPUTS)
    dr.backward(weighted(quantity(frame(kind, x, derived))))
    gradients = {name: dr.grad(x[name]).numpy() for name in names}

    def value(values):
        return weighted(quantity(frame(kind, values, derived))).numpy()[0]

    for name in names:
        picks = RNG.permutation(SURFACE)[:20] if np.ndim(INPUTS[name]) else [None]
        for pick in picks:
            index = pick if pick is None or name == "view_z" else (*pick, RNG.integers(3))
            index = None if index is None else tuple(index)
            found = differences(value, name, index)
            gradient = gradients[name][0 if index is None else index]
            assert found.agrees(gradient), (name, index, gradient, found.value)
    return gradients


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
@pytest.mark.parametrize("name", QUANTITIES)
def test_what_is_derived_from_depth(kind, name):
    gradients = check(
        kind, QUANTITIES[name], True, ["view_z", "fx", "cy"] if name in ("position", "normal") else ["view_z"]
    )
    assert (gradients["view_z"][~np.isfinite(Z)] == 0).all()


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
def test_given_normals_are_differentiated_through_their_normalisation(kind):
    """Also where they come as unit vectors and keep their bits."""
    gradient = check(kind, QUANTITIES["normal"], False, ["normal_v"])["normal_v"]
    assert (gradient[~np.isfinite(Z)] == 0).all()
    along = np.abs(np.sum(gradient * N, axis=-1)).max()
    # Moving a normal along itself changes nothing.
    assert along < 1e-14 * np.abs(gradient).max() * WIDTH


@pytest.mark.parametrize(
    ("name", "derived", "only"),
    [(name, True, "view_z") for name in ("position", "normal", "affine", "weighted")]
    + [("normal", False, "normal_v"), ("normal", True, "fx"), ("position", True, "fx")],
)
def test_a_frame_serves_more_than_one_backward_pass(name, derived, only):
    """A pass consumes the graph that it walks, which must not be one that the frame keeps."""
    x = attached({only: INPUTS[only]})
    g = frame("perspective", INPUTS | x, derived)
    passes = []
    for _ in range(2):
        dr.clear_grad(x)
        dr.backward(weighted(QUANTITIES[name](g)))
        passes.append(dr.grad(x[only]).numpy())
    assert passes[0].any()
    # Two threads add in any order.
    np.testing.assert_allclose(*passes, rtol=1e-12)


def test_numbers_in_single_precision_reach_frames_in_double():
    values = {"view_z": Z, "normal_v": None, **NUMBERS}
    fx = dr.opaque(Float, NUMBERS["fx"])
    dr.enable_grad(fx)
    dr.backward(weighted(frame("perspective", values | {"fx": fx}, True).normal_v.array))
    found = differences(lambda v: weighted(frame("perspective", v, True).normal_v.array).numpy()[0], "fx")
    assert float(dr.grad(fx)[0]) == pytest.approx(float(found.value), rel=1e-6)


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
def test_forward_mode_is_the_transpose(kind):
    """⟨J v, w⟩ = ⟨v, Jᵀ w⟩ through derived normals, whose own depth and neighbours' are two variables."""
    direction = RNG.normal(size=Z.shape)
    x = attached(INPUTS)
    dr.backward(weighted(frame(kind, x, True).normal_v.array))
    backward = np.sum(dr.grad(x["view_z"]).numpy() * direction)
    x = attached(INPUTS)
    total = weighted(frame(kind, x, True).normal_v.array)
    dr.set_grad(x["view_z"], TensorXf64(direction))
    dr.forward_to(total)
    assert float(dr.grad(total)[0]) == pytest.approx(backward, rel=1e-12)


def test_gradients_may_be_enabled_on_the_frame_itself():
    """Also after its arrays have been looked at, which keeps them."""
    w = TensorXf64(np.random.default_rng(8).normal(size=Z.shape))
    method = gtao.GTAO(radius=0.5, n_slices=2, n_steps=4)

    def gradients(late):
        results = []
        for key, derived in (("view_z", True), ("view_z", False), ("normal_v", False)):
            x = {key: TensorXf64(INPUTS[key])}
            if not late:
                dr.enable_grad(x[key])
            g = frame("perspective", INPUTS | x, derived)
            leaf = x[key]
            if late:
                dr.eval(g.normal_v, g.position_v, g.affine_field())
                assert not g.is_attached
                leaf = getattr(g, key)
                dr.enable_grad(leaf)
            assert g.is_attached
            total = dr.sum(gtao.ambient_occlusion(g, method).visibility * w, axis=None)
            total += dr.sum(g.position_v, axis=None) + dr.sum(dr.square(g.normal_v[..., 0]), axis=None)
            dr.backward(total)
            results.append(dr.grad(leaf).numpy())
        return results

    for early, late in zip(gradients(False), gradients(True), strict=True):
        assert early.any()
        # A normal that is enabled after it was normalised is not normalised again in the frame's own array.
        difference = early - late
        if difference.ndim == 3:
            difference -= N * np.sum(difference * N, axis=-1, keepdims=True)
        np.testing.assert_allclose(difference, 0, atol=1e-9 * np.abs(early).max())


@pytest.mark.parametrize("method", [gtao.VisibilityBitmask(radius=0.5), gtao.HeightfieldHorizon(radius=0.5)])
def test_methods_without_gradients_refuse_frames_that_carry_some(method):
    g = gtao.GBuffer(np.float32(Z), np.float32(N), gtao.PerspectiveCamera(WIDTH, HEIGHT, **NUMBERS))
    gtao.ambient_occlusion(g, method)
    dr.enable_grad(g.normal_v)
    with pytest.raises(gtao.ConfigError, match="gradient"):
        gtao.ambient_occlusion(g, method)
