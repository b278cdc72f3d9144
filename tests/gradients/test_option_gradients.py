"""Every continuous option: both modes against differences, or an error in words; never a silent zero."""

from dataclasses import fields

import numpy as np
import pytest
from drjit.llvm.ad import Float, Float64
from gradients._attached import (
    DEPTH,
    NORMALS,
    WEIGHTS,
    along,
    attach,
    camera,
    check_numbers,
    image,
    pullback,
    tensor,
)
from gradients._methods import ao
from gradients._options import AT_THE_END, FIELDS, ORTHOGRAPHIC, REFUSED, VERIFIED

import drjit as dr  # isort: skip

import gtao


def option(make, kind="perspective"):
    """``build`` for a configuration made from numbers."""

    def build(values):
        return gtao.GBuffer(tensor(DEPTH), tensor(NORMALS), camera(kind)), make(**values)

    return build


CASES = [(name, "perspective") for name in VERIFIED] + [(name, "orthographic") for name in ORTHOGRAPHIC]


@pytest.mark.parametrize(("name", "kind"), CASES)
def test_both_modes_are_the_derivative(name, kind):
    make, values = VERIFIED[name]
    for number, found in check_numbers(option(make, kind), values).items():
        assert np.any(np.abs(found.value) > 1e3 * found.noise), f"{number} does nothing here"


@pytest.mark.parametrize("name", AT_THE_END)
def test_where_an_option_begins_to_act(name):
    """Off and nearly on are different kernels without gradients; with them, zero is no reason to leave a path out."""
    make, values = AT_THE_END[name]
    for number, found in check_numbers(option(make), values, one_sided=True).items():
        assert np.any(np.abs(found.value) > 1e3 * found.noise), f"{number} does nothing here"


@pytest.mark.parametrize("name", REFUSED)
def test_what_has_no_derivative_says_so(name):
    value, make = REFUSED[name]

    def build(values):
        return gtao.GBuffer(tensor(DEPTH), tensor(NORMALS), camera("perspective")), make(values["option"])

    found = along(build, {"option": value}, "option")
    # The image changes in jumps or not at all, which differences show.
    assert (found.value[found.resolved] == 0).all()
    with pytest.raises(gtao.ConfigError, match=name.split(",")[0].split(".")[-1]):
        gtao.ambient_occlusion(*build(attach({"option": value})))
    # The same number without a gradient is a number.
    detached = gtao.ambient_occlusion(*build({"option": Float64(value)})).visibility.numpy()
    assert np.array_equal(detached, image(build, {"option": value}))


def test_listed_angles_are_no_inputs():
    """They are part of the kernel; one that carries a gradient must not lose it in silence."""
    angle = attach({"angle": 0.45})["angle"]
    with pytest.raises(gtao.ConfigError, match="slice_angles"):
        gtao.ambient_occlusion(
            gtao.GBuffer(tensor(DEPTH), tensor(NORMALS), camera("perspective")),
            ao(radius=0.9, slice_angles=(0.1, angle)),
        )


THICK = {
    "amount": lambda v: gtao.ConstantThickness(thickness=v),
    "slope": lambda v: gtao.LinearThickness(slope=v),
    "continuing": lambda v: gtao.ContinuityThickness(continuing=v, isolated=0.1, gap=0.1),
    "isolated": lambda v: gtao.ContinuityThickness(continuing=0.5, isolated=v, gap=0.1),
    "gap": lambda v: gtao.ContinuityThickness(continuing=0.5, isolated=0.1, gap=v),
}
COUNTING = {
    "bitmask": lambda v: gtao.VisibilityBitmask(radius=v),
    "bitmask, cut": lambda v: gtao.VisibilityBitmask(radius=2.0, falloff=gtao.SampleCut(end=v)),
    "bitmask, power": lambda v: gtao.VisibilityBitmask(power=v),
    "ray march": lambda v: gtao.HeightfieldRayMarch(radius=v),
    "dense horizon": lambda v: gtao.HeightfieldHorizon(radius=v),
} | {f"bitmask, {n}": lambda v, make=make: gtao.VisibilityBitmask(thickness=make(v)) for n, make in THICK.items()}


@pytest.mark.parametrize("name", COUNTING)
def test_counting_methods_have_no_gradient(name):
    g = gtao.GBuffer(tensor(DEPTH), tensor(NORMALS), camera("perspective"))
    number = attach({"": 0.4})[""]
    with pytest.raises(gtao.ConfigError, match="no gradient"):
        gtao.ambient_occlusion(g, COUNTING[name](number))
    for what in ({"view_z": DEPTH}, {"normal_v": NORMALS}, {"fx": 20.0}):
        values = {"view_z": DEPTH, "normal_v": NORMALS, "fx": 20.0} | attach(what)
        z, n, fx = (values[k] if k == "fx" else tensor(values[k]) for k in ("view_z", "normal_v", "fx"))
        with pytest.raises(gtao.ConfigError, match="no gradient"):
            gtao.ambient_occlusion(gtao.GBuffer(z, n, camera("perspective", fx=fx)), COUNTING[name](0.4))


def continuous(cls):
    return [f.name for f in fields(cls) if "float" in str(f.type)]


def test_no_continuous_option_is_left_out():
    """Each is verified in one configuration at least, or refused in all."""
    methods = {name for cls in (gtao.GTAO, gtao.HBAO) for name in continuous(cls)}
    parts = (
        gtao.LinearFalloff,
        gtao.QuadraticFalloff,
        gtao.IndexFalloff,
        gtao.SampleCut,
        gtao.NoCut,
        gtao.RunningThickness,
        gtao.DepthCut,
        gtao.DepthPyramid,
    )
    every = methods | {f"{cls.__name__}.{name}" for cls in parts for name in continuous(cls)}
    assert len(every) > 20
    verified = {
        FIELDS.get(name, {}).get(n, n)
        for name, (_, values) in VERIFIED.items()
        for n in values
        if name in FIELDS or n in methods
    }
    assert every == verified | {name.split(",")[0] for name in REFUSED} | {"slice_angles"}


def test_literals_carry_gradients_too():
    """Dr.Jit folds literals into what they are multiplied with, and the dependency with them."""
    build = option(lambda radius: ao(radius=radius))
    reference = pullback(build, {"radius": 0.9})["radius"]
    r = Float64(0.9)
    dr.enable_grad(r)
    visibility = gtao.ambient_occlusion(*build({"radius": r})).visibility.array
    dr.backward(dr.sum(visibility * Float64(WEIGHTS.ravel())))
    assert dr.grad(r)[0] == pytest.approx(reference, rel=1e-12)
    assert reference != 0


@pytest.mark.parametrize("name", ["40 steps", "quadratic falloff", "hbao by sample", "sphere"])
def test_numbers_of_another_precision(name):
    """Float32 options of a float64 frame: converted, with their gradients."""
    make, values = VERIFIED[name]
    exact = {n: float(np.float32(v)) for n, v in values.items()}
    reference = pullback(option(make), exact)
    single = {n: dr.opaque(Float, v) for n, v in values.items()}
    dr.enable_grad(*single.values())
    visibility = gtao.ambient_occlusion(*option(make)(dict(single))).visibility.array
    assert type(visibility) is Float64
    dr.backward(dr.sum(visibility * Float64(WEIGHTS.ravel())))
    for n, v in single.items():
        # Numbers derived from options, and the gradients, have been float32.
        assert dr.grad(v)[0] == pytest.approx(reference[n], rel=1e-5)
