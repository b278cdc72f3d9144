"""Gradients of ``gtao.specular_occlusion`` and its kin against differences in float64."""

import drjit as dr
import numpy as np
import pytest
from gradients._functions import check, native, pullback, pushforward, unit_moves
from oracles.slice_oracle import unit
from oracles.specular_frames import view_directions

import gtao
from gtao.data.specular import SpecularTable
from gtao.estimators.specular_pixels import View

SHAPE = 3, 5
BACKGROUND = 1, 2
RNG = np.random.default_rng(14)
CAMERA = gtao.PerspectiveCamera(SHAPE[1], SHAPE[0], 1.2)
#: What each kind of method looks at.
DIRECTIONAL, PLAIN = {"A", "B", "normal", "roughness"}, {"A", "normal", "roughness"}
METHODS = {
    "cones": (gtao.ConeCone(), DIRECTIONAL),
    "tilted cones": (gtao.ConeCone(aperture="tilted"), DIRECTIONAL),
    "matched cones": (gtao.ConeCone(aperture="matched"), DIRECTIONAL),
    "smoothstep": (gtao.ConeCone(intersection="oat"), DIRECTIONAL),
    "drobot": (gtao.ConeCone(reflection="drobot"), DIRECTIONAL),
    "uludag": (gtao.ConeCone(reflection="uludag"), DIRECTIONAL),
    "u": (lambda x: gtao.ConeCone(u=x["u"]), DIRECTIONAL | {"u"}),
    "cone table": (lambda x: table("cone-cone", "linear", x), DIRECTIONAL | {"values"}),
    "brdf table": (
        lambda x: table("brdf-4d", "lobe", x, "texels", environment=environment(x)),
        DIRECTIONAL | {"f0", "texels", "environment"},
    ),
    "grey brdf table": (lambda x: table("brdf-5d", "linear", x, "grey"), DIRECTIONAL | {"grey"}),
    "lobe": (gtao.ConeLobe(), DIRECTIONAL),
    "phong": (gtao.ConeLobe(distribution="phong"), DIRECTIONAL),
    # Its derivatives are those of the integral, not of the sum.
    "brdf": (gtao.ConeBRDF(n_nodes=24), DIRECTIONAL | {"f0"}),
    "lagarde": (gtao.Lagarde2014(), PLAIN),
    "visibility": (gtao.VisibilityAsSpecular(), {"A"}),
}
each_method = pytest.mark.parametrize("name", METHODS)


def table(kind, axes, inputs, name="values", **options):
    return gtao.ConeTable(table=SpecularTable(kind=kind, axes=axes, values=inputs[name]), **options)


def environment(inputs):
    return SpecularTable(kind="environment-brdf", axes="root", values=inputs["environment"])


def values():
    """Whole cones with axes up to 40° from normals that face the viewer, rims that cross the reflected cones' rims."""
    v = view_directions(CAMERA)
    n = unit(v + 0.8 * unit(RNG.standard_normal((*SHAPE, 3))))
    A = RNG.uniform(0.2, 0.6, SHAPE)
    b = unit(n + 0.25 * RNG.standard_normal((*SHAPE, 3)))
    return {
        "A": A,
        "B": b * (A * RNG.uniform(0.7, 0.95, SHAPE))[..., None],
        "normal": n,
        "roughness": RNG.uniform(0.6, 0.8, SHAPE),
        "f0": RNG.uniform(0, 1, (*SHAPE, 3)),
        "u": 0.02,
        # What varies little from texel to texel has few kinks at them.
        "values": 0.5 + 0.3 * RNG.random((4, 5, 6, 1)),
        "texels": 0.5 + 0.3 * RNG.random((3, 3, 4, 4, 2)),
        "environment": 0.3 + 0.5 * RNG.random((4, 5, 2)),
        "grey": 0.5 + 0.3 * RNG.random((2, 3, 3, 3, 3, 1)),
    }


VALUES = values()


def occluded(name, uniform=False, background=(BACKGROUND,), single=False, function=gtao.specular_occlusion):
    method, _ = METHODS[name]
    config = gtao.GTAO(weighting="uniform" if uniform else "cosine", bent_normal=True)
    z = np.full(SHAPE, 2.0)
    for pixel in background:
        z[pixel] = np.inf

    def f(inputs):
        g = gtao.GBuffer(native(z, single), inputs["normal"], CAMERA, validate=False)
        images = {"visibility": inputs["A"], "mean_direction": inputs["B"], "normal_v": g.normal_v}
        ao = gtao.AmbientOcclusion(**images, config=config)
        chosen = method(inputs) if callable(method) else method
        return function(ao, g, inputs["roughness"], inputs["f0"], chosen)

    return f


def moves(key):
    rng, mask = np.random.default_rng(3), np.ones(SHAPE, bool)
    # The background moves nothing, and a check wants to see something.
    mask[BACKGROUND] = False
    if key in ("A", "roughness"):
        return list(unit_moves(mask, 6, 1))
    if key == "normal":
        return list(unit_moves(mask, 6, 2, VALUES["normal"]))
    return [rng.standard_normal(np.shape(VALUES[key])) if np.ndim(VALUES[key]) else 1.0 for _ in range(3)]


@each_method
def test_everything_that_is_read(name):
    for key in METHODS[name][1]:
        check(occluded(name), VALUES, key, moves(key))


@pytest.mark.parametrize("name", ["cones", "matched cones", "lagarde", "visibility"])
def test_estimates_with_uniform_weighting(name):
    """Apertures by solid angle; cosine-weighted visibility from the mean direction and the normal."""
    for key in {"A", "B", "normal"} if METHODS[name][1] == DIRECTIONAL else {"B", "normal"}:
        check(occluded(name, uniform=True), VALUES, key, moves(key))


@each_method
def test_nothing_else_and_no_background(name):
    gradient = pullback(occluded(name), VALUES, RNG.standard_normal((*SHAPE, 3)))
    for key, g in gradient.items():
        assert np.isfinite(g).all()
        assert np.any(g) == (key in METHODS[name][1]), key
        if np.shape(g)[:2] == SHAPE:
            assert not np.any(g[BACKGROUND]), key


@each_method
def test_modes_are_each_others_transpose(name):
    f, rng = occluded(name), np.random.default_rng(6)
    v = {key: rng.standard_normal(np.shape(value)) if np.ndim(value) else 1.3 for key, value in VALUES.items()}
    w = rng.standard_normal((*SHAPE, 3))
    forward = np.sum(pushforward(f, VALUES, v) * w)
    gradient = pullback(f, VALUES, w)
    # Sums of some hundred products of order 1 to 100 in double precision.
    assert forward == pytest.approx(sum(np.sum(gradient[key] * v[key]) for key in VALUES), rel=1e-9)


def corners():
    """Open, closed, beyond, level with the plane, mirrored direction, no direction at all; mirrors and the roughest."""
    v = view_directions(CAMERA)
    n = v.copy()
    n[1] = unit(v[1] + 0.5 * np.array([1.0, 0, 0]))
    n[2] = unit(-v[2] + 0.5 * np.array([1.0, 0, 0]))
    A = np.array([[1, 1 - 1e-7, 1.05, 0, 0.5], [1, 0.5, 1e-7, 0.5, 0.9], [1, 1.2, 0, 0.5, -0.1]])
    mirrored = 2 * np.sum(n * v, axis=-1, keepdims=True) * n - v
    B = 0.5 * n
    B[1, 1:3] = 0.4 * mirrored[1, 1:3]
    B[1, 3:] = 0.4 * unit(np.cross(n[1, 3:], v[1, 3:]))
    B[0, 4], B[2, 4] = 0, 0
    roughness = np.array([[0, 1, 0.5, 0, 1], [0, 0, 1, 0.02, 0.3], [0.0, 1, 0.5, 0.2, 0.7]])
    return VALUES | {"A": A, "B": B, "normal": n, "roughness": roughness, "f0": np.round(VALUES["f0"])}


@pytest.mark.parametrize("single", [False, True], ids=["float64", "float32"])
@each_method
def test_gradients_are_finite_in_all_corners(name, single):
    for uniform in (False, True):
        f = occluded(name, uniform, background=(), single=single)
        gradient = pullback(f, corners(), np.ones((*SHAPE, 3)), single=single)
        for key, g in gradient.items():
            assert np.isfinite(g).all(), key


def test_an_angle_of_exactly_zero():
    """It is a distance, which has no derivative there: 0 is given."""
    normal = native(np.array([[[0.0, 0, 1], [0.6, 0, 0.8]]]))
    dr.enable_grad(normal)
    g = gtao.GBuffer(native(np.full((1, 2), 2.0)), normal, gtao.OrthographicCamera(2, 1, 1.0), validate=False)
    dr.backward(dr.sum(View.of(g, 0.5).theta_o))
    # Across the plane of incidence it does not change; within it, by the turn of the unit vector.
    assert dr.grad(normal).numpy() == pytest.approx(np.array([[[0, 0, 0], [0.8, 0, -0.6]]]), abs=1e-12)


def test_from_the_reflection_back_to_the_depth():
    """Through search, directions and the cones: a frame's depth, attached before the frame is made."""
    y, x = np.mgrid[:10, :12]
    z = 3 + 0.9 * np.sin(x / 2.1) * np.cos(y / 2.7) + 0.02 * x
    normal = np.tile([0.0, 0.0, 1.0], (10, 12, 1))
    method = gtao.GTAO(radius=1.5, n_slices=2, n_steps=4, bent_normal=True, falloff=None)

    def f(inputs):
        g = gtao.GBuffer(inputs["z"], inputs["normal"], gtao.PerspectiveCamera(12, 10, 1.0), validate=False)
        ao = gtao.ambient_occlusion(g, method)
        return gtao.specular_occlusion(ao, g, inputs["roughness"], method=gtao.ConeCone())

    inputs = {"z": z, "normal": normal, "roughness": 0.9}
    check(f, inputs, "z", unit_moves(np.ones((10, 12), bool), 12, 4))
    check(f, inputs, "normal", unit_moves(np.ones((10, 12), bool), 6, 4, normal))
    check(f, inputs, "roughness")


def test_what_several_readers_of_the_normals_add_up_to():
    """Two occlusions, an irradiance and an estimate of one frame, whose normals all of them read."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    z = 3 + 0.3 * np.sin(x / 2.1) * np.cos(y / 2.7)
    method = gtao.GTAO(radius=1.5, n_slices=2, n_steps=4, weighting="uniform", bent_normal=True, falloff=None)

    def f(inputs):
        g = gtao.GBuffer(native(z), inputs["normal"], CAMERA, validate=False)
        ao = gtao.ambient_occlusion(g, method)
        plain = gtao.specular_occlusion(ao, g, 0.1, method=gtao.Lagarde2014())
        lit = gtao.irradiance(inputs["sh"], g, ao, gtao.OcclusionTimesIrradiance())
        return plain + gtao.specular_occlusion(ao, g, inputs["roughness"], method=gtao.ConeCone()) + lit

    moved = unit_moves(np.ones(SHAPE, bool), 6, 2, VALUES["normal"])
    check(f, VALUES | {"sh": RNG.standard_normal(9)}, "normal", moved)
