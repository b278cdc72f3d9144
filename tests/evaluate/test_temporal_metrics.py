"""Metrics of sequences, on synthetic ones whose flicker, ghosts and settling are known in closed form."""

import math

import numpy as np
import pytest

from gtao import evaluate
from gtao.errors import ConfigError, ShapeError

SHAPE = (64, 64)
N_PIXELS = SHAPE[0] * SHAPE[1]


def _noise(seed, n, sigma, shape=SHAPE):
    return np.random.default_rng(seed).normal(0.0, sigma, (n, *shape))


# Flicker


def test_alternating_values_have_a_known_flicker():
    # ±a in turn: deviations of a from the mean, n a² / (n - 1); each step is 2a.
    frames = [np.full((2, 3), 0.5 + (0.1 if t % 2 else -0.1)) for t in range(6)]
    result = evaluate.flicker(frames)
    assert result.deviation == pytest.approx(0.1 * math.sqrt(6 / 5))
    assert result.step == pytest.approx(0.2)
    assert (result.n_deviation, result.n_step) == (6 * 5, 6 * 5)


def test_bias_and_pixels_outside_the_mask_do_not_flicker():
    static = np.zeros((4, 4), bool)
    static[:2] = True
    bias = np.random.default_rng(0).random((4, 4))
    restless = [np.where(static, bias, np.nan if t % 2 else 1.0) for t in range(5)]
    result = evaluate.flicker(restless, static)
    # Exactly 0 for the very same values; Welford's mean of them differs from each by its rounding.
    assert result.deviation == pytest.approx(0.0, abs=1e-15)
    assert result.step == 0.0


def test_independent_noise_is_measured_with_its_deviation():
    result = evaluate.flicker(0.5 + _noise(1, 20, 0.03))
    # N variances of 19 degrees of freedom: a relative standard error of the deviation of 1 / √(2 · 19 N) = 0.25 %.
    assert result.deviation == pytest.approx(0.03, rel=0.012)
    assert result.step == pytest.approx(0.03 * math.sqrt(2), rel=0.012)


def test_an_exponential_average_flickers_less_and_steps_less_still():
    # x' = (1 - a) x + a ξ: variance a / (2 - a), steps 2 a² / (2 - a).
    a, value, frames = 0.1, np.zeros(SHAPE), []
    for xi in _noise(2, 400, 1.0):
        value = (1 - a) * value + a * xi
        frames.append(value)
    result = evaluate.flicker(frames[100:])
    # 300 frames are 300 a / 2 = 15 times of memory: the mean takes off Var (2/a) / 300 of the variance.
    expected = a / (2 - a) * (1 - (2 / a - 1) / 300)
    assert result.deviation == pytest.approx(math.sqrt(expected), rel=0.01)
    assert result.step == pytest.approx(math.sqrt(2 * a**2 / (2 - a)), rel=0.01)


def test_the_truths_noise_and_its_changes_are_taken_out():
    own, of_truth = _noise(3, 20, 0.02), _noise(4, 20, 0.05)
    moving = 0.5 + 0.3 * np.sin(np.arange(20))[:, None, None] * np.linspace(0, 1, SHAPE[1])
    variances = np.full((20, *SHAPE), 0.05**2)
    result = evaluate.flicker(moving + own, truths=moving + of_truth, variances=variances)
    # The noise of the sum, 0.054, leaves a variance with a relative error of (0.054 / 0.02)² √(2 / (19 N)) = 3.7 %.
    assert result.deviation == pytest.approx(0.02, rel=0.06)
    assert result.step == pytest.approx(0.02 * math.sqrt(2), rel=0.06)
    assert evaluate.flicker(moving + own, truths=moving + of_truth).deviation > 0.05


def test_noise_that_all_truths_share_is_not_taken_off():
    scores = evaluate.TemporalScores()
    truth = 0.5 + _noise(5, 1, 0.05)[0]
    for x in 0.5 + _noise(6, 10, 0.02):
        scores.add(x, truth, np.full(SHAPE, 0.05**2))
    result = scores.result()["flicker"]
    assert result["deviation"] == pytest.approx(0.02, rel=0.02)
    assert result["step"] == pytest.approx(0.02 * math.sqrt(2), rel=0.02)


def test_noise_of_pixels_that_the_surface_leaves_is_taken_off():
    # The truth's noise belongs to the pixel, and the surface moves right by two of them.
    of_pixels, own = _noise(17, 1, 0.05)[0], _noise(18, 10, 0.02)
    motion = np.broadcast_to([2.0, 0.0], (*SHAPE, 2))
    meter = evaluate.FlickerMeter(shared_noise=True)
    for x in own:
        meter.add(0.5 + x, 0.5 + of_pixels, np.full(SHAPE, 0.05**2), motion=motion)
    # The same 3968 differences of the truth nine times: (0.05 / 0.02)² √(2 / 3968) = 14 % of the variance.
    assert meter.result().step == pytest.approx(0.02 * math.sqrt(2), rel=0.25)


def test_shared_noise_hides_no_trail_at_rest_and_makes_none_in_motion():
    noise = _noise(19, 1, 0.05)[0]
    variance = np.full(SHAPE, 0.05**2)
    motion = np.broadcast_to([2.0, 0.0], (*SHAPE, 2))
    inside, still = np.indices(SHAPE)[1] >= 2, np.zeros((*SHAPE, 2))
    # A change of 0.1 is less than four standard errors of the difference of independent truths, 0.28.
    for shared, expected in ((True, N_PIXELS), (False, 0)):
        tracker = evaluate.TrailTracker(3, shared_noise=shared)
        tracker.add(0.5 + noise, variance)
        assert abs(np.count_nonzero(tracker.add(0.6 + noise, variance)) - expected) <= (0 if shared else 20)
    tracker = evaluate.TrailTracker(3, shared_noise=True)
    tracker.add(0.5 + noise, variance)
    # Then the surface stops, but for one pixel: what it is compared with still comes from another pixel.
    still[0, 0] = 1.0
    for moves in (motion, still):
        assert np.count_nonzero(tracker.add(0.5 + noise, variance, motion=moves)[inside]) <= 4


def test_variances_of_the_mean_are_taken_out_of_short_runs_too():
    # With masks that break each run after three frames: nothing is left but the image's own noise.
    meter = evaluate.FlickerMeter()
    own, of_truth = _noise(7, 40, 0.03), _noise(8, 40, 0.03)
    for t in range(40):
        meter.add(own[t], of_truth[t], np.full(SHAPE, 0.03**2), mask=np.full(SHAPE, t % 4 != 3))
    result = meter.result()
    assert result.n_deviation == 10 * 2 * N_PIXELS
    # Error as above: 2 √(2 / (20 N)) of the variance.
    assert result.deviation == pytest.approx(0.03, rel=0.02)
    assert result.step == pytest.approx(0.03 * math.sqrt(2), rel=0.02)


def test_steps_follow_the_motion():
    # A pattern that moves by three pixels right and one down per frame is calm along its motion, and not in place.
    wide = np.random.default_rng(9).random((80, 80))
    frames = [wide[20 - t : 50 - t, 30 - 3 * t : 60 - 3 * t] for t in range(6)]
    motion = np.broadcast_to([3.0, 1.0, 0.2], (30, 30, 3))
    along, in_place = evaluate.FlickerMeter(), evaluate.FlickerMeter()
    for frame in frames:
        along.add(frame, motion=motion)
        in_place.add(frame)
    assert along.result().step == 0.0
    assert along.result().n_step == 5 * 29 * 27
    assert math.isnan(along.result().deviation)
    # Differences of independent uniform numbers: a variance of 2/12, of 5 · 900 pixels.
    assert in_place.result().step == pytest.approx(math.sqrt(1 / 6), rel=0.05)


@pytest.mark.parametrize("axis", [0, 1], ids=["right and left", "down and up"])
@pytest.mark.parametrize("way", [1, -1])
def test_nothing_is_compared_with_what_lay_beyond_an_edge(axis, way):
    # By two pixels: the two rows or columns that come in have no past, and the rest of 8 does.
    motion = np.zeros((8, 8, 2))
    motion[..., axis] = 2.0 * way
    meter = evaluate.FlickerMeter()
    for t in range(3):
        meter.add(np.full((8, 8), float(t)), motion=motion)
    assert meter.result().n_step == 2 * 6 * 8
    assert meter.result().step == 1.0


@pytest.mark.parametrize(("speed", "rests"), [(0.0005, True), (0.002, False), (0.5, False)])
def test_rest_is_less_than_a_thousandth_of_a_pixel_per_frame(speed, rests):
    # What creeps changes all the same, from surface to surface: it enters the steps, not the variance in place.
    motion = np.zeros((4, 4, 2))
    motion[..., 0], motion[..., 1] = 0.6 * speed, -0.8 * speed
    meter = evaluate.FlickerMeter()
    for t in range(4):
        meter.add(np.full((4, 4), 0.1 * (t % 2)), motion=motion)
    assert meter.result().n_deviation == (3 * 16 if rests else 0)
    assert meter.result().n_step == 3 * 16


def test_flicker_refuses():
    with pytest.raises(ShapeError, match="at least two frames, got 1"):
        evaluate.flicker([np.zeros((2, 2))])
    with pytest.raises(ShapeError, match="as many truths"):
        evaluate.flicker(np.zeros((3, 2, 2)), truths=np.zeros((2, 2, 2)))
    with pytest.raises(ShapeError, match="give truths too"):
        evaluate.flicker(np.zeros((3, 2, 2)), variances=np.zeros((3, 2, 2)))
    with pytest.raises(ShapeError, match=r"must have the shape \(2, 2\), got \(2, 3\)"):
        evaluate.flicker([np.zeros((2, 2)), np.zeros((2, 3))])
    with pytest.raises(ShapeError, match="not finite"):
        evaluate.flicker(np.full((3, 2, 2), np.nan))


# Trails


def test_a_trail_lasts_n_frames_and_knows_its_sign():
    truth = np.full((1, 4), 0.5)
    brighter, darker = truth.copy(), truth.copy()
    brighter[0, 1], darker[0, 2] = 0.9, 0.1
    both = np.where(brighter != truth, brighter, darker)
    trails = list(evaluate.trail_mask([truth, truth, both, both, both, both], 3))
    assert [t.tolist() for t in trails] == [[[0, 0, 0, 0]]] * 2 + [[[0, 1, -1, 0]]] * 3 + [[[0, 0, 0, 0]]]


def test_slow_changes_are_found():
    # By 0.004 per frame: past 0.02 every sixth frame.
    truths = [np.full((1, 1), 0.5 + 0.004 * t) for t in range(14)]
    found = [int(t[0, 0]) for t in evaluate.trail_mask(truths, 2, change=0.021)]
    assert found == [0, 0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 1]


def test_noise_of_the_truth_is_no_trail():
    truths = 0.5 + _noise(10, 3, 0.05)
    variances = np.full((3, *SHAPE), 0.05**2)
    *_, last = evaluate.trail_mask(truths, 2, variances=variances)
    # Of 4096 · 2 differences, one in 15 787 lies beyond four standard errors.
    assert np.count_nonzero(last) <= 4
    *_, last = evaluate.trail_mask(truths, 2)
    assert np.count_nonzero(last) > 0.5 * N_PIXELS


def test_trails_move_with_their_surface_and_begin_at_disocclusions():
    tracker = evaluate.TrailTracker(3)
    row = np.linspace(0.1, 0.9, 8)[None]
    motion = np.zeros((1, 8, 2))
    motion[..., 0] = 1.0
    assert not tracker.add(row).any()
    # Everything moves right by a pixel: what enters from the left is new, and darker than what was there; nothing else.
    moved = np.concatenate([[[0.0]], row[:, :-1]], axis=1)
    assert tracker.add(moved, motion=motion).tolist() == [[-1, 0, 0, 0, 0, 0, 0, 0]]
    moved = np.concatenate([[[0.0]], moved[:, :-1]], axis=1)
    assert tracker.add(moved, motion=motion).tolist() == [[1, -1, 0, 0, 0, 0, 0, 0]]
    fresh = np.zeros((1, 8), bool)
    fresh[0, 5] = True
    assert tracker.add(moved, disoccluded=fresh).tolist() == [[1, -1, 0, 0, 0, 1, 0, 0]]


def test_a_disocclusion_changes_what_stands_at_its_place():
    tracker = evaluate.TrailTracker(3)
    motion, fresh = np.zeros((1, 3, 2)), np.array([[False, True, False]])
    motion[..., 0] = 1.0
    tracker.add(np.array([[0.2, 0.8, 0.5]]))
    # Brighter than the 0.2 that came from the left, darker than the 0.8 that stood there.
    assert tracker.add(np.array([[0.2, 0.5, 0.8]]), motion=motion, disoccluded=fresh).tolist() == [[1, -1, 0]]


def test_trails_refuse():
    with pytest.raises(ConfigError, match="at least 1 frame"):
        evaluate.TrailTracker(0)
    with pytest.raises(ConfigError, match="positive"):
        evaluate.TrailTracker(3, change=0.0)
    with pytest.raises(ShapeError, match="motion must have"):
        evaluate.TrailTracker(3).add(np.zeros((2, 2)), motion=np.zeros((2, 2)))


# Ghosting


def _step_response(a, n=40, jump=0.4):
    """An exponential average whose truth jumps up at frame 10: its ghost is -jump (1 - a)^k."""
    truths = [np.full((3, 3), 0.3 + (jump if t >= 10 else 0.0)) for t in range(n)]
    value, frames = truths[0], []
    for y in truths:
        value = value + a * (y - value)
        frames.append(value)
    return frames, truths


def test_the_ghost_of_an_exponential_average():
    a, length = 0.1, 8
    frames, truths = _step_response(a)
    result = evaluate.ghosting(frames, truths, evaluate.trail_mask(truths, length))
    ghost = [-0.4 * (1 - a) ** (k + 1) for k in range(length)]
    assert result.behind == pytest.approx(np.mean(ghost))
    assert result.lag == pytest.approx(-np.mean(ghost))
    assert result.energy == pytest.approx(np.mean(np.square(ghost)))
    assert result.n_trail == 9 * length
    assert math.isnan(result.ahead)
    later = [-0.4 * (1 - a) ** (k + 1) for k in range(length, 30)]
    assert result.elsewhere == pytest.approx(np.sum(np.square(later)) / (40 - length))


def test_lag_has_the_same_sign_on_both_sides_of_an_occluder():
    frames, truths = _step_response(0.1, jump=-0.2)
    result = evaluate.ghosting(frames, truths, evaluate.trail_mask(truths, 8))
    assert result.ahead == pytest.approx(result.lag)
    assert result.lag > 0.05


def test_what_the_estimate_gets_wrong_by_itself_is_no_ghost():
    frames, truths = _step_response(0.1)
    plain = evaluate.ghosting(frames, truths, evaluate.trail_mask(truths, 8))
    biased = [x - 0.05 for x in frames]
    baselines = [y - 0.05 for y in truths]
    result = evaluate.ghosting(biased, truths, evaluate.trail_mask(truths, 8), baselines=baselines)
    assert result.lag == pytest.approx(plain.lag)
    # (g - b)² - b² for a ghost g and a bias b.
    assert result.energy == pytest.approx(plain.energy + 2 * -0.05 * plain.behind)
    unaccumulated = evaluate.ghosting(baselines, truths, evaluate.trail_mask(truths, 8), baselines=baselines)
    assert (unaccumulated.energy, unaccumulated.lag) == (0.0, 0.0)


@pytest.mark.parametrize("with_baseline", [False, True])
def test_noise_of_the_truth_drops_out_of_the_energy(with_baseline):
    truth, ghost = np.full((20, *SHAPE), 0.5), 0.05
    noisy = truth + _noise(11, 20, 0.1)
    frames, trail = truth - ghost, np.ones((20, *SHAPE))
    others = {"baselines": truth} if with_baseline else {"variances": np.full(truth.shape, 0.01)}
    result = evaluate.ghosting(frames, noisy, trail, **others)
    # Per pixel 2 ghost σ (and √2 σ² of the noise's square), over 82 000 of them: at most 6e-5.
    assert result.energy == pytest.approx(ghost**2, abs=2.4e-4)
    assert result.behind == pytest.approx(-ghost, abs=4 * 0.1 / math.sqrt(20 * N_PIXELS))


def test_ghosting_refuses():
    with pytest.raises(ShapeError, match="as many truths"):
        evaluate.ghosting([np.zeros((2, 2))] * 2, [np.zeros((2, 2))], [np.ones((2, 2))] * 2)
    with pytest.raises(ShapeError, match="not finite"):
        evaluate.ghosting([np.full((2, 2), np.nan)], [np.zeros((2, 2))], [np.ones((2, 2))])


# Settling


def test_convergence_of_a_geometric_error():
    # 0.02 + 0.5 · 0.8^k stays below 0.03 from 0.5 · 0.8^k <= 0.01 on: k = 18.
    errors = [0.02] * 7 + [0.02 + 0.5 * 0.8**k for k in range(80)]
    assert evaluate.convergence_frames(errors, 7, 0.5, level=0.02) == 18
    # The last quarter has settled at 0.02 within 0.5 · 0.8^60 = 1e-6.
    assert evaluate.convergence_frames(errors, 7, 0.5) == 18
    assert evaluate.convergence_frames(errors, 7, 0.0, level=0.01) is None
    assert evaluate.convergence_frames([0.1, 0.1, 0.1]) == 0


def test_convergence_waits_for_the_last_excess():
    assert evaluate.convergence_frames([1.0, 0.1, 0.5, 0.1, 0.1, 0.1], tolerance=0.2, level=0.1) == 3


def test_convergence_is_to_the_mean_of_the_last_quarter():
    # The last two of eight have a mean of 0.15, which 0.16 is near; it is not near the last frame alone.
    errors = [1.0, 0.5, 0.16, 0.16, 0.16, 0.16, 0.16, 0.14]
    assert evaluate.convergence_frames(errors) == 2
    # Of the four from a cut on the last one is the quarter, and three lie above it.
    assert evaluate.convergence_frames(errors, 4) == 3


@pytest.mark.parametrize(("cut", "errors"), [(3, [1.0, 2.0, 3.0]), (-1, [1.0]), (0, [1.0, math.nan]), (0, [-1.0])])
def test_convergence_refuses(cut, errors):
    with pytest.raises(ConfigError):
        evaluate.convergence_frames(errors, cut)


def test_drift_of_a_line_and_of_chance():
    assert evaluate.drift([5.0, 0.1, 0.2, 0.3, 0.4], 1) == pytest.approx((0.1, 0.0))
    # By hand: slope 1/2 and residuals ±(1, -2, 1)/6, whose squares sum to 1/6; one degree of freedom, t·t = 2.
    assert evaluate.drift([0.0, 0.0, 1.0]) == pytest.approx((0.5, math.sqrt(1 / 12)))
    z = []
    for seed in range(400):
        slope, error = evaluate.drift(np.random.default_rng(seed).normal(0.0, 1.0, 40))
        z.append(slope / error)
    # Student's with 38 degrees of freedom: a variance of 38 / 36, with a standard error of 7 % from 400 of them.
    assert np.var(z) == pytest.approx(38 / 36, rel=0.25)
    assert abs(np.mean(z)) < 4 / math.sqrt(400)
    with pytest.raises(ConfigError, match="three finite values"):
        evaluate.drift([1.0, 2.0, 3.0], 1)


# All of it


def _play(scores, frames, truths, start=0, stop=None):
    variance = np.full(SHAPE, 0.02**2)
    mask = np.ones(SHAPE, bool)
    mask[0] = False
    for x, y in list(zip(frames, truths, strict=True))[start:stop]:
        scores.add(x, np.where(mask, y, np.nan), variance, mask=mask)
    return scores


def test_scores_of_a_sequence_are_those_of_its_parts():
    truths = np.full((12, *SHAPE), 0.5)
    truths[6:, 20:30] = 0.8
    truths = truths + _noise(12, 12, 0.02)
    frames = 0.5 + _noise(13, 12, 0.03)
    # A change of 0.2 is seven standard errors of the truths' differences.
    result = _play(evaluate.TemporalScores(4, 0.2, shared_noise=False), frames, truths).result()
    # Standard errors as above; the 10 rows of the ghost enter the errors of all but not the flicker.
    assert result["flicker"]["deviation"] == pytest.approx(0.03, rel=0.04)
    assert result["rmse"][2] == pytest.approx(0.03, rel=0.1)
    assert result["rmse"][7] == pytest.approx(math.sqrt(0.03**2 + 10 / 63 * 0.3**2), rel=0.05)
    assert result["bias"][7] == pytest.approx(-0.3 * 10 / 63, abs=4 * 0.036 / math.sqrt(63 * 64))
    assert result["ghosting"]["behind"] == pytest.approx(-0.3, abs=4 * 0.036 / math.sqrt(4 * 640))
    assert result["ghosting"]["ahead"] is None
    assert result["ghosting"]["n_trail"] == 4 * 640


def test_scores_go_on_where_their_state_was_taken(tmp_path):
    frames, truths = 0.5 + _noise(14, 12, 0.03), 0.5 + _noise(15, 12, 0.1)
    through = _play(evaluate.TemporalScores(3, 0.1, shared_noise=False), frames, truths)
    half = _play(evaluate.TemporalScores(3, 0.1, shared_noise=False), frames, truths, 0, 5)
    np.savez(tmp_path / "scores.npz", **half.state())
    with np.load(tmp_path / "scores.npz") as state:
        resumed = evaluate.TemporalScores.from_state(state)
    _play(resumed, frames, truths, 5)
    assert resumed.result() == through.result()
    fresh = evaluate.TemporalScores.from_state(evaluate.TemporalScores(3, 0.1, shared_noise=False).state())
    assert _play(fresh, frames, truths).result() == through.result()
    with pytest.raises(ShapeError, match="no state of TemporalScores"):
        evaluate.TemporalScores.from_state({})
    with pytest.raises(ShapeError, match="no state of FlickerMeter"):
        evaluate.FlickerMeter.from_state({"x": 1})


def test_memory_does_not_grow_with_the_number_of_frames():
    scores = evaluate.TemporalScores()
    sizes = []
    for x in 0.5 + _noise(16, 30, 0.03, (16, 16)):
        scores.add(x, np.full((16, 16), 0.5))
        sizes.append(sum(a.nbytes for name, a in scores.state().items() if name not in ("rmse", "bias")))
    assert len(set(sizes[1:])) == 1
