"""Visibility bitmask: golden values, maps against quadrature, masks bit by bit, and what they estimate."""

import numpy as np
import pytest
from oracles import golden, slice_oracle

import drjit as dr  # isort: skip

from gtao.kernels import arcs, bitmask

SECTORS = range(1, 33)


def union_length(intervals):
    """Length of a union of intervals."""
    total, end = 0.0, -np.inf
    for a, b in sorted(intervals):
        total += max(b - max(a, end), 0.0)
        end = max(end, b)
    return total


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("A.bitmask"))
def test_bitmask_golden(precision, inputs, outputs):
    gamma, xi, n = precision.Float(inputs["gamma"]), precision.Float(inputs["xi"]), inputs["sectors"]
    mask, ends = precision.types.UInt(0), []
    for interval in inputs["occluded"]:
        x0, x1 = (bitmask.position(inputs["mode"], precision.Float(theta), gamma) for theta in interval)
        mask |= bitmask.sectors(x0, x1, xi, n)
        ends.append((x0[0], x1[0]))
    assert np.array(ends) == pytest.approx(np.array(outputs["cdf"]), abs=precision.tolerance)
    assert mask[0] == outputs["mask"]
    share = bitmask.visible_share(mask, n, precision.Float)
    assert share[0] == pytest.approx(outputs["visible_fraction"], abs=precision.tolerance)
    exact = 1 - union_length(ends)
    assert exact == pytest.approx(outputs["exact_visible_fraction"], abs=2 * len(ends) * precision.tolerance)


def share_below(mapping, theta, gamma):
    """What lies below θ of the hemisphere of γ, as the mapping measures it, by quadrature."""
    low, high = gamma - np.pi / 2, gamma + np.pi / 2
    if mapping == "angle":
        return (np.clip(theta, low, high) - low) / np.pi
    name = {"uniform": "uniform", "cosine": "cosine"}[mapping]
    below, all_ = (
        slice_oracle.arc(np.cos(gamma), np.sin(gamma), low, end) for end in (np.clip(theta, low, high), high)
    )
    return getattr(below, name) / getattr(all_, name)


@pytest.mark.parametrize("mapping", sorted(bitmask.MAPPINGS))
def test_position_is_the_share_below(precision, mapping):
    rng = np.random.default_rng(1)
    gamma, theta = rng.uniform(-np.pi / 2, np.pi / 2, 60), rng.uniform(-np.pi, np.pi, 60)
    gamma[:4], theta[:4] = (-np.pi / 2, np.pi / 2, 0, 0.3), (0.5, 0.5, 0, 0)
    got = np.array(bitmask.position(mapping, precision.lanes(theta), precision.lanes(gamma)))
    want = [share_below(mapping, t, g) for t, g in zip(theta, gamma, strict=True)]
    assert got == pytest.approx(want, abs=precision.tolerance)
    assert {0.0, 1.0} <= set(got)


@pytest.mark.parametrize("mapping", ["uniform", "cosine"])
def test_share_of_an_interval_is_that_of_its_arc(precision, mapping):
    """An open interval times the slice's weight is the arc that the horizon search integrates."""
    nV, nT, c0, c1 = (precision.Float(v) for v in (0.7, 0.3, 0.4, 0.1))
    gamma = dr.atan2(nT, nV)
    x0, x1 = (bitmask.position(mapping, theta, gamma) for theta in (-dr.acos(c0), dr.acos(c1)))
    weight, arc = {
        "uniform": (1, 0.5 * arcs.uniform_arc(c0, c1)),
        "cosine": (arcs.full_slice(nV, nT), arcs.cosine_arc(nV, nT, c0, c1)),
    }[mapping]
    assert (weight * (x1 - x0))[0] == pytest.approx(arc[0], abs=precision.tolerance)


@pytest.mark.parametrize("n", SECTORS)
def test_nothing_and_everything(precision, n):
    """Also with the jitter closest to 1, which rounds n + ξ up to the next integer."""
    xi = precision.lanes([0, 0.5, np.nextafter(np.array(1, dtype=precision.name), 0)])
    everything = bitmask.sectors(precision.Float(0), precision.Float(1), xi, n)
    assert list(everything) == [2**n - 1] * 3
    assert list(bitmask.visible_share(everything, n, precision.Float)) == pytest.approx(
        [0] * 3, abs=precision.tolerance
    )
    for x in (0.0, 0.3, 1.0):
        nothing = bitmask.sectors(precision.Float(x), precision.Float(x), xi, n)
        assert list(nothing) == [0] * 3
        assert list(bitmask.visible_share(nothing, n, precision.Float)) == [1] * 3


@pytest.mark.parametrize("n", SECTORS)
def test_a_bit_is_the_indicator_of_its_point(precision, n):
    """Bit k is set if (k + 1 - ξ)/n lies in the interval, whichever end comes first."""
    rng = np.random.default_rng(n)
    x0, x1, xi = rng.random((3, 50))
    masks = bitmask.sectors(precision.lanes(x0), precision.lanes(x1), precision.lanes(xi), n)
    points = (np.arange(n)[:, None] + 1 - xi) / n
    inside = (np.minimum(x0, x1) < points) & (points <= np.maximum(x0, x1))
    want = (inside * 2 ** np.arange(n, dtype=np.int64)[:, None]).sum(axis=0)
    # A point within rounding of an end may fall on either side.
    clear = (np.minimum(abs(points - x0), abs(points - x1)) > precision.tolerance).all(axis=0)
    assert clear.sum() > 40
    assert np.array_equal(np.array(masks)[clear], want[clear])


@pytest.mark.parametrize("n", [1, 5, 16, 32])
def test_union_is_unbiased_over_the_jitter(precision, n):
    """Overlapping, touching and separate intervals; the points of n sectors and m jitters are an even grid of n m."""
    intervals = [(0.05, 0.31), (0.2, 0.42), (0.42, 0.5), (0.7, 0.71), (0.9, 1.0)]
    m = 4000
    xi = precision.lanes((np.arange(m) + 0.5) / m)
    mask = dr.zeros(precision.types.UInt, m)
    for x0, x1 in intervals:
        mask |= bitmask.sectors(precision.Float(x0), precision.Float(x1), xi, n)
    share = np.mean(np.array(bitmask.visible_share(mask, n, precision.Float), dtype=np.float64))
    # Each of the 6 ends of the union misplaces at most one point of the grid.
    assert share == pytest.approx(1 - union_length(intervals), abs=6 / (n * m))
