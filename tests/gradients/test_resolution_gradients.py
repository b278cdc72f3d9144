"""Gradients through ``gtao.downsample`` and ``gtao.upsample``, against differences of the same image in float64.

What they compute is held to loops written from the definitions in ``tests/kernels/test_resolution_kernels.py``.
"""

import drjit as dr
import numpy as np
import pytest
from gradients._functions import check, check_single_precision, native, pullback, pushforward, unit_moves
from oracles import fields

import gtao

HEIGHT, WIDTH = 11, 14
CAMERA = {"fx": 12.0, "fy": 10.5, "cx": 6.2, "cy": 5.9}
SMALL = (6, 7)


def frame():
    """Bumps with noise, a step and holes; unit normals that are a little off, as bump maps have them."""
    rng = np.random.default_rng(7)
    field = fields.in_perspective(fields.gaussians(0.3, 0.4, seed=4), size=WIDTH, slope=(0.4, -0.2))
    z = field.view_z[:HEIGHT] * (1 + 0.004 * rng.random((HEIGHT, WIDTH)))
    z[:, 8:] *= 1.15
    z[2:4, 2:5] = z[-1, -1] = np.inf
    n = field.normal_v[:HEIGHT] + 0.05 * rng.standard_normal((HEIGHT, WIDTH, 3))
    return {
        "visibility": rng.random(SMALL),
        "view_z": z,
        "normal_v": n / np.linalg.norm(n, axis=-1, keepdims=True),
    }


FRAME = frame()
SURFACE = np.isfinite(FRAME["view_z"])
GEOMETRY = ("view_z", "normal_v", *CAMERA)
# How a method is made, its options, and what else than the image it depends on.
METHODS = {
    "bilinear": (gtao.BilinearUpsample, {}, ()),
    "nearest depth": (lambda: gtao.NearestDepthUpsample(threshold=0.05), {}, ()),
    "bilateral": (gtao.BilateralUpsample, {"threshold": 0.05}, ("view_z",)),
    "planes": (gtao.PlaneAwareUpsample, {"tolerance": 0.3, "angle": 0.4}, GEOMETRY),
    # So strict that much is looked for in the wider footprint.
    "strict planes": (gtao.PlaneAwareUpsample, {"tolerance": 0.05, "angle": 0.1}, GEOMETRY),
}
CASES = [(name, k) for name, (_, options, guides) in METHODS.items() for k in ("visibility", *guides, *options)]


def inputs(name):
    return FRAME | CAMERA | METHODS[name][1]


def frame_of(values, parallel=False):
    if parallel:
        camera = gtao.OrthographicCamera(WIDTH, HEIGHT, values["view_height"], cx=values["cx"], cy=values["cy"])
    else:
        camera = gtao.PerspectiveCamera(WIDTH, HEIGHT, **{k: values[k] for k in CAMERA})
    return gtao.GBuffer(values["view_z"], values["normal_v"], camera)


def enlarged(name, how=None):
    """The way there and back as a function of everything that it depends on."""
    make, options, _ = METHODS[name]
    how = gtao.Downsample() if how is None else how

    def f(values):
        g = frame_of(values)
        ao = gtao.AmbientOcclusion(visibility=values["visibility"])
        return gtao.upsample(ao, gtao.downsample(g, how), g, make(**{k: values[k] for k in options})).visibility

    return f


def moves_of(name, values):
    if name == "visibility":
        return list(unit_moves(np.ones(SMALL, bool), 24, 3))
    if name in FRAME:
        return list(unit_moves(SURFACE, 24, 3, values["normal_v"] if name == "normal_v" else None))
    return [1.0]


def dense_moves(name, values):
    """Directions that move all pixels: those that no block chooses change nothing alone."""
    rng = np.random.default_rng(6)
    if name not in FRAME:
        return [1.0]
    v = [np.where(SURFACE[..., None], rng.standard_normal((HEIGHT, WIDTH, 3)), 0.0) for _ in range(4)]
    return [np.cross(values["normal_v"], x) for x in v] if name == "normal_v" else [x[..., 0] for x in v]


@pytest.mark.parametrize(("name", "of"), CASES)
def test_both_modes(name, of):
    values = inputs(name)
    check(enlarged(name), values, of, moves_of(of, values))


@pytest.mark.parametrize("choice", ["nearest", "farthest", "checkerboard", "first"])
@pytest.mark.parametrize("of", GEOMETRY)
def test_the_smaller_frame(choice, of):
    """Its depth, finite where a block is background too."""

    def f(values):
        small = gtao.downsample(frame_of(values), gtao.Downsample(choice=choice))
        return type(small.view_z)(dr.select(small.mask.array, small.view_z.array, 0), small.shape)

    values = {k: FRAME[k] for k in ("view_z", "normal_v")} | CAMERA
    check(f, values, of, dense_moves(of, values))


@pytest.mark.parametrize("of", ["view_z", "normal_v", "view_height"])
def test_the_smaller_frame_in_parallel_projection(of):
    values = {k: FRAME[k] for k in ("view_z", "normal_v")} | {"view_height": 6.0, "cx": 6.2, "cy": 5.9}

    def f(values):
        small = gtao.downsample(frame_of(values, parallel=True), gtao.Downsample())
        return type(small.view_z)(dr.select(small.mask.array, small.view_z.array, 0), small.shape)

    check(f, values, of, dense_moves(of, values))


def test_normals_of_the_smaller_frame():
    def f(values):
        return gtao.downsample(frame_of(values), gtao.Downsample()).normal_v

    values = {k: FRAME[k] for k in ("view_z", "normal_v")} | CAMERA
    check(f, values, "normal_v", dense_moves("normal_v", values))


@pytest.mark.parametrize("place", ["texel", "centre"])
@pytest.mark.parametrize("name", METHODS)
def test_modes_are_each_others_transpose(name, place):
    """⟨J v, w⟩ = ⟨v, Jᵀ w⟩ with everything attached at once, and the background out of it."""
    values, rng = inputs(name), np.random.default_rng(1)
    names = ("visibility", *METHODS[name][2], *METHODS[name][1])
    v = {k: rng.standard_normal(np.shape(values[k])) for k in names}
    w = rng.standard_normal((HEIGHT, WIDTH))
    f = enlarged(name, gtao.Downsample(factor=2, place=place, choice="checkerboard"))
    gradient = pullback(f, values, w, names)
    for k in ("view_z", "normal_v"):
        if k in v:
            assert (gradient[k][~SURFACE] == 0).all()
            v[k][~SURFACE] = 0
    forward = np.sum(pushforward(f, values, v) * w)
    # Sums of some thousand products of order 1 in double precision.
    assert forward == pytest.approx(sum(np.sum(gradient[k] * v[k]) for k in names), rel=1e-9)


def test_directions_carry_gradients_too():
    rng = np.random.default_rng(4)

    def f(values):
        g = frame_of(values)
        ao = gtao.AmbientOcclusion(visibility=native(FRAME["visibility"]), mean_direction=values["bent"])
        return gtao.upsample(ao, gtao.downsample(g, gtao.Downsample()), g).mean_direction

    values = {k: FRAME[k] for k in ("view_z", "normal_v")} | CAMERA | {"bent": rng.standard_normal((*SMALL, 3))}
    check(f, values, "view_z", unit_moves(SURFACE, 10, 5))
    moves = [np.eye(1, values["bent"].size, k).reshape(values["bent"].shape) for k in (0, 40, 77)]
    check(f, values, "bent", moves)


@pytest.mark.parametrize("name", METHODS)
def test_single_precision(name):
    names = ("visibility", *METHODS[name][2], *METHODS[name][1])
    # Depths of 4 are known to 2e-7, tolerances are 0.03 of them and less, and gradients are steep there.
    check_single_precision(enlarged(name), inputs(name), names, (HEIGHT, WIDTH), 0.95, 5e-3)


def kernels_of_a_step():
    """Backward kernels through the whole way, the estimate aside."""
    g = frame_of({k: native(v, single=True) for k, v in (FRAME | CAMERA).items()}).attached()
    visibility = native(FRAME["visibility"], single=True)
    dr.enable_grad(visibility)
    result = gtao.upsample(gtao.AmbientOcclusion(visibility=visibility), gtao.downsample(g, gtao.Downsample()), g)
    dr.eval(result.visibility)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        dr.backward(dr.sum(result.visibility.array))
        dr.eval(dr.grad(visibility), dr.grad(g.view_z))
        dr.sync_thread()
        return [k for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT]


def test_few_kernels_backward():
    # One each way for the stage, and what brings their gradients together.
    assert len(kernels_of_a_step()) <= 6
