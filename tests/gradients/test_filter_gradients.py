"""Gradients through ``gtao.denoise`` and through pipelines, against differences of the same image in float64.

What the filters compute is held to loops written from the definitions in ``tests/kernels/test_filters.py``.
"""

import drjit as dr
import numpy as np
import pytest
from gradients._functions import check, check_single_precision, native, pullback, pushforward, unit_moves
from oracles import fields

import gtao

HEIGHT, WIDTH = 11, 13
CAMERA = {"fx": 12.0, "fy": 10.5, "cx": 6.2, "cy": 5.9}


def frame():
    """Bumps with noise, a step and holes; unit normals that are a little off, as bump maps have them."""
    rng = np.random.default_rng(7)
    field = fields.in_perspective(fields.gaussians(0.3, 0.4, seed=4), size=WIDTH, slope=(0.4, -0.2))
    z = field.view_z[:HEIGHT] * (1 + 0.004 * rng.random((HEIGHT, WIDTH)))
    z[:, 8:] *= 1.15
    z[2:4, 3] = z[-1, -1] = np.inf
    n = field.normal_v[:HEIGHT] + 0.02 * rng.standard_normal((HEIGHT, WIDTH, 3))
    return {
        "visibility": rng.random((HEIGHT, WIDTH)),
        "view_z": z,
        "normal_v": n / np.linalg.norm(n, axis=-1, keepdims=True),
    }


FRAME = frame()
SURFACE = np.isfinite(FRAME["view_z"])
PLANES = ("view_z", "normal_v", *CAMERA)
# How a filter is made, its options, and what else than the image it depends on.
EDGES = {"beta": 1.2, "edge_threshold": 0.03, "diagonal_weight": 0.425, "leak_threshold": 2.1, "leak_strength": 0.5}
FILTERS = {
    "edge-aware": (lambda **o: gtao.EdgeAwareFilter(quantised_edges=False, **o), EDGES, ("view_z",)),
    "edge-aware, 3 passes": (
        lambda **o: gtao.EdgeAwareFilter(passes=3, quantised_edges=False, **o),
        EDGES,
        ("view_z",),
    ),
    "bilateral": (gtao.SpatialFilter, {"threshold": 0.1}, ("view_z",)),
    "bilateral, slopes": (lambda **o: gtao.SpatialFilter(derivatives="first", **o), {"threshold": 0.06}, ("view_z",)),
    "bilateral, odd frame": (gtao.SpatialFilter, {"threshold": 0.1}, ("view_z",)),
    "bilateral, planar": (lambda **o: gtao.SpatialFilter(planar=True, **o), {"threshold": 0.06}, ("view_z",)),
    "planes": (gtao.PlaneAwareFilter, {"tolerance": 0.5}, PLANES),
    "planes, mean of 4": (lambda **o: gtao.PlaneAwareFilter(size=4, fit="constant", **o), {"tolerance": 0.7}, PLANES),
}
CASES = [(name, k) for name, (_, options, guides) in FILTERS.items() for k in ("visibility", *guides, *options)]


def inputs(name):
    return FRAME | CAMERA | FILTERS[name][1]


def filtered(name):
    """The filter as a function of everything that it depends on."""
    make, options, _ = FILTERS[name]

    def f(values):
        camera = gtao.PerspectiveCamera(WIDTH, HEIGHT, **{k: values[k] for k in CAMERA})
        g = gtao.GBuffer(values["view_z"], values["normal_v"], camera)
        spatial = make(**{k: values[k] for k in options})
        ao = gtao.AmbientOcclusion(visibility=values["visibility"])
        return gtao.denoise(ao, g, spatial, frame_index=int(name.endswith("odd frame"))).visibility

    return f


@pytest.mark.parametrize(("name", "of"), CASES)
def test_both_modes(name, of):
    values = inputs(name)
    if of in FRAME:
        moves = list(unit_moves(SURFACE, 24, 3, values["normal_v"] if of == "normal_v" else None))
    else:
        moves = [1.0]
    check(filtered(name), values, of, moves)


@pytest.mark.parametrize("name", FILTERS)
def test_modes_are_each_others_transpose(name):
    """⟨J v, w⟩ = ⟨v, Jᵀ w⟩ with everything attached at once, and the background out of it."""
    values, rng = inputs(name), np.random.default_rng(1)
    names = ("visibility", *FILTERS[name][2], *FILTERS[name][1])
    v = {k: rng.standard_normal(np.shape(values[k])) for k in names}
    w = rng.standard_normal((HEIGHT, WIDTH))
    f = filtered(name)
    gradient = pullback(f, values, w, names)
    assert all((gradient[k][~SURFACE] == 0).all() for k in names if k in FRAME)
    for k in ("view_z", "normal_v"):
        if k in v:
            v[k][~SURFACE] = 0
    forward = np.sum(pushforward(f, values, v) * w)
    # Sums of some thousand products of order 1 in double precision.
    assert forward == pytest.approx(sum(np.sum(gradient[k] * v[k]) for k in names), rel=1e-10)


@pytest.mark.parametrize("name", FILTERS)
def test_single_precision(name):
    names = ("visibility", *FILTERS[name][2], *FILTERS[name][1])
    # Depths of 4 are known to 2e-7, and edges are found in differences of 0.03 of them.
    check_single_precision(filtered(name), inputs(name), names, (HEIGHT, WIDTH), 0.98, 2e-3)


def test_options_of_another_precision():
    values = inputs("bilateral")
    threshold = native(0.1, single=True)
    dr.enable_grad(threshold)
    result = filtered("bilateral")({k: native(v) for k, v in values.items()} | {"threshold": threshold})
    dr.backward(dr.sum(result.array))
    want = pullback(filtered("bilateral"), values, np.ones((HEIGHT, WIDTH)), ("threshold",))["threshold"]
    assert dr.grad(threshold)[0] == pytest.approx(want, rel=1e-6)


def test_directions_carry_gradients_too():
    rng = np.random.default_rng(4)
    bent = rng.standard_normal((HEIGHT, WIDTH, 3)) + np.array([0, 0, 1.5])

    def f(values):
        camera = gtao.PerspectiveCamera(WIDTH, HEIGHT, **CAMERA)
        g = gtao.GBuffer(values["view_z"], native(FRAME["normal_v"]), camera)
        ao = gtao.AmbientOcclusion(visibility=native(FRAME["visibility"]), mean_direction=values["bent"])
        return gtao.denoise(ao, g, gtao.PlaneAwareFilter(size=3)).mean_direction

    values = {"view_z": FRAME["view_z"], "bent": bent}
    check(f, values, "view_z", unit_moves(SURFACE, 10, 5))
    moves = (move[..., None] * rng.standard_normal(3) for move in unit_moves(SURFACE, 10, 6))
    check(f, values, "bent", moves)


def kernels(action):
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        action()
        dr.sync_thread()
        return [k["operation_count"] for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT]


@pytest.mark.parametrize(
    ("name", "passes"), [("edge-aware", 2), ("edge-aware, 3 passes", 4), ("bilateral", 1), ("planes", 1)]
)
def test_a_backward_pass_is_one_large_kernel_for_every_pass(name, passes):
    """Besides the passes of the edge-aware filter: its links."""
    values = {k: native(v, single=True) for k, v in inputs(name).items()}
    attached = [values[k] for k in ("visibility", *FILTERS[name][2], *FILTERS[name][1])]
    dr.enable_grad(attached)
    dr.eval(values)
    result = []
    forward = kernels(lambda: result.append(filtered(name)(values)))
    forward = sorted(forward)[-passes:]

    def backward():
        dr.backward(dr.sum(dr.square(result[0].array)))
        dr.eval(dr.grad(attached))

    large = [n for n in kernels(backward) if n >= forward[0]]
    assert len(large) == passes
    # Reverse mode repeats the pass and goes back once; what it costs does not depend on how much is attached.
    assert sum(large) < 4 * sum(forward)


def test_rounded_links_have_no_derivative():
    camera = gtao.PerspectiveCamera(WIDTH, HEIGHT, **CAMERA)
    z, threshold, v = native(FRAME["view_z"]), native(0.011), native(FRAME["visibility"])
    plain = gtao.GBuffer(FRAME["view_z"], FRAME["normal_v"], camera)
    dr.enable_grad(z, threshold, v)
    for g, spatial in (
        (gtao.GBuffer(z, FRAME["normal_v"], camera), gtao.EdgeAwareFilter()),
        (plain, gtao.EdgeAwareFilter(edge_threshold=threshold)),
    ):
        with pytest.raises(gtao.ConfigError, match="quantised_edges=False"):
            gtao.denoise(gtao.AmbientOcclusion(visibility=v), g, spatial)
    # What does not go through the rounding is differentiable.
    result = gtao.denoise(gtao.AmbientOcclusion(visibility=v), plain, gtao.EdgeAwareFilter()).visibility
    dr.backward(dr.sum(result.array))
    assert np.abs(dr.grad(v).numpy()).max() > 0.1


def test_a_plane_that_ends_at_a_tap_has_finite_derivatives():
    """1 / z falls from 1 to 1/2 in one texel: at the next but one the plane is infinitely far."""
    z = native(np.tile([1.0, 2.0, 5.0, 5.0], (4, 1)))
    dr.enable_grad(z)
    g = gtao.GBuffer(z, None, gtao.PerspectiveCamera(4, 4, 1.0))
    ao = gtao.AmbientOcclusion(visibility=native(np.arange(16.0).reshape(4, 4)))
    result = gtao.denoise(ao, g, gtao.SpatialFilter(derivatives="first", planar=True, threshold=0.6)).visibility
    dr.backward(dr.sum(result.array))
    gradient = dr.grad(z).numpy()
    assert np.isfinite(gradient).all()
    assert np.abs(gradient).max() > 0.1


def test_pipelines_are_differentiable_from_end_to_end():
    """Depth moves the estimate and the weights of its filter; the radius only the estimate, the tolerance only them."""

    def f(values):
        g = gtao.GBuffer(values["view_z"], native(FRAME["normal_v"]), gtao.PerspectiveCamera(WIDTH, HEIGHT, **CAMERA))
        falloff = gtao.LinearFalloff(start=0.2, end=values["end"])
        pipeline = gtao.Pipeline(
            occlusion=gtao.GTAO(radius=1.5, n_slices=2, n_steps=4, falloff=falloff),
            spatial=gtao.PlaneAwareFilter(tolerance=values["tolerance"]),
            clamp=False,
        )
        return pipeline.step(g).visibility

    values = {"view_z": FRAME["view_z"], "end": 1.2, "tolerance": 0.5}
    check(f, values, "view_z", unit_moves(SURFACE, 12, 8))
    check(f, values, "end")
    check(f, values, "tolerance")
