"""The oracles of mean directions and harmonics: polynomials, closed forms, and marching against them."""

import numpy as np
import pytest
from oracles import closed_forms, fields, harmonics, heightfield, slice_oracle

WEIGHTINGS = ["cosine", "uniform"]


def directions(n=20, seed=3):
    return slice_oracle.unit(np.random.default_rng(seed).normal(size=(n, 3)))


def test_harmonics_are_the_polynomials():
    d = directions()
    x, y, z = d.T
    third, fifteenth = np.sqrt(3 / (4 * np.pi)), np.sqrt(15 / (4 * np.pi))
    want = [
        *(0 * x + np.sqrt(1 / (4 * np.pi)), third * y, third * z, third * x, fifteenth * x * y, fifteenth * y * z),
        *(np.sqrt(5 / (16 * np.pi)) * (3 * z * z - 1), fifteenth * x * z, fifteenth / 2 * (x * x - y * y)),
    ]
    assert harmonics.basis(d) == pytest.approx(np.stack(want, axis=-1), abs=1e-14)


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_a_cone_of_everything_is_the_hemisphere(weighting):
    """Kernels of the clamped cosine π, 2π/3, π/4 and of the hemisphere 2π, π, 0, about the axis."""
    N = directions()
    first, second = closed_forms.cone(N, 0.0, weighting)
    kernel = [np.pi, 2 * np.pi / 3, np.pi / 4] if weighting == "cosine" else [2 * np.pi, np.pi, 0]
    want = np.repeat(kernel, [1, 3, 5]) * harmonics.basis(N)
    assert harmonics.of_moments(first, second, weighting) == pytest.approx(want, abs=1e-13)
    assert first == pytest.approx((2 / 3 if weighting == "cosine" else 1 / 2) * N, abs=1e-14)


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_an_extruded_scene_without_walls_is_the_hemisphere(weighting):
    gamma = np.radians([0.0, 30.0, -75.0])
    got = closed_forms.profile_directions(np.full(3, -np.pi), np.full(3, np.pi), gamma, weighting)
    normal = np.stack([np.sin(gamma), 0 * gamma, np.cos(gamma)], axis=-1)
    for a, b in zip(got, closed_forms.cone(normal, 0.0, weighting), strict=True):
        assert a == pytest.approx(b, abs=1e-13)


def test_second_moments_have_the_visibility_as_their_trace():
    left, right, gamma = np.array([-0.3, -1.2]), np.array([1.0, 0.7]), np.array([0.2, -0.5])
    _, second = closed_forms.profile_directions(left, right, gamma)
    visibility = closed_forms.profile(left, right, gamma)
    assert np.trace(second, axis1=-2, axis2=-1) == pytest.approx(visibility, abs=1e-14)
    _, second = closed_forms.cone([0, 0, 1], 0.3, "uniform")
    assert np.trace(second) == pytest.approx(0.7, abs=1e-14)


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_marching_in_a_trench_finds_the_open_directions(weighting):
    """Within 4.5 standard errors, pooled over pixels; what is beyond the trench's ends (half of 400 pixels of 0.05)
    counts no more than its weight, times the largest value of a harmonic."""
    field = fields.walls(0.5, 1.0, 1.0, 1.5, n_px=60, pixel=0.05, length_px=400)
    x = field.plane_coordinates()[0][0]
    columns = np.flatnonzero((x > -0.5) & (x < 1.0))
    left, right = x[columns] + 0.5, 1.0 - x[columns]
    pixels = np.stack([np.full(len(columns), 200), columns], axis=1)
    got = heightfield.directional(field, pixels, n_rays=4096, surface="nearest", weighting=weighting)
    first, second = closed_forms.profile_directions(
        -np.arctan2(left, 1.0), np.arctan2(right, 1.5), np.zeros_like(left), weighting
    )
    ends = (left + 1.5 * right).max() / (2 * np.pi * 10**2) if weighting == "uniform" else 5e-4
    for value, error, want, largest in (
        (got.mean, got.mean_error, first, 1.0),
        (got.harmonics, got.harmonics_error, harmonics.of_moments(first, second, weighting), 2 * np.pi * 1.1),
    ):
        pooled = np.sqrt(np.mean(error**2, axis=0))
        assert (np.abs(value - want).max(axis=0) < 4.5 * pooled + largest * ends).all()
        assert (np.abs(np.mean(value - want, axis=0)) < 4.5 * pooled / np.sqrt(len(columns)) + largest * ends).all()
