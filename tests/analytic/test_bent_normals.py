"""Bent normals and directional occlusion of GTAO: against the height field itself, in the open, and under light."""

from functools import cache

import numpy as np
import pytest
from analytic import _tables
from analytic._frames import frame, pixels
from oracles import closed_forms, harmonics
from oracles.open_arcs import Slices

import gtao

WEIGHTINGS = ["cosine", "uniform"]
RADII = pytest.mark.parametrize("radius", [np.inf, 0.5], ids=["unlimited", "radius"])

#: Mean angle in degrees that bent normals may lie off the truth's where the visibility is above 0.05.
ANGLE = 0.5


def angles(a, b):
    """Between unit vectors, in degrees."""
    return np.degrees(2 * np.arcsin(np.clip(np.linalg.norm(a - b, axis=-1) / 2, 0, 1)))


def estimate(field, method, dtype=np.float32):
    return gtao.ambient_occlusion(frame(field, dtype), method)


def image(tensor):
    return tensor.numpy().astype(np.float64)


@cache
def truth(name, radius, weighting):
    """Bent normals, harmonics and visibility of 4096 rays per pixel."""
    rays = {"n_directions": 64, "rays_per_direction": 64}
    method = gtao.HeightfieldRayMarch(radius=radius, weighting=weighting, directional=True, **rays)
    ao = estimate(_tables.MARCHED[name](), method)
    return image(ao.bent_normal), image(ao.visibility_sh), image(ao.visibility)


@RADII
@pytest.mark.parametrize("weighting", WEIGHTINGS)
@pytest.mark.parametrize("name", _tables.MARCHED)
def test_dense_sampling_finds_the_truth(name, weighting, radius):
    """The rays' own noise is 0.05 to 0.2 degrees. The search begins one pixel away, and what is nearer than that hides
    grazing directions, for which the cosine has no weight but uniform weighting does.

    A harmonic is visibility times π or 2π and a factor of 1.1 at most. Visibility is held to 0.004 and without the
    cosine to twice as much.
    """
    field = _tables.MARCHED[name]()
    ao = estimate(field, gtao.GTAO(radius=radius, weighting=weighting, directional=True, **_tables.DENSE))
    bent, sh, visibility = truth(name, radius, weighting)
    seen = visibility > 0.05
    assert seen.mean() > 0.9
    error = angles(image(ao.bent_normal), bent)[seen]
    # As far off as that the normal itself would be.
    assert angles(field.normal_v, bent)[seen].mean() > max(0.5, 3 * error.mean())
    assert error.mean() < ANGLE
    difference = (image(ao.visibility_sh) - sh)[seen]
    target = 0.004 * np.pi if weighting == "cosine" else 0.008 * 2 * np.pi
    assert np.sqrt(np.mean(difference**2, axis=0)).max() < target
    # In the mean noise is nothing, and what is nearer than a pixel hides little.
    assert np.abs(difference.mean(axis=0)).max() < target / 4


@pytest.mark.parametrize("n_slices", [2, 16])
@pytest.mark.parametrize("tilt", _tables.TILTS)
def test_an_open_plane_has_its_own_normal(tilt, n_slices):
    """Anywhere in a field of view of 100 degrees, to single precision: an open slice has |n_p| t0 = 4/3 n_T and
    |n_p| t1 = 2/3 n_V, which two slices, or any more, average to 2/3 N."""
    for field in _tables.open_planes(tilt):
        ao = estimate(field, gtao.GTAO(n_slices=n_slices, n_steps=8, fetch="linear", bent_normal=True))
        assert np.linalg.norm(image(ao.bent_normal) - field.normal_v, axis=-1).max() < 5e-6
        assert image(ao.mean_direction) == pytest.approx(2 / 3 * field.normal_v, abs=5e-6)


@pytest.mark.parametrize("weighting", WEIGHTINGS)
@pytest.mark.parametrize("tilt", _tables.TILTS)
def test_an_open_plane_has_the_harmonics_of_its_hemisphere(tilt, weighting):
    """At 32 slices, which integrate the tilted tangent plane. Without the cosine rounded depth shows where horizons
    graze the plane: 2^-12 of a horizon's cosine."""
    for field in _tables.open_planes(tilt):
        method = gtao.GTAO(n_slices=32, n_steps=8, fetch="linear", directional=True, weighting=weighting)
        ao = estimate(field, method)
        want = harmonics.of_moments(*closed_forms.cone(field.normal_v, 0.0, weighting), weighting)
        close = 1e-5 if weighting == "cosine" else 5e-4
        assert np.abs(image(ao.visibility_sh) - want).max() < close
        assert np.linalg.norm(image(ao.bent_normal) - field.normal_v, axis=-1).max() < 1e-3


def test_the_average_horizon_is_a_baseline():
    """Off by many times as much, over bumps as on planes."""
    name = "waves from above"
    bent, _, visibility = truth(name, np.inf, "cosine")
    ao = estimate(_tables.MARCHED[name](), gtao.GTAO(bent_normal="average_horizon", **_tables.DENSE))
    assert 5 < angles(image(ao.bent_normal), bent)[visibility > 0.05].mean() < 30


SHAPES = ["bumps, tilted, perspective", "waves, stretched pixels, off-centre", "steep groove from above"]
SAMPLES = {"n_slices": 3, "n_steps": 7}


@RADII
@pytest.mark.parametrize("weighting", WEIGHTINGS)
@pytest.mark.parametrize("name", SHAPES)
def test_irradiance_is_that_of_the_same_horizons(name, weighting, radius):
    """Σ L V' under random light of bands 0 to 2 against Monte Carlo over the same few slices and samples, which knows
    the horizons and nothing else: within the noise of each pixel and light, and in the mean square."""
    field = _tables.MARCHED[name]()
    method = gtao.GTAO(radius=radius, weighting=weighting, directional=True, noise="none", step_exponent=1.0, **SAMPLES)
    g = frame(field, np.float64)
    ao = gtao.ambient_occlusion(g, method)
    rng = np.random.default_rng(7)
    light = rng.normal(size=(9, 4))
    got = image(ao.visibility_sh) @ light
    if weighting == "cosine":
        for k in range(4):
            assert image(gtao.irradiance(light[:, k], g, ao)) == pytest.approx(got[..., k], abs=1e-12)
    scores, sizes = [], []
    for row, column in pixels(field, 8):
        slices = Slices.of(field, row, column, radius=radius, **SAMPLES)
        want, error = slices.irradiance(lambda d: harmonics.basis(d) @ light, rng, weighting)
        scores.append((got[row, column] - want) / error)
        sizes.append(error / np.abs(want).mean())
    # The noise is small enough to see something: a thousandth of the light or two.
    assert np.mean(sizes) < 2e-3
    # Of 32 repetitions; one in 50000 is as far off by chance.
    assert np.abs(scores).max() < 5
    # Pixels are independent; the four lights share their rays, so that 8 to 32 squares count.
    assert 0.3 < np.mean(np.square(scores)) < 2.2
