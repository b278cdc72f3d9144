"""Visibility bitmask: golden values, maps against quadrature, masks bit by bit, and what they estimate."""

import numpy as np
import pytest
from oracles import bitmask_oracle, golden, slice_oracle

import drjit as dr  # isort: skip

from _noise_terms import noise_terms

from gtao.kernels import arcs, bitmask, noise, slices
from gtao.kernels.visible_arc import visible_arc

SECTORS = (*range(1, 33), 64, 128)


def slice_map(precision, mapping, gamma):
    """Constants of a slice whose normal lies at ``gamma``, both starts, and the weight."""
    gamma = precision.lanes(np.atleast_1d(gamma))
    q, c = dr.sincos(gamma)
    start = slices.clamped_start(c, q)
    constants, weight = bitmask.slice_map(mapping, c, q, start)
    return constants, start, weight


def position(precision, mapping, theta, gamma):
    """Positions of angles θ, one per lane, from the side that each lies on."""
    theta = np.atleast_1d(theta)
    constants, start, _ = slice_map(precision, mapping, np.broadcast_to(gamma, theta.shape))
    c = precision.lanes(np.cos(theta))
    minus, plus = (bitmask.position(mapping, constants, start[side], side, c) for side in (0, 1))
    return np.where(theta < 0, np.array(minus), np.array(plus))


def masks(precision, x0, x1, xi, n, **options):
    """Sectors of intervals as integers of n bits, one per lane, the ends in either order."""
    x0, x1 = (precision.lanes(np.atleast_1d(x)) for x in (x0, x1))
    words = bitmask.sectors(x0, x1, 1, xi, n, **options)
    return sum(np.array(word).astype(object) << (32 * i) for i, word in enumerate(words))


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("A.bitmask"))
def test_bitmask_golden(precision, inputs, outputs):
    xi, n = precision.Float(inputs["xi"]), inputs["sectors"]
    mask, ends = 0, []
    for interval in inputs["occluded"]:
        x0, x1 = position(precision, inputs["mode"], np.array(interval), inputs["gamma"])
        mask |= masks(precision, x0, x1, xi, n)[0]
        ends.append((x0, x1))
    assert np.array(ends) == pytest.approx(np.array(outputs["cdf"]), abs=precision.tolerance)
    assert mask == outputs["mask"]
    share = bitmask.visible_share((precision.types.UInt(mask),), n, precision.Float)
    assert share[0] == pytest.approx(outputs["visible_fraction"], abs=precision.tolerance)
    exact = 1 - bitmask_oracle.union_length(ends)
    assert exact == pytest.approx(outputs["exact_visible_fraction"], abs=2 * len(ends) * precision.tolerance)


def share_below(mapping, theta, gamma):
    """What lies below θ of the hemisphere of γ, as the mapping measures it, by quadrature."""
    low, high = gamma - np.pi / 2, gamma + np.pi / 2
    if mapping == "angle":
        return (np.clip(theta, low, high) - low) / np.pi
    below, all_ = (
        slice_oracle.arc(np.cos(gamma), np.sin(gamma), low, end) for end in (np.clip(theta, low, high), high)
    )
    return getattr(below, mapping) / getattr(all_, mapping)


@pytest.mark.parametrize("mapping", bitmask.MAPPINGS)
def test_position_is_the_share_below(precision, mapping):
    rng = np.random.default_rng(1)
    gamma, theta = rng.uniform(-np.pi / 2, np.pi / 2, 60), rng.uniform(-np.pi, np.pi, 60)
    gamma[:4], theta[:4] = (-1.5, 1.5, 0, 0.3), (0.5, 0.5, 0, 0)
    got = position(precision, mapping, theta, gamma)
    want = [share_below(mapping, t, g) for t, g in zip(theta, gamma, strict=True)]
    assert got == pytest.approx(want, abs=precision.tolerance)
    assert abs(got).min() < precision.tolerance
    assert abs(1 - got).min() < precision.tolerance


@pytest.mark.parametrize("mapping", bitmask.MAPPINGS)
def test_background_and_rounding_stay_in_the_hemisphere(precision, mapping):
    """NaN and -1 are the end of their side; a cosine that rounds to above 1 is the direction to the viewer."""
    constants, start, _ = slice_map(precision, mapping, 0.4)
    centre = position(precision, mapping, 0.0, 0.4)[0]
    for side in (0, 1):
        for c, want in ((np.nan, side), (-1.0, side), (1.0000001, centre)):
            got = bitmask.position(mapping, constants, start[side], side, precision.Float(c))
            assert got[0] == pytest.approx(want, abs=max(1e-6, precision.tolerance))


@pytest.mark.parametrize("mapping", ["uniform", "cosine"])
def test_share_of_an_interval_is_that_of_its_arc(precision, mapping):
    """An open interval times the slice's weight is the arc that the horizon search integrates."""
    nV, nT, c0, c1 = (precision.Float(v) for v in (0.7, 0.3, 0.4, 0.1))
    start = slices.clamped_start(nV, nT)
    constants, weight = bitmask.slice_map(mapping, nV, nT, start)
    x0, x1 = (bitmask.position(mapping, constants, start[side], side, c) for side, c in ((0, c0), (1, c1)))
    arc = {
        "uniform": visible_arc("uniform", 0, nV, nT, (c0, c1))[0],
        "cosine": visible_arc("cosine", 0, nV, nT, (c0, c1))[0],
    }[mapping]
    assert (weight * (x1 - x0))[0] == pytest.approx(arc[0], abs=precision.tolerance)
    full = {"uniform": precision.Float(1), "cosine": arcs.full_slice(nV, nT)}[mapping]
    assert weight[0] == pytest.approx(full[0], abs=precision.tolerance)


def highest_jitter(precision):
    """The number closest to 1, which rounds n + ξ up to the next integer."""
    return np.nextafter(np.array(1, dtype=precision.name), 0)


@pytest.mark.parametrize("n", SECTORS)
def test_nothing_and_everything(precision, n):
    xi = precision.lanes([0, 0.5, highest_jitter(precision)])
    everything = masks(precision, [0] * 3, [1] * 3, xi, n)
    assert list(everything) == [2**n - 1] * 3
    for x in (0.0, 0.3, 1.0):
        assert list(masks(precision, [x] * 3, [x] * 3, xi, n)) == [0] * 3
        assert list(masks(precision, [x] * 3, [x] * 3, xi, n, rounding="outward")) == [0] * 3
    for word, share in ((0, 1.0), (2 ** min(n, 32) - 1, 0.0)):
        words = tuple(precision.types.UInt(word) for _ in range(0, n, 32))
        got = bitmask.visible_share(words, n, precision.Float)
        assert got[0] == pytest.approx(share, abs=precision.tolerance)


@pytest.mark.parametrize("n", SECTORS)
def test_a_bit_is_the_indicator_of_its_point(precision, n):
    """Bit k is set if (k + 1 - ξ)/n lies in the interval, whichever end comes first; "nearest" has ξ = ½."""
    rng = np.random.default_rng(n)
    x0, x1, xi = rng.random((3, 50))
    for rounding, shift in (("jittered", xi), ("nearest", 0.5)):
        got = masks(precision, x0, x1, precision.lanes(xi), n, rounding=rounding)
        points = (np.arange(n)[:, None] + 1 - shift) / n
        inside = (np.minimum(x0, x1) < points) & (points <= np.maximum(x0, x1))
        # A point within rounding of an end may fall on either side.
        clear = (np.minimum(abs(points - x0), abs(points - x1)) > precision.tolerance).all(axis=0)
        assert clear.sum() > 40
        for lane in np.flatnonzero(clear):
            assert got[lane] == sum(1 << int(k) for k in np.flatnonzero(inside[:, lane]))


@pytest.mark.parametrize("n", [5, 32, 128])
@pytest.mark.parametrize("side", [0, 1])
def test_outward_closes_every_sector_begun(precision, n, side):
    """⌈n w⌉ sectors from the one in which the arc begins; the back is the farther end from the viewer."""
    rng = np.random.default_rng(n)
    front, back = np.sort(rng.random((2, 50)), axis=0) if side else np.sort(rng.random((2, 50)), axis=0)[::-1]
    words = bitmask.sectors(precision.lanes(front), precision.lanes(back), side, 0, n, "outward")
    got = sum(np.array(word).astype(object) << (32 * i) for i, word in enumerate(words))
    low, width = np.minimum(front, back), abs(front - back)
    first, count = np.floor(n * low).astype(int), np.ceil(n * width).astype(int)
    for lane in range(50):
        assert got[lane] == sum(1 << k for k in range(first[lane], min(first[lane] + count[lane], n)))


@pytest.mark.parametrize("n", [1, 5, 16, 32, 96])
def test_union_is_unbiased_over_the_jitter(precision, n):
    """Overlapping, touching and separate intervals; the points of n sectors and m jitters are an even grid of n m."""
    intervals = [(0.05, 0.31), (0.2, 0.42), (0.42, 0.5), (0.7, 0.71), (0.9, 1.0)]
    m = 4000
    xi = precision.lanes((np.arange(m) + 0.5) / m)
    words = tuple(dr.zeros(precision.types.UInt, m) for _ in range(0, n, 32))
    for x0, x1 in intervals:
        closed = bitmask.sectors(precision.Float(x0), precision.Float(x1), 1, xi, n)
        words = tuple(a | b for a, b in zip(words, closed, strict=True))
    share = np.mean(np.array(bitmask.visible_share(words, n, precision.Float), dtype=np.float64))
    # Each of the 6 ends of the union misplaces at most one point of the grid.
    assert share == pytest.approx(1 - bitmask_oracle.union_length(intervals), abs=6 / (n * m))


def test_jitter_is_even_and_differs_between_pixels_slices_and_keys(precision):
    UInt = precision.types.UInt
    y, x = np.divmod(np.arange(128 * 128), 128)
    x, y = precision.lanes(x), precision.lanes(y)
    images = {
        (index, key): np.array(bitmask.jitter(x, y, UInt(index), UInt(key))).reshape(128, 128)
        for index in (0, 1)
        for key in (0, 1)
    }
    # Standard deviations of a mean and of a correlation of 16384 even numbers: 0.29/128 and 1/128; 4.5 of them.
    for image in images.values():
        assert 0 < image.min() < 0.01
        assert 0.99 < image.max() < 1
        assert image.mean() == pytest.approx(0.5, abs=4.5 * 0.29 / 128)
        for shifted in (image[1:], image[:, 1:]):
            rest = image[: len(shifted), : shifted.shape[1]]
            assert abs(np.corrcoef(rest.ravel(), shifted.ravel())[0, 1]) < 4.5 / 127
    names = list(images)
    for i, a in enumerate(names):
        for b in names[:i]:
            assert abs(np.corrcoef(images[a].ravel(), images[b].ravel())[0, 1]) < 4.5 / 128


def test_jitter_is_independent_of_the_noise_of_slices_and_steps(precision):
    UInt, Float = precision.types.UInt, precision.Float
    y, x = np.divmod(np.arange(128 * 128), 128)
    xi = np.array(bitmask.jitter(precision.lanes(x), precision.lanes(y), UInt(0), UInt(7)))
    for name in noise.PATTERNS:
        terms = noise_terms(name, 0, 0, UInt)
        for values in noise.pattern(name, UInt(x.astype(np.uint32)), UInt(y.astype(np.uint32)), terms, Float):
            values = np.array(values)
            if values.std() > 0:
                assert abs(np.corrcoef(values, xi)[0, 1]) < 4.5 / 128
