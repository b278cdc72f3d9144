"""Importance sampling of slices: golden values, quadrature, inversion over all tilts, and what it estimates."""

import numpy as np
import pytest
from oracles import golden, slice_oracle

from gtao.kernels import arcs, slice_sampling
from gtao.kernels.visible_arc import visible_arc


def tilt(precision, Gamma):
    """cos Γ and sin Γ; π/2 is exactly edge-on."""
    Gamma = np.atleast_1d(Gamma)
    return precision.lanes(np.where(Gamma == np.pi / 2, 0, np.cos(Gamma))), precision.lanes(np.sin(Gamma))


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("A.slice_cdf"))
def test_cdf_golden(precision, inputs, outputs):
    got = slice_sampling.cdf(*tilt(precision, inputs["Gamma"]), precision.Float(inputs["phi"]))
    assert got[0] == pytest.approx(outputs["F"], abs=precision.tolerance)


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("A.slice_cdf_inverse"))
def test_inverse_golden(precision, inputs, outputs):
    got = slice_sampling.sample(*tilt(precision, inputs["Gamma"]), precision.Float(inputs["u"]))
    assert got[0] == pytest.approx(outputs["phi"], abs=precision.tolerance)


def test_cdf_against_quadrature_of_the_open_slice(precision):
    rng = np.random.default_rng(3)
    # Beyond 1.3 the density turns too sharply at π/2 for the oracle's 48 nodes.
    Gamma, phi = rng.uniform(0, 1.3, 40), rng.uniform(0, np.pi, 40)
    got = slice_sampling.cdf(*tilt(precision, Gamma), precision.lanes(phi))
    want = [slice_oracle.slice_density_cdf(*case) for case in zip(Gamma, phi, strict=True)]
    assert np.array(got) == pytest.approx(want, abs=precision.tolerance)


def test_density_against_quadrature_of_the_open_slice(precision):
    rng = np.random.default_rng(4)
    Gamma, phi = rng.uniform(0, np.pi / 2, 40), rng.uniform(0, np.pi, 40)
    got = slice_sampling.density(*tilt(precision, Gamma), precision.lanes(phi))
    want = [
        slice_oracle.clamped_cosine(np.cos(g), np.sin(g) * np.cos(p), -np.pi, np.pi) / np.pi
        for g, p in zip(Gamma, phi, strict=True)
    ]
    assert np.array(got) == pytest.approx(want, abs=precision.tolerance)


@pytest.mark.parametrize("Gamma", [0.0, 0.4, 1.0, 1.5, np.pi / 2])
def test_cdf_ends_at_0_and_1(precision, Gamma):
    got = slice_sampling.cdf(*tilt(precision, Gamma), precision.lanes([0, np.pi / 2, np.pi]))
    assert np.array(got) == pytest.approx([0, 0.5, 1], abs=precision.tolerance)


def grid():
    """Tilts up to edge-on, u with its ends and the middle, where an edge-on density vanishes."""
    Gamma = np.concatenate([np.linspace(0, np.pi / 2, 60), np.pi / 2 - np.logspace(-8, -1, 30)])
    u = np.concatenate([np.linspace(0, 1, 101), 0.5 - np.logspace(-12, -1, 30), np.logspace(-12, -2, 30)])
    return (v.ravel() for v in np.meshgrid(Gamma, u))


def closed_form(Gamma, phi):
    """F in float64 NumPy."""
    s, c = np.sin(phi), np.cos(phi)
    gamma = np.arctan2(np.sin(Gamma) * c, np.cos(Gamma))
    return (np.arctan2(np.cos(Gamma) * s, c) + gamma * np.sin(Gamma) * s) / np.pi


def test_inverse_over_all_tilts(precision):
    """F is met to its own rounding; the azimuth's error is larger by 1/F' = 1/p, which no method can help.

    Near Γ = π/2 the density vanishes at φ = π/2, where u determines φ only to the root of its own rounding.
    """
    Gamma, u = grid()
    phi = np.array(slice_sampling.sample(*tilt(precision, Gamma), precision.lanes(u)), dtype=np.float64)
    assert phi.min() >= 0
    # π in the precision at hand, which float32 rounds up.
    assert phi.max() <= np.array(np.pi, dtype=precision.name)
    error = np.abs(closed_form(Gamma, np.minimum(phi, np.pi)) - u).max()
    # The rounding of φ, of u and of the two terms of F, all of order one.
    assert error <= 4 * np.finfo(precision.name).eps


def test_inverse_is_exact_where_it_has_a_closed_form(precision):
    """Γ = 0: φ = π u. Γ = π/2: sin φ = 2 u on the first half, the mirror image on the second."""
    u = np.array([0.0, 0.1, 0.3, 0.45, 0.55, 0.8, 1.0])
    got = np.array(slice_sampling.sample(*tilt(precision, np.zeros(7)), precision.lanes(u)))
    assert got == pytest.approx(np.pi * u, abs=precision.tolerance)
    got = np.array(slice_sampling.sample(*tilt(precision, np.full(7, np.pi / 2)), precision.lanes(u)))
    half = np.arcsin(2 * np.minimum(u, 1 - u))
    assert got == pytest.approx(np.where(u <= 0.5, half, np.pi - half), abs=precision.tolerance)


@pytest.mark.parametrize("N", [(0.3, -0.5, 0.8), (0.9, 0.1, 0.3)])
def test_sampled_slices_estimate_visibility(precision, N):
    """The mean of arc / full arc over u is the visibility that even slices give, and each open slice is 1 by itself."""
    n, horizon = 4096, slice_oracle.harmonic_horizon(1.1, [(0.35, 1, -0.4), (0.2, 2, 0.0)])
    N, V = slice_oracle.unit(N), np.array([0.0, 0.0, 1.0])
    cosine, sine = N[2], np.hypot(N[0], N[1])
    u = precision.lanes((np.arange(n) + 0.5) / n)
    phi = np.array(slice_sampling.sample(precision.Float(cosine), precision.Float(sine), u), dtype=np.float64)
    nT = sine * np.cos(phi)
    gamma = np.arctan2(nT, cosine)
    # The horizon's azimuths count from x, the slice's from the normal.
    azimuth = phi + np.arctan2(N[1], N[0])
    h0, h1 = np.maximum(-horizon(azimuth + np.pi), gamma - np.pi / 2), np.minimum(horizon(azimuth), gamma + np.pi / 2)
    nV, nT = precision.Float(cosine), precision.lanes(nT)
    full = arcs.full_slice(nV, nT)
    share = np.array(
        visible_arc("cosine", 0, nV, nT, (precision.lanes(np.cos(h0)), precision.lanes(np.cos(h1))))[0] / full
    )
    assert share.min() >= 0
    assert share.max() <= 1 + precision.tolerance
    truth = slice_oracle.hemisphere(N, V, horizon).cosine
    # Midpoint rule over u of a periodic function with kinks: O(n^-2), a few 1e-7.
    assert share.mean(dtype=np.float64) == pytest.approx(truth, abs=max(precision.tolerance, 1e-6))
    ends = (precision.lanes(np.cos(gamma + side * np.pi / 2)) for side in (-1, 1))
    open_share = np.array(visible_arc("cosine", 0, nV, nT, tuple(ends))[0] / full)
    assert open_share == pytest.approx(1, abs=precision.tolerance)
