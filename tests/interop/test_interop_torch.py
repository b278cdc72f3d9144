"""Estimators on PyTorch tensors: values, gradients in both modes, and what autograd may do to a function."""

import threading
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

torch = pytest.importorskip("torch", reason="PyTorch is not installed: pip install 'gtao[torch]'")

from gtao.interop import _torch_autograd  # noqa: E402  (skips come first)
from gtao.interop import torch as gt  # noqa: E402  (skips come first)

# PyTorch's forward mode still compiles some of its own derivatives in the way that it calls deprecated.
pytestmark = pytest.mark.filterwarnings("ignore:`torch.jit.script` is deprecated:DeprecationWarning")


@pytest.fixture(autouse=True)
def _one_thread():
    with one_thread():
        yield


def leaf(values, dtype=torch.float64):
    return torch.tensor(np.asarray(values), dtype=dtype, requires_grad=True)


def fixed(values, dtype=torch.float64):
    return torch.tensor(np.asarray(values), dtype=dtype)


def frame(dtype=torch.float64):
    return leaf(DEPTH, dtype), leaf(NORMALS, dtype)


def unit(directions):
    return torch.nn.functional.normalize(directions, dim=-1)


def gradcheck(function, *inputs):
    """Both modes against central differences in double precision, and reverse mode twice on one graph."""
    # The fast mode compares along random directions of all inputs and results, which no wrong entry survives.
    return torch.autograd.gradcheck(function, inputs, check_forward_ad=True, fast_mode=True)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64], ids=str)
@pytest.mark.parametrize("method", [METHOD, SOFT], ids=["exact cut", "falloff"])
def test_values_and_gradients_are_those_of_drjit(method, dtype):
    z, n = frame(dtype)
    visibility = gt.ambient_occlusion(z, n, CAMERA, method)
    visibility.backward(fixed(WEIGHTS, dtype))
    expected = drjit_gradients(method, single=dtype == torch.float32)
    for found, value in zip((visibility.detach(), z.grad, n.grad), expected, strict=True):
        assert found.dtype == dtype
        assert same(found.numpy(), value)


@pytest.mark.parametrize("method", [METHOD, SOFT], ids=["exact cut", "falloff"])
def test_gradients_of_depth_and_normals_are_those_of_differences(method):
    def visibility(z, directions):
        return gt.ambient_occlusion(z, unit(directions), CAMERA, method)

    assert gradcheck(visibility, leaf(DEPTH), leaf(DIRECTIONS))


def test_gradients_flow_through_normals_that_are_derived():
    assert gradcheck(lambda z: gt.ambient_occlusion(z, None, CAMERA, METHOD), leaf(DEPTH))


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
        parameters = dict(zip(values, numbers, strict=True))
        return gt.ambient_occlusion(fixed(DEPTH), fixed(NORMALS), CAMERA, method, parameters=parameters)

    assert gradcheck(visibility, *map(leaf, values.values()))
    changed = replace(method, **{name: value for name, value in values.items() if "." not in name})
    if method is METHOD:
        camera = replace(CAMERA, fx=values["camera.fx"], cy=values["camera.cy"])
        expected = gt.ambient_occlusion(fixed(DEPTH), fixed(NORMALS), camera, changed)
        # The parameters are rounded to nothing less than double precision on both ways.
        assert torch.allclose(visibility(*map(fixed, values.values())), expected, rtol=0, atol=1e-14)


def test_parameters_that_do_not_exist_are_named():
    with pytest.raises(gtao.ConfigError, match=r"method has no radus; choose from radius"):
        gt.ambient_occlusion(*frame(), CAMERA, METHOD, parameters={"radus": fixed(1.0)})
    with pytest.raises(gtao.ConfigError, match=r"method\.falloff has no end; it is None"):
        gt.ambient_occlusion(*frame(), CAMERA, METHOD, parameters={"falloff.end": fixed(1.0)})
    with pytest.raises(gtao.ConfigError, match=r"camera has no fov"):
        gt.ambient_occlusion(*frame(), CAMERA, METHOD, parameters={"camera.fov": fixed(1.0)})


def test_gradients_of_multibounce_are_those_of_differences():
    assert gradcheck(gt.multibounce, leaf(VISIBILITY), leaf(ALBEDO))
    assert gt.multibounce(fixed(VISIBILITY), 0.5, gtao.SPHERE).shape == VISIBILITY.shape


def test_gradients_of_specular_occlusion_are_those_of_differences():
    occlusion = gtao.GTAO(radius=1.0, n_slices=2, n_steps=4, bent_normal=True)
    roughness, f0 = np.full(CAMERA.shape, 0.9), ALBEDO

    def reflected(z, directions, roughness, f0):
        normals = directions / directions.norm(dim=-1, keepdim=True)
        return gt.specular_occlusion(z, normals, CAMERA, roughness, f0, occlusion)

    nearest = np.where(np.isinf(DEPTH), 4.0, DEPTH)
    assert gradcheck(reflected, *map(leaf, (nearest, DIRECTIONS, roughness, f0)))
    g = gtao.GBuffer(DEPTH, NORMALS, CAMERA)
    for f0, shape in ((0.04, CAMERA.shape), (fixed(ALBEDO[0, 0]), (*CAMERA.shape, 3))):
        found = gt.specular_occlusion(*frame(), CAMERA, 0.5, f0)
        ao = gtao.ambient_occlusion(g, gtao.GTAO(weighting="uniform", bent_normal=True))
        expected = gtao.specular_occlusion(ao, g, 0.5, np.asarray(f0) if shape[2:] else f0)
        assert found.shape == shape
        assert np.array_equal(found.detach().numpy(), expected.numpy())


def test_coefficients_are_differentiated_through_a_function_of_ones_own():
    def visibility(v, rho, *coefficients):
        return gtao.multibounce(v, rho, replace(gtao.JIMENEZ2016, coefficients=coefficients))

    numbers = map(leaf, gtao.JIMENEZ2016.coefficients)
    assert gradcheck(gt.wrap(visibility), fixed(VISIBILITY), fixed(ALBEDO), *numbers)


def test_even_footprints_change_sides_from_frame_to_frame():
    g = gtao.GBuffer(DEPTH, NORMALS, CAMERA)
    images = []
    for k in range(2):
        filtered = gt.denoise(
            fixed(VISIBILITY), fixed(DEPTH), fixed(NORMALS), CAMERA, gtao.SpatialFilter(), frame_index=k
        )
        expected = gtao.denoise(
            gtao.AmbientOcclusion(visibility=g.types.Tensor(VISIBILITY)), g, gtao.SpatialFilter(), frame_index=k
        )
        images.append(np.asarray(filtered))
        np.testing.assert_array_equal(images[-1], expected.visibility.numpy())
    assert (images[0] != images[1]).any()


@pytest.mark.parametrize("spatial", [gtao.SpatialFilter(), gtao.PlaneAwareFilter()], ids=lambda f: type(f).__name__)
def test_gradients_of_filters_are_those_of_differences(spatial):
    def filtered(v, z, directions):
        return gt.denoise(v, z, unit(directions), CAMERA, spatial)

    assert gradcheck(filtered, leaf(VISIBILITY), leaf(DEPTH), leaf(DIRECTIONS))


def test_what_has_no_derivative_says_so_only_where_it_is_asked_for():
    bitmask = gtao.VisibilityBitmask(radius=1.0)
    assert gt.ambient_occlusion(fixed(DEPTH), fixed(NORMALS), CAMERA, bitmask).min() < 1
    with pytest.raises(gtao.ConfigError, match="no gradient"):
        gt.ambient_occlusion(leaf(DEPTH), fixed(NORMALS), CAMERA, bitmask)


def test_only_what_needs_gradients_is_attached(monkeypatch):
    attached = []

    class Watched(_torch_autograd.Call):
        def __init__(self, function, arguments, wanted):
            attached.append(list(wanted))
            super().__init__(function, arguments, wanted)

    monkeypatch.setattr(_torch_autograd, "Call", Watched)
    z, n = frame()
    assert gt.ambient_occlusion(z, n.detach(), CAMERA, METHOD).requires_grad
    with torch.no_grad():
        assert not gt.ambient_occlusion(z, n, CAMERA, METHOD).requires_grad
    with torch.inference_mode():
        gt.ambient_occlusion(z, n, CAMERA, METHOD)
    assert not gt.ambient_occlusion(z.detach(), n.detach(), CAMERA, METHOD).requires_grad
    assert attached == [[True, False], [False, False], [False, False], [False, False]]


def test_a_retained_graph_gives_the_same_gradient_again():
    z, n = frame()
    visibility = gt.ambient_occlusion(z, n, CAMERA, METHOD)
    first = torch.autograd.grad(visibility, z, fixed(WEIGHTS), retain_graph=True)[0]
    twice = torch.autograd.grad(visibility, z, 2 * fixed(WEIGHTS), retain_graph=True)[0]
    again = torch.autograd.grad(visibility, z, fixed(WEIGHTS))[0]
    assert first.abs().max() > 0.01
    assert torch.equal(first, again)
    assert torch.equal(2 * first, twice)


def test_a_tensor_in_two_roles_and_a_result_used_twice():
    x = leaf(VISIBILITY)
    y = gt.wrap(lambda a, b: a * dr.sin(b))(x, x)
    (y + y * y).sum().backward()
    s, c, v = np.sin(VISIBILITY), np.cos(VISIBILITY), VISIBILITY
    assert np.allclose(x.grad, (1 + 2 * v * s) * (s + v * c), rtol=1e-12)


def test_later_changes_of_the_arguments_reach_neither_result_nor_gradient():
    expected, gradient, _ = drjit_gradients()

    def visibility(z):
        return gt.ambient_occlusion(z, fixed(NORMALS), CAMERA, METHOD)

    cases = [
        (visibility, DEPTH, expected, gradient),
        # What this one multiplies gradients by is not computed before they are asked for.
        (gt.wrap(lambda x: x * x), VISIBILITY, VISIBILITY**2, 2 * VISIBILITY * WEIGHTS),
    ]
    for function, values, expected, gradient in cases:
        x = leaf(values)
        moved = x * 1
        result = function(moved)
        with torch.no_grad():
            moved.fill_(1.0)
        result.backward(fixed(WEIGHTS))
        assert same(result.detach(), expected)
        assert np.allclose(x.grad, gradient, rtol=1e-14, atol=0)


def test_changes_of_a_result_do_not_reach_the_function():
    x = leaf(VISIBILITY)
    for function in (lambda a: a, lambda a: dr.exp(a)):
        y = gt.wrap(function)(x)
        expected = torch.autograd.grad(y.sum(), x, retain_graph=True)[0]
        with torch.no_grad():
            y.fill_(7.0)
        assert torch.equal(torch.autograd.grad(y.sum(), x)[0], expected)
    assert np.array_equal(x.detach(), VISIBILITY)


def test_strided_tensors_and_parameters():
    z = torch.nn.Parameter(fixed(DEPTH.T.copy()))
    n = fixed(np.stack([NORMALS, NORMALS], axis=-1))[..., 0]
    gt.ambient_occlusion(z.t(), n, CAMERA, METHOD).backward(fixed(WEIGHTS))
    assert same(z.grad.t(), drjit_gradients()[1])


@pytest.mark.parametrize("dtype", [torch.float16, torch.bfloat16, torch.int32], ids=str)
def test_other_numbers_are_computed_with_in_single_precision(dtype):
    z = torch.full(CAMERA.shape, 4, dtype=dtype)
    z[2:4, 2:5] = 3
    expected = gt.ambient_occlusion(z.float(), None, CAMERA, METHOD)
    if dtype.is_floating_point:
        z.requires_grad_()
    visibility = gt.ambient_occlusion(z, None, CAMERA, METHOD)
    assert visibility.dtype == torch.float32
    assert torch.equal(visibility, expected)
    if dtype.is_floating_point:
        visibility.sum().backward()
        assert z.grad.dtype == dtype
        assert z.grad.abs().max() > 0


def test_images_decide_about_precision_and_numbers_follow():
    radius = leaf(1.0)
    z, n = fixed(DEPTH, torch.float32), fixed(NORMALS)
    visibility = gt.ambient_occlusion(z, n.float(), CAMERA, METHOD, parameters={"radius": radius})
    visibility.sum().backward()
    assert visibility.dtype == torch.float32
    assert radius.grad.dtype == torch.float64
    assert gt.ambient_occlusion(z, n, CAMERA, METHOD).dtype == torch.float64


def test_tensors_that_are_no_real_images_are_refused():
    z, n = frame()
    for wrong in (z.to(torch.complex64), z > 4, z.detach().to_sparse()):
        with pytest.raises(gtao.ShapeError, match="dense and hold real numbers, got torch"):
            gt.ambient_occlusion(wrong, n, CAMERA, METHOD)
    with pytest.raises(gtao.ShapeError, match="one device, got cpu, meta"):
        gt.ambient_occlusion(z.to("meta"), n, CAMERA, METHOD)
    with pytest.raises(gtao.ShapeError, match=r"view_z must have shape \(6, 8\), got \(5, 8\)"):
        gt.ambient_occlusion(z[1:], n, CAMERA, METHOD)
    with pytest.raises(gtao.ShapeError, match="none of the arguments is a torch"):
        gt.ambient_occlusion(DEPTH, None, CAMERA, METHOD)
    with pytest.raises(gtao.ShapeError, match=r"got AmbientOcclusion; return for example its \.visibility"):
        gt.wrap(lambda a: gtao.ambient_occlusion(gtao.GBuffer(a, None, CAMERA), METHOD))(z)


def test_frames_need_not_be_looked_at():
    broken = fixed(np.where(np.isinf(DEPTH), -1.0, DEPTH))
    with pytest.raises(gtao.ShapeError, match="positive"):
        gt.ambient_occlusion(broken, fixed(NORMALS), CAMERA, METHOD)
    assert gt.ambient_occlusion(broken, fixed(NORMALS), CAMERA, METHOD, validate=False).shape == CAMERA.shape


def test_results_of_all_shapes():
    x, k = leaf(VISIBILITY), leaf(3.0)
    pair = gt.wrap(lambda a, *, factor: (a * factor, dr.mean(a, axis=None), a.array))(x, factor=k)
    assert [y.shape for y in pair] == [VISIBILITY.shape, (), (VISIBILITY.size,)]
    (pair[0].sum() + pair[1] + pair[2].sum()).backward()
    assert k.grad.shape == ()
    assert k.grad.item() == pytest.approx(VISIBILITY.sum(), rel=1e-12)
    assert np.allclose(x.grad, 3 + 1 / VISIBILITY.size + 1, rtol=1e-12)


def test_what_no_loss_looks_at_has_gradient_zero():
    x, y = leaf(VISIBILITY), leaf(ALBEDO)
    a, b = gt.wrap(lambda p, q: (p * p, q * 2))(x, y)
    a.sum().backward()
    assert np.allclose(x.grad, 2 * VISIBILITY, rtol=1e-12)
    assert torch.equal(y.grad, torch.zeros_like(y))
    with torch.autograd.forward_ad.dual_level():
        dual = torch.autograd.forward_ad.make_dual(x.detach(), torch.ones_like(x))
        a, b = gt.wrap(lambda p, q: (p * p, q * 2))(dual, y)
        tangents = [torch.autograd.forward_ad.unpack_dual(t).tangent.detach() for t in (a, b)]
    assert np.allclose(tangents[0], 2 * VISIBILITY, rtol=1e-12)
    assert torch.equal(tangents[1], torch.zeros_like(y))


def test_second_derivatives_are_refused_instead_of_left_out():
    x = leaf(VISIBILITY)
    loss = gt.wrap(lambda a: a * a)(x).sum() + (x**3).sum()
    (gradient,) = torch.autograd.grad(loss, x, create_graph=True)
    assert np.allclose(gradient.detach(), 2 * VISIBILITY + 3 * VISIBILITY**2, rtol=1e-12)
    with pytest.raises(gtao.ConfigError, match="no second derivatives"):
        gradient.sum().backward()


def test_functional_transforms():
    def loss(z):
        return (gt.ambient_occlusion(z, fixed(NORMALS), CAMERA, METHOD) * fixed(WEIGHTS)).sum()

    z, direction = fixed(DEPTH), torch.ones_like(fixed(DEPTH))
    gradient = torch.func.grad(loss)(z)
    assert same(gradient, drjit_gradients()[1])
    assert torch.equal(torch.func.vjp(loss, z)[1](torch.tensor(1.0).double())[0], gradient)
    _, tangent = torch.func.jvp(loss, (z,), (direction,))
    # The two modes add the same terms in another order.
    assert float(tangent) == pytest.approx(float((gradient * direction).sum()), rel=1e-12)
    with pytest.raises(gtao.ConfigError, match="no second derivatives"):
        torch.func.grad(lambda z: torch.func.grad(loss)(z).sum())(z)
    with pytest.raises(RuntimeError, match="vmap"):
        torch.func.vmap(loss)(torch.stack([z, z]))


def test_reverse_mode_in_another_thread():
    z, n = frame()
    visibility, found = gt.ambient_occlusion(z, n, CAMERA, SOFT), []
    worker = threading.Thread(target=lambda: found.append(torch.autograd.grad(visibility, z, fixed(WEIGHTS))[0]))
    worker.start()
    worker.join()
    assert same(found[0], drjit_gradients(SOFT)[1])


def test_several_threads_at_once():
    expected, found = drjit_gradients()[1], {}

    def work(i):
        z = leaf(DEPTH)
        gt.ambient_occlusion(z, fixed(NORMALS), CAMERA, METHOD).backward((i + 1) * fixed(WEIGHTS))
        found[i] = z.grad / (i + 1)

    workers = [threading.Thread(target=work, args=(i,)) for i in range(4)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    # Factors other than powers of two are rounded.
    assert all(np.allclose(found[i], expected, rtol=1e-12, atol=1e-14) for i in range(4))


@pytest.mark.cuda
def test_tensors_on_the_gpu_stay_there():
    if not torch.cuda.is_available():
        pytest.skip("this PyTorch has no CUDA")
    z, n = (values.detach().cuda().requires_grad_() for values in frame())
    radius = leaf(1.0)  # on the host, as numbers may be
    visibility = gt.ambient_occlusion(z, n, CAMERA, METHOD, parameters={"radius": radius})
    visibility.backward(fixed(WEIGHTS).cuda())
    assert visibility.is_cuda
    assert z.grad.is_cuda
    assert radius.grad.device.type == "cpu"
    for found, expected in zip((visibility.detach(), z.grad, n.grad), drjit_gradients(), strict=True):
        assert same(found.cpu(), expected)
    host = fixed(DEPTH)
    assert same(gt.ambient_occlusion(host, fixed(NORMALS), CAMERA, METHOD), drjit_gradients()[0])


def test_a_radius_is_recovered_by_an_optimiser_of_pytorch():
    z, n = (fixed(values, torch.float32) for values in (DEPTH, NORMALS))
    target = gt.ambient_occlusion(z, n, CAMERA, METHOD)
    logarithm = leaf(np.log(0.7), torch.float32)
    optimiser = torch.optim.Adam([logarithm], lr=0.02, betas=(0.5, 0.9))
    for _ in range(60):
        optimiser.zero_grad()
        radius = logarithm.exp()
        found = gt.ambient_occlusion(z, n, CAMERA, METHOD, parameters={"radius": radius}, validate=False)
        ((found - target) ** 2).sum().backward()
        optimiser.step()
    # Adam's steps of 2 % have died down to 1e-5 by then; with a wrong gradient they would not.
    assert float(logarithm.detach().exp()) == pytest.approx(1.0, abs=1e-3)
