"""Gradients through ``gtao.TemporalFilter.step``: of the frame at hand and of the options; the history has none."""

import copy

import drjit as dr
import numpy as np
import pytest
from gradients._functions import check, check_single_precision, native, pullback, pushforward, unit_moves
from oracles import fields

import gtao

HEIGHT, WIDTH = 11, 13
CAMERA = gtao.PerspectiveCamera(WIDTH, HEIGHT, fx=12.0, fy=10.5, cx=6.2, cy=5.9)


def depth(seed):
    rng = np.random.default_rng(seed)
    field = fields.in_perspective(fields.gaussians(0.3, 0.4, seed=4), size=WIDTH, slope=(0.4, -0.2))
    z = field.view_z[:HEIGHT] * (1 + 0.01 * rng.random((HEIGHT, WIDTH)))
    z[2:4, 3] = z[-1, -1] = np.inf
    return z


def values_of(seed):
    rng = np.random.default_rng(seed)
    z = depth(seed)
    surface = np.isfinite(z)
    return {
        "visibility": np.where(surface, rng.random(z.shape), 1.0),
        "mean_direction": np.where(surface[..., None], rng.standard_normal((*z.shape, 3)), 0.0),
        "view_z": z,
        "motion": rng.uniform(-1.5, 1.5, (*z.shape, 3)) * [1, 1, 0.05],
    }


FRAME = values_of(1)
SURFACE = np.isfinite(FRAME["view_z"])
NUMBERS = {
    "frames": 2.5,
    "moving_frames": 1.5,
    "moving_speed_px": 1.6,
    "disocclusion": 0.05,
    "covering": 0.08,
    "clamp_window": 0.2,
    "velocity_scale_px": 4.0,
    "deviation_window": 0.3,
    "crease": 0.7,
}
#: How the filter is made, and which of its numbers matter then.
FILTERS = {
    "clamped": (
        {},
        ("frames", "moving_frames", "moving_speed_px", "clamp_window", "velocity_scale_px", "deviation_window"),
    ),
    "not clamped": ({"clamp": False}, ("frames", "moving_frames", "moving_speed_px", "disocclusion", "covering")),
    "no slopes": ({"clamp": False, "derivatives": "none"}, ("disocclusion", "covering")),
    "creases": ({"clamp": False}, ("disocclusion", "crease")),
}
CASES = [
    (name, k, channel)
    for name, (_, numbers) in FILTERS.items()
    for k in ("visibility", "view_z", "motion", *numbers)
    for channel in ("visibility", "mean_direction")
    # But for the share of the clamp, directions do not depend on the visibility.
    if (k, channel) != ("visibility", "mean_direction")
]


def first_frames():
    history = gtao.History()
    for seed in (2, 0):
        apply(values_of(seed), history, gtao.TemporalFilter(deviation_window=0.3, crease=0.7))
    return history


def apply(values, history, temporal):
    values = {k: v if dr.is_array_v(v) else native(v) for k, v in values.items()}
    g = gtao.GBuffer(values["view_z"], None, CAMERA, motion=values["motion"])
    ao = gtao.AmbientOcclusion(visibility=values["visibility"], mean_direction=values["mean_direction"])
    return temporal.step(ao, g, history)


HISTORY = first_frames()


def stepped(name, channel="visibility"):
    """The third frame as a function of everything that it depends on."""
    options, numbers = FILTERS[name]

    def f(values):
        given = {k: values[k] for k in NUMBERS if k != "crease" or k in numbers}
        temporal = gtao.TemporalFilter(**options, **given)
        return getattr(apply(values, copy.copy(HISTORY), temporal), channel)

    return f


@pytest.mark.parametrize(("name", "of", "channel"), CASES)
def test_both_modes(name, of, channel):
    values = FRAME | NUMBERS
    moves = [1.0]
    if of in FRAME:
        moves = list(unit_moves(SURFACE, 24, 3))
    if of == "motion":
        rng = np.random.default_rng(0)
        moves = [move[..., None] * rng.standard_normal(3) * [1, 1, 0.1] for move in moves]
    check(stepped(name, channel), values, of, moves)


def test_directions_carry_gradients():
    moves = (move[..., None] * [0.3, -0.5, 0.8] for move in unit_moves(SURFACE, 12, 6))
    check(stepped("clamped", "mean_direction"), FRAME | NUMBERS, "mean_direction", moves)


@pytest.mark.parametrize("name", FILTERS)
def test_modes_are_each_others_transpose(name):
    """⟨J v, w⟩ = ⟨v, Jᵀ w⟩ with everything attached at once, and the background out of it."""
    values, rng = FRAME | NUMBERS, np.random.default_rng(1)
    names = ("visibility", "view_z", "motion", *FILTERS[name][1])
    v = {k: rng.standard_normal(np.shape(values[k])) for k in names}
    w = rng.standard_normal((HEIGHT, WIDTH))
    gradient = pullback(stepped(name), values, w, names)
    for k in ("visibility", "view_z", "motion"):
        assert (gradient[k][~SURFACE] == 0).all(), k
        v[k][~SURFACE] = 0
    forward = np.sum(pushforward(stepped(name), values, v) * w)
    # Sums of some thousand products of order 1 in double precision.
    assert forward == pytest.approx(sum(np.sum(gradient[k] * v[k]) for k in names), rel=1e-10)


@pytest.mark.parametrize("name", FILTERS)
def test_single_precision(name):
    names = ("visibility", "view_z", *FILTERS[name][1])
    # Depths of 4 are known to 2e-7, and trust is found in differences of 0.05 of them.
    check_single_precision(stepped(name), FRAME | NUMBERS, names, (HEIGHT, WIDTH), 0.98, 2e-3)


def test_a_backward_pass_is_one_large_kernel_and_the_history_has_no_gradient():
    values = {k: native(v, single=True) for k, v in (FRAME | NUMBERS).items()}
    attached = [values[k] for k in ("visibility", "view_z", "frames", "clamp_window")]
    dr.enable_grad(attached)
    dr.eval(values)
    history, found = copy.copy(HISTORY), {}
    options = FILTERS["clamped"][0]

    def kernels(name, action):
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            action()
            dr.sync_thread()
            found[name] = [k["operation_count"] for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT]

    result = []
    temporal = gtao.TemporalFilter(**options, **{k: values[k] for k in NUMBERS})
    kernels("forward", lambda: result.append(apply(values, history, temporal)))

    def backward():
        dr.backward(dr.sum(dr.square(result[0].visibility.array)))
        dr.eval(dr.grad(attached))

    kernels("backward", backward)
    forward = max(found["forward"])
    assert [n >= forward for n in found["backward"]].count(True) == 1
    assert max(found["backward"]) < 4 * forward
    kept = history.contents
    arrays = [a for channel in kept.channels.values() for a in channel]
    assert not dr.grad_enabled(arrays, kept.count, kept.view_z, kept.motion)


def test_a_recurrence_of_attached_frames_stays_a_single_step():
    """Two steps in a row: the gradient of the first frame is that of its own result, not of the next one."""
    values = {k: native(v) for k, v in FRAME.items()}
    dr.enable_grad(values["visibility"])
    history = gtao.History()
    apply(values, history, gtao.TemporalFilter())
    after = apply(values_of(2), history, gtao.TemporalFilter())
    assert not dr.grad_enabled(after.visibility)
