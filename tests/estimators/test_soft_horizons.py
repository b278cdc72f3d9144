"""``GTAO(soft_horizon=…)`` on images: its definition pixel by pixel, its bias, its limit, its gradients."""

import math

import drjit as dr
import numpy as np
import pytest
from analytic._frames import frame, image, pixels
from gradients._functions import check, native, pullback, pushforward, unit_moves
from oracles import fields
from oracles import soft_horizons as oracle

import gtao

FIELDS = {
    "from above": lambda: fields.from_above(fields.gaussians(0.35, 0.2, count=12, seed=4), size=32),
    "stretched, off-centre": lambda: fields.in_perspective(
        fields.gaussians(0.25, 0.12, count=14, seed=1), size=32, stretch=1.3, slope=(0.3, -0.2), shift_px=(5.0, -3.0)
    ),
    # Seen at a grazing angle, where arcs within the radius end above the tangent plane.
    "grazing": lambda: fields.in_perspective(fields.gaussians(0.1, 0.1, count=14, seed=2), size=32, slope=(0.0, 0.95)),
}
CUTS = {
    "unlimited": ({}, {}),
    "sphere": ({"radius": 0.5}, {"radius": 0.5}),
    "falloff": (
        {"radius": 0.6, "falloff": gtao.LinearFalloff(start=0.1, end=0.6)},
        {"radius": 0.6, "falloff": (0.1, 0.6)},
    ),
}
STEPS = {"n_slices": 3, "n_steps": 7}


@pytest.mark.parametrize("temperature", [0.02, 0.3])
@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
@pytest.mark.parametrize("cut", CUTS)
@pytest.mark.parametrize("name", FIELDS)
def test_single_pixels(name, cut, weighting, temperature):
    field, (options, same) = FIELDS[name](), CUTS[cut]
    options = options | STEPS | {"weighting": weighting, "noise": "none", "step_exponent": 1.0}
    got = image(field, gtao.GTAO(soft_horizon=temperature, **options))
    where = pixels(field, 6)
    want = [oracle.visibility(field, *p, temperature=temperature, weighting=weighting, **STEPS, **same) for p in where]
    assert got[where[:, 0], where[:, 1]] == pytest.approx(np.array(want), abs=1e-12)


@pytest.mark.parametrize("temperature", [0.01, 0.3])
@pytest.mark.parametrize("options", [{}, {"radius": 0.4}, {"weighting": "uniform"}], ids=str)
def test_an_open_plane_stays_open(temperature, options):
    """All samples tie with the tangent plane, whatever the temperature: the fetch that is exact on planes shows it."""
    field = fields.tilted_plane(0.9, 0.4, size=24)
    soft, hard = (image(field, gtao.GTAO(soft_horizon=t, fetch="linear", **options)) for t in (temperature, None))
    assert np.abs(soft - hard).max() < 1e-12
    assert hard.mean() == pytest.approx(1.0, abs=1e-3)


SCENES = {
    "bumps": lambda: fields.in_perspective(fields.gaussians(0.3, 0.3, seed=4), size=48, slope=(0.3, -0.2)),
    "waves": lambda: fields.from_above(fields.waves(0.2, 8.0), size=48),
    "groove": lambda: fields.groove(0.4, 0.4, n_px=64, pixel=0.02, length_px=24),
    "pit": lambda: fields.pit(0.4, 0.4, n_px=48, pixel=0.02),
}


@pytest.mark.parametrize("name", SCENES)
def test_the_bias(name):
    """Toward open, at most by both sides' τ W(n/e), and falling at least in proportion to the temperature."""
    field = SCENES[name]()
    hard = image(field, gtao.GTAO())
    biases = []
    for temperature in (0.1, 0.03, 0.01):
        bias = image(field, gtao.GTAO(soft_horizon=temperature)) - hard
        assert bias.min() > -1e-12
        assert bias.max() < 2 * oracle.greatest_bias(temperature, 8)
        biases.append(bias.mean())
    assert biases[0] < 0.03
    assert biases[0] > 2.4 * biases[1] > 7 * biases[2]


def test_the_limit_is_the_maximum_and_the_mean_bias_of_second_order():
    """Gaps between the two highest samples have a density at 0: ∫ g / (1 + exp(g/τ)) dg is π²/12 τ²."""
    field = SCENES["waves"]()
    hard = image(field, gtao.GTAO())
    temperatures = np.array([4e-3, 2e-3, 1e-3, 5e-4])
    bias = [np.mean(image(field, gtao.GTAO(soft_horizon=float(t))) - hard) for t in temperatures]
    orders = np.diff(np.log(bias)) / np.diff(np.log(temperatures))
    # 2304 pixels with 8 horizons each: about a tenth of the gaps are below the temperatures looked at.
    assert orders == pytest.approx(2.0, abs=0.15)
    assert np.abs(image(field, gtao.GTAO(soft_horizon=1e-6)) - hard).max() < 1e-5


def test_single_precision():
    field = SCENES["bumps"]()
    for temperature in (1e-6, 0.05, 1e3):
        single, double = (image(field, gtao.GTAO(soft_horizon=temperature), dtype=t) for t in (np.float32, np.float64))
        # Samples that nearly tie swap in the coldest.
        assert np.quantile(np.abs(single - double), 0.99) < 2e-5


def small():
    """Noise on a slope with a step and a hole: nothing ties."""
    rng = np.random.default_rng(5)
    y, x = np.mgrid[:14, :16]
    z = 3 + 0.03 * x + 0.02 * y + 0.12 * rng.random((14, 16)) + 0.4 * ((x // 5 + y // 6) % 2)
    z[4:7, 11:14] = np.inf
    n = rng.standard_normal((14, 16, 3)) + np.array([0, 0, 2.5])
    return {"view_z": z, "normal_v": n / np.linalg.norm(n, axis=-1, keepdims=True)}


FRAME = small()
SURFACE = np.isfinite(FRAME["view_z"])
CAMERA = {"fx": 14.0, "fy": 13.0, "cx": 8.3, "cy": 6.6}
SMALL = {"n_slices": 2, "n_steps": 3}
NUMBERS = {
    "unlimited": {"temperature": 0.08},
    "sphere": {"temperature": 0.08, "radius": 0.9},
    "falloff": {"temperature": 0.15, "end": 1.1},
    "uniform, linear fetch": {"temperature": 0.02, "radius": 1.1},
}
CASES = [(name, of) for name, numbers in NUMBERS.items() for of in ("view_z", *numbers)]
CASES += [("sphere", "normal_v"), ("sphere", "fx"), ("falloff", "normal_v")]


def estimate(name):
    def f(values):
        camera = gtao.PerspectiveCamera(16, 14, **{k: values[k] for k in CAMERA})
        g = gtao.GBuffer(values["view_z"], values["normal_v"], camera)
        options = SMALL | {"soft_horizon": values["temperature"], "radius": values.get("radius", math.inf)}
        if "end" in values:
            options |= {"falloff": gtao.LinearFalloff(start=0.2, end=values["end"]), "radius": 1.2}
        if name == "uniform, linear fetch":
            options |= {"weighting": "uniform", "fetch": "linear"}
        return gtao.ambient_occlusion(g, gtao.GTAO(**options)).visibility

    return f


@pytest.mark.parametrize(("name", "of"), CASES)
def test_gradients_in_both_modes(name, of):
    values = FRAME | CAMERA | NUMBERS[name]
    moves = [1.0]
    if of in FRAME:
        moves = unit_moves(SURFACE, 12, 3, values["normal_v"] if of == "normal_v" else None)
    check(estimate(name), values, of, moves)


@pytest.mark.parametrize("name", ["sphere", "falloff"])
def test_modes_are_each_others_transpose(name):
    f, values, rng = estimate(name), FRAME | CAMERA | NUMBERS[name], np.random.default_rng(3)
    v = {k: rng.standard_normal(np.shape(value)) for k, value in values.items()}
    for k in FRAME:
        v[k][~SURFACE] = 0
    w = rng.standard_normal(SURFACE.shape)
    gradient = pullback(f, values, w)
    assert all((gradient[k][~SURFACE] == 0).all() for k in FRAME)
    forward = np.sum(pushforward(f, values, v) * w)
    # Sums of some thousand products of order 1 in double precision.
    assert forward == pytest.approx(sum(np.sum(gradient[k] * v[k]) for k in values), rel=1e-10)


def depths_that_matter(field, pixel, **options):
    """Texels other than its own whose depth changes the visibility of a pixel, and those that do so by at least 1 %
    of what the most important one does."""
    T = dr.tensor_t(dr.float64_array_t(gtao.backend.default_float()))
    z = T(field.view_z)
    dr.enable_grad(z)
    g = gtao.GBuffer(z, field.normal_v, gtao.PerspectiveCamera(**field.camera))
    visibility = gtao.ambient_occlusion(g, gtao.GTAO(**options)).visibility.array
    at = dr.uint32_array_t(type(visibility))(int(pixel[0]) * g.shape[1] + int(pixel[1]))
    dr.backward(dr.gather(type(visibility), visibility, at))
    gradient = np.abs(np.array(dr.grad(z)))
    gradient[tuple(pixel)] = 0
    return np.count_nonzero(gradient), np.count_nonzero(gradient > 0.01 * gradient.max())


def test_gradients_are_denser():
    """One texel for each horizon above the tangent plane, or all samples above it: of 64, some 29."""
    field = SCENES["bumps"]()
    where = pixels(field, 24)
    hard, warm, hot = (
        np.mean([depths_that_matter(field, p, soft_horizon=t) for p in where], axis=0) for t in (None, 0.03, 0.1)
    )
    assert hard[0] <= 8
    assert warm[0] == hot[0] > 4 * hard[0]
    assert warm[1] > 1.5 * hard[1]
    assert hot[1] > 2.5 * hard[1]


@pytest.mark.parametrize("radius", [None, 1.0], ids=["unlimited", "sphere"])
def test_a_gradient_step_is_two_large_kernels(radius):
    values = {k: native(v, single=True) for k, v in FRAME.items()} | {"temperature": native(0.05, single=True)}
    if radius is not None:
        values["radius"] = native(radius, single=True)
    dr.enable_grad(values)
    dr.eval(values)
    f = estimate("unlimited" if radius is None else "sphere")
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        g = f(values | CAMERA)
        dr.kernel_history_clear()
        dr.backward(dr.sum(dr.square(g.array)))
        dr.eval(dr.grad(values))
        dr.sync_thread()
        ops = [k["operation_count"] for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT]
    assert len([n for n in ops if n > 400]) <= 2


def test_more_steps_than_can_be_unrolled():
    g = frame(SCENES["bumps"](), np.float64)
    many = {"n_slices": 1, "n_steps": 64, "soft_horizon": 0.05}
    hard = gtao.ambient_occlusion(g, gtao.GTAO(**(many | {"soft_horizon": None}))).visibility.numpy()
    bias = gtao.ambient_occlusion(g, gtao.GTAO(**many)).visibility.numpy() - hard
    assert 0 < bias.max() < 2 * oracle.greatest_bias(0.05, 64)
    temperature = native(0.05)
    dr.enable_grad(temperature)
    with pytest.raises(gtao.ConfigError, match="n_steps <= 32"):
        gtao.ambient_occlusion(g, gtao.GTAO(**(many | {"soft_horizon": temperature})))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"soft_horizon": 0.0}, "positive"),
        ({"soft_horizon": -0.1}, "positive"),
        ({"soft_horizon": math.inf}, "finite"),
        ({"soft_horizon": 1e-9}, "1e-06"),
        ({"soft_horizon": "warm"}, "number"),
        ({"thickness": gtao.RunningThickness(blend=0.1)}, "RunningThickness"),
        ({"falloff": gtao.IndexFalloff()}, "IndexFalloff"),
        ({"falloff": gtao.LinearFalloff(start=0.1, end=0.5, toward="horizon")}, "toward the horizon"),
    ],
)
def test_refusals(options, words):
    options = {"radius": 1.0, "soft_horizon": 0.1} | options
    if "thickness" in options:
        options["falloff"] = gtao.NoCut()
    with pytest.raises(gtao.ConfigError, match=words):
        gtao.GTAO(**options)


def test_the_option_survives_a_record():
    method = gtao.GTAO(soft_horizon=0.05)
    assert gtao.method_from_dict(method.to_dict()) == method
    attached = native(0.05)
    dr.enable_grad(attached)
    assert gtao.GTAO(soft_horizon=attached).to_dict()["soft_horizon"] == pytest.approx(0.05)
