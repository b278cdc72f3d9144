"""Shares and moments of slices with gaps, against quadrature; their derivatives against central differences."""

import math

import numpy as np
import pytest
from oracles import golden

import drjit as dr  # isort: skip

from gtao.kernels import slices
from gtao.kernels.visible_arc import visible_arc

HALF_PI = np.pi / 2


def random_gaps(n=40, seed=3):
    """(nV, nT, start, upper, lower) as cosines; every third slice has no gap."""
    rng = np.random.default_rng(seed)
    length, gamma = rng.uniform(0.05, 1.0, n), rng.uniform(-1.5, 1.5, n)
    start = np.stack([np.sin(gamma), -np.sin(gamma)])
    lower, upper = np.sort(rng.uniform(start, 1.0, (2, 2, n)), axis=0)
    lower[:, ::3] = start[:, ::3]
    return length * np.cos(gamma), length * np.sin(gamma), start, upper, lower


def integrals(weighting, nV, nT, start, upper, lower):
    """By Gauss-Legendre over the open arcs: above the horizon, and between the tangent plane and what hangs there."""
    x, w = np.polynomial.legendre.leggauss(60)
    total = np.zeros(5)
    for side, outward in enumerate((-1, 1)):
        for a, b in ((0.0, np.arccos(upper[side])), (np.arccos(lower[side]), np.arccos(start[side]))):
            t = 0.5 * (a + b) + 0.5 * (b - a) * x
            s, c = outward * np.sin(t), np.cos(t)
            density = nV * c + nT * s if weighting == "cosine" else 0.5
            parts = np.abs(s) * density * np.stack([np.ones_like(t), s, c, s * s, s * c])
            total += 0.5 * (b - a) * (parts * w).sum(-1)
    return total


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_gaps_against_quadrature(precision, weighting, order):
    nV, nT, start, upper, lower = random_gaps()
    lanes = precision.lanes
    ends = (tuple(map(lanes, pair)) for pair in (upper, lower, start))
    got = np.array([np.array(v) for v in visible_arc(weighting, order, lanes(nV), lanes(nT), *ends)])
    columns = zip(nV, nT, start.T, upper.T, lower.T, strict=True)
    want = np.array([integrals(weighting, *column) for column in columns]).T[: (1, 3, 5)[order]]
    assert got == pytest.approx(want, abs=precision.tolerance)


def test_slices_golden(precision):
    cases = [(i, o) for i, o in golden.cases("A.slice") if o["h0"] <= 0 <= o["h1"]]
    assert len(cases) >= 4
    nV, nT = (precision.lanes([i[k] for i, _ in cases]) for k in ("nV", "nT"))
    upper = tuple(precision.lanes([math.cos(o[k]) for _, o in cases]) for k in ("h0", "h1"))
    share, t0, t1, ss, sc = (np.array(v) for v in visible_arc("cosine", 2, nV, nT, upper))
    for got, name in ((share, "cos_arc_weighted"), (t0, "bT"), (t1, "bV"), (ss, "ss"), (sc, "sc"), (share - ss, "cc")):
        assert got == pytest.approx([o[name] for _, o in cases], abs=precision.tolerance)


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
@pytest.mark.parametrize("gaps", [False, True])
def test_derivatives(weighting, gaps):
    """By the normal, with the tangent plane that moves along, and by every end."""
    Float = dr.llvm.ad.Float64
    nV, nT, _, upper, lower = random_gaps(12, seed=8)
    values = [nV, nT, *upper, *lower]
    if gaps:
        # Where a gap is closed its lower end is the tangent plane.
        values = [v[np.arange(12) % 3 > 0] for v in values]

    def f(nV, nT, u0, u1, l0, l1):
        more = ((l0, l1), slices.clamped_start(nV, nT)) if gaps else ()
        return visible_arc(weighting, 2, nV, nT, (u0, u1), *more)

    for k, name in enumerate(("nV", "nT", "upper 0", "upper 1", "lower 0", "lower 1")[: 6 if gaps else 4]):
        eps = 1e-6
        high, low = ([v + sign * eps * (i == k) for i, v in enumerate(values)] for sign in (1, -1))
        differences = [
            (np.array(a) - np.array(b)) / (2 * eps)
            for a, b in zip(f(*map(Float, high)), f(*map(Float, low)), strict=True)
        ]
        arrays = [Float(v) for v in values]
        dr.enable_grad(arrays[k])
        results = f(*arrays)
        dr.forward(arrays[k])
        got = [np.array(dr.grad(r)) for r in results]
        # Without the cosine the normal only says where the tangent plane is.
        assert (np.abs(differences).max() > 0.01) == (k > 1 or gaps or weighting == "cosine")
        # Rounding of the differences.
        assert np.array(got) == pytest.approx(np.array(differences), abs=1e-8), name


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
def test_derivatives_are_finite_at_the_zenith(weighting):
    Float = dr.llvm.ad.Float
    c = Float(1.0, 1.0 + 1e-7, -1.0)
    dr.enable_grad(c)
    for m in range(5):
        value = visible_arc(weighting, 2, Float(0.6), Float(0.5), (c, c))[m]
        dr.backward(dr.sum(value), dr.ADFlag.ClearInterior)
        assert np.isfinite(np.array(dr.grad(c))).all()
        dr.set_grad(c, 0)
