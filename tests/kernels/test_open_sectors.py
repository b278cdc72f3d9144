"""Moments of open sectors against quadrature between their ends, for random masks and normals seen edge-on."""

from functools import cache

import numpy as np
import pytest
from oracles import bitmask_oracle, slice_oracle

import drjit as dr  # isort: skip

from gtao.kernels import bitmask, open_sectors, slices
from gtao.kernels.visible_arc import beside_zenith, visible_arc

# A frame bends normals until n_V is a thousandth.
EDGE_ON = np.pi / 2 - 1.1e-3


def random_masks(n, n_lanes=40, seed=5):
    """(bits, n_V, n_T): sectors closed one by one and in runs, all or none; normals up to edge-on, of any length."""
    rng = np.random.default_rng(seed)
    bits = rng.random((n_lanes, n)) < rng.random((n_lanes, 1))
    bits[::2] = (np.arange(n) < rng.integers(0, n, (n_lanes, 1)))[::2]
    bits[1], bits[2], bits[3], bits[4] = False, True, np.arange(n) == 0, np.arange(n) == n - 1
    gamma, length = rng.uniform(-1.5, 1.5, n_lanes), rng.uniform(0.05, 1.0, n_lanes)
    gamma[:10] = np.repeat([EDGE_ON, -EDGE_ON], 5)
    gamma[10:13] = 0.0
    return bits, length * np.cos(gamma), length * np.sin(gamma)


def words_of(bits, UInt):
    """Masks of up to 32 bits."""
    columns = range(0, bits.shape[1], 32)
    return tuple(UInt([sum(1 << int(k) for k in np.flatnonzero(row[i : i + 32])) for row in bits]) for i in columns)


def moments(precision, weighting, order, nV, nT, bits):
    nV, nT = precision.lanes(nV), precision.lanes(nT)
    start = slices.clamped_start(nV, nT)
    closed, n = words_of(bits, precision.types.UInt), bits.shape[1]
    arguments = (nV, nT, start, *bitmask.slice_map(weighting, nV, nT, start), closed, n)
    return np.array([np.array(v, dtype=np.float64) for v in open_sectors.open_moments(weighting, order, *arguments)])


@cache
def by_quadrature(weighting, n):
    """t0, t1, ss and sc of the open sectors of :func:`random_masks`, slices with V = z and T = x."""
    bits, nV, nT = random_masks(n)
    found = []
    for lane, closed in enumerate(bits):
        sl = bitmask_oracle.Slice(np.eye(3)[2], np.eye(3)[0], nV[lane], nT[lane], weighting, 1.0, [])
        found.append(sum((sl.integrals(*run) for run in bitmask_oracle.open_runs(closed)), start=np.zeros(13)))
    return np.array(found).T[[1, 3, 4, 6]]


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
@pytest.mark.parametrize("n", [5, 31, 32, 96])
def test_random_masks(precision, n, weighting):
    bits, nV, nT = random_masks(n)
    want = by_quadrature(weighting, n)
    got = moments(precision, weighting, 2, nV, nT, bits)
    # Single precision rounds as many ends as there are, and its guess is off by 1.2e-6 for a few of them.
    tolerance = 1e-12 if precision.name == "float64" else 3e-6
    assert got == pytest.approx(want, abs=tolerance)
    assert np.abs(want).max() > 0.5
    assert moments(precision, weighting, 1, nV, nT, bits) == pytest.approx(got[:2], abs=1e-7)


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
def test_nothing_is_open_or_all(precision, weighting):
    """Exactly 0 without an open sector, and exactly what the horizon search sums up without an occluder."""
    nV, nT = precision.lanes([0.7, 0.02, 1.0]), precision.lanes([0.3, -0.9, 0.0])
    for n in (12, 64):
        everything = moments(precision, weighting, 2, nV, nT, np.ones((3, n), dtype=bool))
        assert (everything == 0).all()
        nothing = moments(precision, weighting, 2, nV, nT, np.zeros((3, n), dtype=bool))
        start = slices.clamped_start(nV, nT)
        assert np.array_equal(nothing, [np.array(v) for v in visible_arc(weighting, 2, nV, nT, start)[1:]])


def test_without_the_cosine_moments_along_the_normal_have_it(precision):
    """⟨N, ½ ∫ ω⟩ = ½ ∫ ⟨N, ω⟩ and Nᵀ (½ ∫ ω ωᵀ) N = ½ ⟨N, ∫ ⟨N, ω⟩ ω⟩ of the same arc, a run of open sectors."""
    n, runs = 32, ((3, 20), (0, 9), (17, 32), (11, 12))
    bits = np.array([(np.arange(n) < first) | (np.arange(n) >= last) for first, last in runs])
    gamma = np.array([0.4, -0.9, 1.2, 0.0])
    nV, nT = 0.8 * np.cos(gamma), 0.8 * np.sin(gamma)
    t0, t1, ss, sc = moments(precision, "uniform", 2, nV, nT, bits)
    cc = 1 - bits.mean(axis=1) - ss
    # U(θ) = ± (1 - cos θ) at the ends of the run.
    u = 2 * np.array(runs) / n - 1 + np.sin(gamma)[:, None]
    theta = np.sign(u) * np.arccos(1 - abs(u))
    arcs = [slice_oracle.arc(a, b, *ends) for a, b, ends in zip(nV, nT, theta, strict=True)]
    assert 2 * (nV * t1 + nT * t0) == pytest.approx([arc.cosine for arc in arcs], abs=precision.tolerance)
    expected = nV * [arc.t1 for arc in arcs] + nT * [arc.t0 for arc in arcs]
    assert 2 * (nV**2 * cc + 2 * nV * nT * sc + nT**2 * ss) == pytest.approx(expected, abs=precision.tolerance)


def test_an_end_holds_what_was_asked_for(precision):
    """With what is lacking at it, and without: from nothing to all of either side."""
    gamma = np.repeat([-EDGE_ON, -1.2, -0.3, 0.0, 0.4, 1.3, EDGE_ON], 40)
    part = np.tile(np.concatenate([np.geomspace(1e-6, 0.05, 15), np.linspace(0.06, 1, 25)]), 7)
    nV, nT = precision.lanes(np.cos(gamma)), precision.lanes(np.sin(gamma))
    c = slices.clamped_start(nV, nT)[1]
    full = visible_arc("cosine", 0, nV, nT, (precision.Float(1), c))[0]
    y = full * precision.lanes(part)
    end = open_sectors.cosine_end(y, nV, nT, open_sectors.Side.of(nV, nT, c, full))
    held = np.array(visible_arc("cosine", 0, nV, nT, (precision.Float(1), end.c))[0])
    tolerance = 1e-14 if precision.name == "float64" else 5e-7
    assert held + np.array(end.lacking) == pytest.approx(np.array(y), abs=tolerance)
    # The guess alone is within 1.2 % of the unit; what three Newton steps leave counts by its third power.
    assert np.abs(end.lacking).max() < (1e-11 if precision.name == "float64" else 0.013)
    assert np.hypot(end.c, end.s) == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
def test_moments_beside_the_zenith_are_those_of_an_arc(precision, weighting):
    theta = precision.lanes(np.linspace(0.01, 3.0, 30))
    s, c = dr.sincos(theta)
    nV, nT = precision.Float(0.6), precision.Float(0.3)
    got = np.array([np.array(v) for v in beside_zenith(weighting, 2, nV, nT, c, s)])
    want = np.array([np.array(v) for v in visible_arc(weighting, 2, nV, nT, (precision.Float(1), c))[1:]])
    assert got == pytest.approx(want, abs=precision.tolerance)
