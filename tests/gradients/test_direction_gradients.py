"""Gradients of mean directions and spherical harmonics against differences, both modes, through every kind of slice."""

import numpy as np
import pytest
from gradients._attached import CAMERAS, DEPTH, NORMALS, SURFACE, problem
from gradients._functions import check, native, pullback, pushforward, unit_moves
from gradients._methods import LINEAR, ao, toward

import drjit as dr  # isort: skip

import gtao

METHODS = {
    "unlimited": ao(directional=True),
    "sphere": ao(directional=True, radius=0.9),
    "sphere uniform, many slices": ao(directional=True, radius=0.9, weighting="uniform", n_slices=6),
    "linear falloff, longer normals": ao(directional=True, **LINEAR, length_blend=0.3, power=2.0),
    "two-term arc cosine": ao(directional=True, **LINEAR, arccosine="two_term"),
    "screen": ao(bent_normal=True, radius=0.9, slice_measure="screen"),
    "optical axis": ao(directional=True, radius=0.9, falloff=gtao.NoCut(), zenith="optical_axis"),
    "linear fetch, uniform": ao(directional=True, fetch="linear", weighting="uniform"),
    "soft": ao(directional=True, radius=0.9, soft_horizon=0.1),
    "every sample": toward("horizon", bent_normal=True),
}
CASES = [(name, "perspective") for name in METHODS] + [("sphere", "orthographic"), ("screen", "orthographic")]


def function(method, kind="perspective"):
    build = problem(method, kind)

    def f(values):
        estimate = gtao.ambient_occlusion(*build(dict(values)))
        return estimate.visibility_sh if method.directional else estimate.mean_direction

    return f


@pytest.mark.parametrize(("name", "kind"), CASES, ids=[f"{name}, {kind}" for name, kind in CASES])
def test_every_input(name, kind):
    f, values = function(METHODS[name], kind), {"view_z": DEPTH, "normal_v": NORMALS} | CAMERAS[kind]
    check(f, values, "view_z", unit_moves(SURFACE, 8, 2))
    check(f, values, "normal_v", unit_moves(SURFACE, 8, 3, NORMALS))
    check(f, values, "fx" if kind == "perspective" else "view_height")
    if kind == "perspective":
        check(f, values, "cx")


@pytest.mark.parametrize("name", ["radius", "falloff end"])
def test_options(name):
    """The radius of the exact cut, and the end of a falloff."""
    build = problem(ao())

    def f(values):
        g, length = build({})[0], values["length"]
        exact = {"radius": length}
        options = exact if name == "radius" else {"radius": 1.2, "falloff": gtao.LinearFalloff(start=0.3, end=length)}
        return gtao.ambient_occlusion(g, ao(directional=True, **options)).visibility_sh

    check(f, {"length": 0.9}, "length")


@pytest.mark.parametrize("name", METHODS)
def test_the_modes_are_transposes(name):
    """⟨Jv, w⟩ = ⟨v, Jᵀw⟩ for random v and w."""
    f, values = function(METHODS[name]), {"view_z": DEPTH, "normal_v": NORMALS} | CAMERAS["perspective"]
    rng = np.random.default_rng(3)
    v = {key: 0.1 * rng.normal(size=np.shape(value)) for key, value in values.items()}
    v["view_z"] = np.where(SURFACE, v["view_z"], 0)
    forward = pushforward(f, values, v)
    reverse = pullback(f, values, forward)
    other = sum(float(np.sum(reverse[key] * v[key])) for key in values)
    # Rounding of float64 over some hundred operations.
    assert other == pytest.approx(float(np.sum(forward * forward)), rel=1e-11)


def test_bands_have_the_gradients_of_the_whole():
    f = function(METHODS["sphere"])

    def gradients(max_pixels):
        z = native(DEPTH)
        dr.enable_grad(z)
        g, method = problem(METHODS["sphere"])({"view_z": z})
        planes = gtao.ambient_occlusion(g, method, max_pixels=max_pixels).planes("visibility_sh").arrays
        dr.backward(sum(dr.sum(plane * (k + 1)) for k, plane in enumerate(planes)))
        return np.array(dr.grad(z))

    assert np.abs(gradients(None)).max() > 0
    assert gradients(100) == pytest.approx(gradients(None), abs=1e-12)
    assert f({"view_z": native(DEPTH)}).shape == (*DEPTH.shape, 9)


def test_the_baseline_has_no_gradient():
    z = native(DEPTH)
    dr.enable_grad(z)
    g, method = problem(ao(bent_normal="average_horizon"))({"view_z": z})
    with pytest.raises(gtao.ConfigError, match="average_horizon"):
        gtao.ambient_occlusion(g, method)


def test_a_look_without_gradients_takes_none_away():
    z = native(DEPTH)
    dr.enable_grad(z)
    ao = gtao.ambient_occlusion(*problem(METHODS["sphere"])({"view_z": z}))
    with dr.suspend_grad():
        image = ao.visibility_sh
    assert not dr.grad_enabled(image)
    dr.backward(dr.sum(ao.visibility_sh, axis=None))
    assert np.abs(np.array(dr.grad(z))).max() > 0
