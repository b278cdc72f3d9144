"""Kernels of the temporal filter against loops written from the definitions, in both precisions, and golden values."""

import numpy as np
import pytest
from oracles import golden
from oracles import temporal as oracle
from scipy.spatial.transform import Rotation

from gtao.kernels import temporal
from gtao.kernels.filters import Grid, Image

import drjit as dr  # isort: skip  (after gtao, which chooses the LLVM library)

HEIGHT, WIDTH = 9, 11
# A few roundings of numbers of order one.
TOLERANCES = {"float64": 1e-13, "float32": 2e-6}


def image(precision, values):
    flat = precision.Float(np.ascontiguousarray(values, dtype=np.float64).ravel())
    return Image(flat, flat)


def grid_of(precision, shape=(HEIGHT, WIDTH)):
    return Grid.of(shape[1], shape[0], precision.types)


def floats(precision, values):
    return precision.lanes(np.ravel(values))


@pytest.mark.parametrize(("given", "expected"), golden.cases("G.temporal"))
def test_golden_history(precision, given, expected):
    """One row of four texels is the history, of which a pixel takes the given shares."""
    grid, n = grid_of(precision, (1, 4)), 4
    scale = 1 / (given["depth_scale"] * given["current_depth"])
    excess = floats(precision, (given["current_depth"] - np.array(given["previous_depth"])) / given["current_depth"])
    weights = temporal.depth_weight(excess, 1 / scale, precision.Float(0)).numpy()
    np.testing.assert_allclose(weights, expected["weights"], atol=precision.tolerance)
    taps = [
        temporal.HistoryTap(
            precision.types.UInt(i), precision.Float(given["bilinear"][i]), precision.Float(float(weights[i]))
        )
        for i in range(n)
    ]
    share, _ = temporal.steadiness(taps, image(precision, np.ones(n)), grid)
    history = (1 - share) * given["visibility"] + temporal.mix(taps, image(precision, given["history"]), grid)
    assert history[0] == pytest.approx(expected["history"], abs=precision.tolerance)
    widening = given["velocity_weight"] * given["window_size"]
    low, high = precision.Float(given["min"]), precision.Float(given["max"])
    assert temporal.clamped(history, low, high, widening)[0] == pytest.approx(
        expected["clamped"], abs=precision.tolerance
    )
    for end, value in (("lo", -9.0), ("hi", 9.0)):
        found = temporal.clamped(precision.Float(value), low, high, widening)[0]
        assert found == pytest.approx(expected[end], abs=precision.tolerance)


def test_trust_falls_in_both_directions_by_their_own_slopes(precision):
    rng = np.random.default_rng(0)
    expected, found = rng.uniform(1, 2, 200), rng.uniform(1, 2, 200)
    want = [oracle.depth_weight(a, b, 0.3, 0.4) for a, b in zip(expected, found, strict=True)]
    got = temporal.depth_weight(floats(precision, (expected - found) / expected), 1 / 0.3, 1 / 0.4).numpy()
    np.testing.assert_allclose(got, want, atol=TOLERANCES[precision.name])
    assert 0 < np.mean(np.equal(want, 0)) < 0.5
    # Farther history stays where there is no limit, however far; the result is no NaN.
    assert temporal.depth_weight(precision.Float(-1e6), precision.Float(10), precision.Float(0))[0] == 1


def test_clamp_bounds_leave_out_what_is_no_surface(precision):
    rng = np.random.default_rng(1)
    z, v = rng.uniform(1, 2, (HEIGHT, WIDTH)), rng.random((HEIGHT, WIDTH))
    z[rng.random(z.shape) < 0.3] = np.inf
    z[4, 5] = 1.5
    surface = np.isfinite(z)
    poisoned = np.where(surface, v, 1e6)
    low, high = temporal.low_passed_bounds(image(precision, poisoned), image(precision, z), grid_of(precision))
    means = np.array([oracle.block_means(v, z, y, x) for y, x in np.argwhere(surface)])
    for got, want in ((low, means.min(axis=1)), (high, means.max(axis=1))):
        np.testing.assert_allclose(got.numpy()[surface.ravel()], want, atol=TOLERANCES[precision.name])
    # What is not finite counts as no surface.
    v[4, 4] = np.nan
    low, high = temporal.low_passed_bounds(image(precision, v), image(precision, z), grid_of(precision))
    surface[4, 4] = False
    assert np.isfinite(low.numpy()[surface.ravel()] + high.numpy()[surface.ravel()]).all()


def test_the_clamp_moves_toward_the_frame_by_a_share(precision):
    history, kept = floats(precision, [0, 0, 0, 1, 0.5, 0]), floats(precision, [0.25, 0, 2, 0.5, 0.6, -1])
    current = floats(precision, [1, 1, 1, 0, 0.5, 1])
    got = temporal.moved_share(history, kept, current).numpy()
    # Beyond the frame's value, where both are the same, and away from it: all, nothing, nothing.
    np.testing.assert_allclose(got, [0.25, 0, 1, 0.5, 0, 0], atol=1e-7)


def test_harmonics_turn_with_the_directions(precision):
    rng = np.random.default_rng(2)
    c, v = rng.standard_normal((20, 9)), rng.standard_normal((20, 3))
    turn = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()
    rows = [[precision.Float(float(x)) for x in row] for row in turn]
    tolerance = 5 * TOLERANCES[precision.name]
    got = temporal.turned_harmonics([floats(precision, c[:, k]) for k in range(9)], rows)
    np.testing.assert_allclose(
        np.stack([x.numpy() for x in got], -1), oracle.turned(c[:, None], turn)[:, 0], atol=tolerance
    )
    got = temporal.turned_vector([floats(precision, v[:, k]) for k in range(3)], rows)
    np.testing.assert_allclose(np.stack([x.numpy() for x in got], -1), v @ turn.T, atol=tolerance)


def test_the_mean_of_n_and_one_more_frame_is_the_mean_of_n_and_one(precision):
    n = np.arange(1.0, 40)
    variance, rate = floats(precision, 1 / n), 1 / 24
    alpha = temporal.blend(variance, precision.Float(0), rate, 1 / 8, 16.0)
    np.testing.assert_allclose(alpha.numpy(), np.maximum(1 / (n + 1), rate), rtol=1e-6)
    count = temporal.effective_count(alpha, variance).numpy()
    np.testing.assert_allclose(count[:23], n[:23] + 1, rtol=1e-6)
    # An exponential mean ends at the weight of 2 F - 1 frames.
    limit = floats(precision, [47.0])
    assert temporal.effective_count(precision.Float(rate), 1 / limit)[0] == pytest.approx(47, rel=1e-6)
    # In between the weight of a new frame rises linearly.
    alpha = temporal.blend(precision.Float(0), floats(precision, [0, 4, 16, 100]), rate, 1 / 8, 16.0).numpy()
    np.testing.assert_allclose(alpha, [rate, rate + (1 / 8 - rate) / 4, 1 / 8, 1 / 8], rtol=1e-6)


@pytest.mark.parametrize("wild", [1e30, -1e30, 2.0**20, np.nan, np.inf, -np.inf])
def test_motion_out_of_every_frame_reads_nothing(precision, wild):
    grid, n = grid_of(precision), HEIGHT * WIDTH
    z, count = image(precision, np.full(n, 2.0)), image(precision, np.ones(n))
    surface = temporal.predicted(z, precision.Float(0), True, False, grid)
    zero = precision.Float(0) + dr.zeros(precision.Float, n)
    for motion in ((zero + wild, zero), (zero, zero + wild)):
        taps = temporal.history_taps(motion, surface, z, count, precision.Float(10), precision.Float(0), grid)
        share, variance = temporal.steadiness(taps, count, grid)
        assert (share.numpy() == 0).all()
        assert (variance.numpy() == 1).all()
        assert (temporal.mix(taps, image(precision, np.full(n, np.nan)), grid).numpy() == 0).all()
        assert all((tap.index.numpy() < n).all() for tap in taps)
        weight = temporal.velocity_weight(temporal.motion_difference(motion, (count, count), grid), 4).numpy()
        assert ((weight == 0) | (np.isnan(wild) & (weight == 1))).all()
