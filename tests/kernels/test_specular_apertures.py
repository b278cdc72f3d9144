"""Apertures of cones about tilted axes: tilted ones, and those matched by solid angle, with their derivatives."""

import numpy as np
import pytest
from oracles import cones as oracle

import drjit as dr  # isort: skip

from gtao.kernels import cones

HALF = np.pi / 2


def solid_angle(alpha, beta):
    return oracle.moments([0, 0, 1], [np.sin(beta), 0, np.cos(beta)], alpha)[0] / (2 * np.pi)


def lanes_of(precision, A, beta):
    return [precision.lanes(x) for x in (A, np.cos(beta), np.sin(beta))]


def test_tilted_cones_that_are_whole_have_the_visibility(precision):
    beta = np.linspace(0, 1.4, 15)
    A = 0.9 * np.cos(beta) ** 3
    c = np.array(cones.tilted_aperture(precision.lanes(A), precision.lanes(np.cos(beta))), float)
    got = [oracle.energy(np.arccos(x), b) for x, b in zip(c, beta, strict=True)]
    assert got == pytest.approx(A, abs=precision.tolerance)


def test_tilted_cones_are_hemispheres_at_most(precision):
    A, cb = ([-0.1, 0.5, 0.51, 1.2, 0.5, 0.0, 0.5], [0.5, 0.5, 0.5, 1.0, 0.0, 0.0, -0.3])
    c = np.array(cones.tilted_aperture(precision.lanes(A), precision.lanes(cb)))
    assert c.tolist() == [1, 0, 0, 0, 0, 0, 0]


def cases():
    """All tilts and visibilities, also within 1e-8 of fully open, closed and where the cut begins."""
    share = np.concatenate([10.0 ** -np.arange(1, 9), np.linspace(0.1, 0.9, 17), 1 - 10.0 ** -np.arange(1, 9), [0, 1]])
    beta = np.concatenate([[0, 1e-6, 1e-3], np.linspace(0.01, HALF - 0.01, 40), [HALF]])
    least = 1 - np.sin(beta)[:, None]
    A = np.concatenate([least * share, least + (1 - least) * share]).ravel()
    return A, np.tile(np.repeat(beta, len(share)), 2)


def test_matched_by_solid_angle(precision):
    A, beta = cases()
    c = np.array(cones.matched_uniform_aperture(*lanes_of(precision, A, beta)), float)
    assert (np.abs(c) <= 1).all()
    some = np.random.default_rng(0).choice(len(A), 300, replace=False)
    got = np.array([solid_angle(np.arccos(c[k]), beta[k]) for k in some])
    assert got == pytest.approx(A[some], abs=precision.tolerance)


def test_derivatives_of_what_is_matched_by_solid_angle(precision):
    """Of the implicit function, against differences of the double-precision solution."""
    rng = np.random.default_rng(6)
    beta, A = rng.uniform(0.05, 1.4, 40), rng.uniform(0.02, 0.97, 40)
    Float = dr.float64_array_t(precision.Float)

    def solve(A, beta):
        return np.array(cones.matched_uniform_aperture(Float(A), Float(np.cos(beta)), Float(np.sin(beta))))

    by_A = (solve(A + 1e-6, beta) - solve(A - 1e-6, beta)) / 2e-6
    by_beta = (solve(A, beta + 1e-6) - solve(A, beta - 1e-6)) / 2e-6
    lanes = lanes_of(precision, A, beta)
    dr.enable_grad(*lanes)
    dr.backward(dr.sum(cones.matched_uniform_aperture(*lanes)))
    got = [np.array(dr.grad(x), float) for x in lanes]
    rel = 1e-3 if precision.name == "float32" else 1e-5
    assert got[0] == pytest.approx(by_A, rel=rel)
    assert got[2] * np.cos(beta) - got[1] * np.sin(beta) == pytest.approx(by_beta, rel=rel, abs=1e-4)


def test_derivatives_are_bounded(precision):
    A, beta = cases()
    A = np.concatenate([A, [-0.1, 1.1]])
    beta = np.concatenate([beta, [0.3, 0.3]])
    least = 1e-3 if precision.name == "float32" else 1e-6
    for f in (cones.matched_uniform_aperture, lambda A, cb, sb: cones.tilted_aperture(A, cb)):
        lanes = lanes_of(precision, A, beta)
        dr.enable_grad(*lanes)
        dr.backward(dr.sum(f(*lanes)))
        g = np.array([np.array(dr.grad(x)) for x in lanes])
        assert np.isfinite(g).all()
        # π over the least arc; half of the reciprocal of the least root, over the least cosine that is not 0.
        assert np.abs(g[0]).max() < 4 / least / min(np.cos(HALF - 0.01), 1)
        # Visibility beyond its ends says no more.
        assert (g[0, -2:] == 0).all()
