"""Baked tables at the pixels of a frame: how near they come to quadrature over the cone, and open surfaces."""

import numpy as np
import pytest
from oracles import specular_frames as oracle
from oracles.slice_oracle import unit

import gtao
from gtao import tables
from gtao.data.specular import shipped

CAMERA = gtao.PerspectiveCamera(40, 30, 1.2)
RNG = np.random.default_rng(31)
#: Size of small tables by kind.
SIZES = {"cone-cone": 16, "cone-lobe": 16, "brdf-3d": 16, "brdf-4d": 12, "brdf-5d": (8, 10, 8, 8, 6)}


@pytest.fixture(scope="module")
def methods():
    """Small tables of all kinds, and quadrature."""
    environment = tables.bake("environment-brdf", 32)
    found = {
        kind: gtao.ConeTable(table=tables.bake(kind, size), environment=environment) for kind, size in SIZES.items()
    }
    return found | {"exact": gtao.ConeBRDF(n_nodes=32)}


def frame(n, b, A):
    g = gtao.GBuffer(np.full(CAMERA.shape, 2.0), n, CAMERA)
    T = g.types.Tensor
    return g, gtao.AmbientOcclusion(visibility=T(A), mean_direction=T(b))


def leaning(azimuth, most=0.6):
    """A frame whose bent normals lean away from normals by up to an angle.

    Azimuths, (H, W), are those about the normal: 0 from it toward the mirrored direction, π toward the viewer.
    """
    v = oracle.view_directions(CAMERA)
    n = unit(v + 0.9 * unit(RNG.standard_normal(v.shape)))
    x = unit(n * np.sum(n * v, axis=-1, keepdims=True) - v)
    y = np.cross(n, x)
    tilt = RNG.uniform(0, most, (*CAMERA.shape, 1))
    b = np.cos(tilt) * n + np.sin(tilt) * (np.cos(azimuth)[..., None] * x + np.sin(azimuth)[..., None] * y)
    return frame(n, b, RNG.uniform(0.05, 0.95, CAMERA.shape))


def rms(methods, kind, g, ao, roughness, f0=0.04):
    got, want = (gtao.specular_occlusion(ao, g, roughness, f0, methods[k]).numpy() for k in (kind, "exact"))
    return np.sqrt(np.mean((got - want) ** 2))


def test_bent_normals_in_the_plane_of_incidence(methods):
    """χ = 0: nothing but the error of the table, where four coordinates are enough."""
    roughness = RNG.uniform(0.1, 1, CAMERA.shape)
    # Toward the viewer: never past the mirrored direction, where χ is π.
    g, ao = leaning(np.full(CAMERA.shape, np.pi))
    chi = oracle.azimuth(g.normal_v.numpy(), oracle.view_directions(CAMERA), ao.mean_direction.numpy())
    assert np.abs(chi).max() < 1e-3
    errors = {kind: rms(methods, kind, g, ao, roughness) for kind in SIZES}
    # Twice what tables as small as these err.
    assert errors["brdf-4d"] < 0.008
    assert errors["brdf-5d"] < 0.016
    assert min(errors["brdf-3d"], errors["cone-lobe"], errors["cone-cone"]) > 2 * errors["brdf-4d"]


def test_bent_normals_out_of_the_plane(methods):
    """Four coordinates take them for some that are in it, with an error; five know all three angles."""
    roughness = RNG.uniform(0.1, 1, CAMERA.shape)
    g, ao = leaning(RNG.choice([-1, 1], CAMERA.shape) * np.pi / 2)
    errors = {kind: rms(methods, kind, g, ao, roughness) for kind in SIZES}
    assert errors["brdf-5d"] < 0.016
    assert errors["brdf-5d"] < errors["brdf-4d"] < errors["brdf-3d"]


def test_the_shipped_tables(methods):
    """By default; nearer to quadrature than small ones, also where the closure costs something."""
    roughness = RNG.uniform(0.1, 1, CAMERA.shape)
    named = {kind: gtao.ConeTable(table=shipped(kind)) for kind in ("brdf-4d", "brdf-5d", "cone-cone")}
    for azimuth in (0, np.pi / 2, np.pi):
        g, ao = leaning(np.full(CAMERA.shape, azimuth))
        for kind in ("brdf-4d", "brdf-5d"):
            assert rms(methods | named, kind, g, ao, roughness) < 1.2 * rms(methods, kind, g, ao, roughness)
        same = [gtao.specular_occlusion(ao, g, roughness, method=m).numpy() for m in (None, named["brdf-4d"])]
        assert np.array_equal(*same)
        pair = named["cone-cone"], gtao.ConeCone()
        cones = [gtao.specular_occlusion(ao, g, roughness, method=m).numpy() for m in pair]
        # A few times what the table errs over all cones.
        assert np.sqrt(np.mean((cones[0] - cones[1]) ** 2)) < 1e-3
    A, B = np.moveaxis(gtao.environment_brdf(g, roughness).numpy(), -1, 0)
    want = tables.hemisphere_terms(roughness**2, np.arccos(cosines(g))).values
    assert np.stack([A, B], axis=-1) == pytest.approx(want, abs=2e-3)


def test_open_surfaces_reflect_all(methods):
    """To the error of quadrature and tables; cones and lobes about the reflected direction dip below the horizon."""
    v = oracle.view_directions(CAMERA)
    n = unit(v + RNG.uniform(0, 0.95, (*CAMERA.shape, 1)) * unit(RNG.standard_normal(v.shape)))
    g, ao = frame(n, 2 / 3 * n, np.ones(CAMERA.shape))
    roughness = RNG.uniform(0, 1, CAMERA.shape)
    flat = {"lagarde": gtao.Lagarde2014(), "visibility": gtao.VisibilityAsSpecular()}
    bounds = {"exact": 1e-5, "brdf-3d": 1e-6, "brdf-4d": 0.05, "brdf-5d": 0.09, "lagarde": 1e-12, "visibility": 1e-12}
    for name, bound in bounds.items():
        for f0 in (0.04, 1.0):
            S = gtao.specular_occlusion(ao, g, roughness, f0, (methods | flat)[name]).numpy()
            assert np.abs(S - 1).max() <= bound, name
    for name in ("cone-cone", "cone-lobe"):
        assert gtao.specular_occlusion(ao, g, 0.9, method=methods[name]).numpy().min() < 0.8


def test_reflectance_is_occlusion_times_the_environment_brdf(methods):
    g, ao = leaning(np.zeros(CAMERA.shape))
    roughness, f0 = RNG.uniform(0, 1, CAMERA.shape), RNG.uniform(0, 1, (*CAMERA.shape, 3))
    for method in methods.values():
        S = gtao.specular_occlusion(ao, g, roughness, f0, method).numpy()
        reflected = gtao.specular_reflectance(ao, g, roughness, f0, method).numpy()
        whole = reflected / np.where(S > 0, S, 1)
        # The same for all tables, and to their error for quadrature.
        A, B = np.moveaxis(tables.hemisphere_terms(roughness**2, np.arccos(cosines(g))).values, -1, 0)[..., None]
        assert whole[S > 1e-3] == pytest.approx((f0 * A + B)[S > 1e-3], abs=0.01)


def cosines(g):
    return np.sum(g.normal_v.numpy() * oracle.view_directions(CAMERA), axis=-1)
