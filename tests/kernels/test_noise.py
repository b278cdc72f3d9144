"""Noise patterns: golden values, what the pattern promises, statistics of the white one."""

import numpy as np
import pytest
from _noise_terms import noise_terms
from oracles import golden
from scipy import stats

from gtao import backend
from gtao.kernels import noise

TYPES = backend.types_of(backend.default_float())
SIZE = 64


def image(name, frame_index=0, seed=0, size=SIZE, origin=(0, 0)):
    """Rotation and offset of a size x size window, as (y, x) arrays."""
    y, x = np.mgrid[:size, :size].astype(np.uint32)
    x, y = TYPES.UInt(x.ravel() + np.uint32(origin[0])), TYPES.UInt(y.ravel() + np.uint32(origin[1]))
    pair = noise.pattern(name, x, y, noise_terms(name, frame_index, seed, TYPES.UInt), TYPES.Float)
    return tuple(np.array(v, dtype=np.float64).reshape(size, size) for v in pair)


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("G.noise"))
def test_spatial_pattern_golden(inputs, outputs):
    rotation, offset = image("spatial_4x4", inputs["frame"], size=8)
    at = inputs["y"], inputs["x"]
    assert np.pi * rotation[at] == pytest.approx(outputs["slice_angle_pi"], abs=golden.FLOAT32_TOLERANCE)
    assert offset[at] == pytest.approx(outputs["combined_offset"], abs=golden.FLOAT32_TOLERANCE)
    turn, step, *_ = noise.frame_terms("spatial_4x4", inputs["frame"], 0)
    assert (turn, step) == pytest.approx((outputs["rotation"], outputs["temporal_offset"]), abs=1e-12)
    # The sixth frame adds nothing to the pattern in space, whose values float32 holds exactly.
    rotation, offset = image("spatial_4x4", 5, size=8)
    assert rotation[at] == outputs["direction_noise"] == outputs["direction_index"] / 16
    assert offset[at] == outputs["offset"]


@pytest.mark.parametrize("origin", [(0, 0), (1, 2), (3, 3)])
def test_every_window_of_16_pixels_holds_all_directions(origin):
    rotation, offset = image("spatial_4x4", frame_index=5, size=4, origin=origin)
    assert sorted(np.round(rotation * 16).astype(int).ravel()) == list(range(16))
    assert sorted(np.round(offset * 4).astype(int).ravel()) == sorted(4 * list(range(4)))


def test_a_cycle_has_48_directions_and_32_sample_positions():
    """Six rotations of a 22.5 degree grid over half a turn meet on one of 3.75 degrees; offsets repeat by quarters."""
    frames = [image("spatial_4x4", f, size=4) for f in range(24)]
    directions = np.round(np.stack([r for r, _ in frames]) * 48 * 16) % (48 * 16)
    assert len(np.unique(directions)) == 48
    offsets = np.unique(np.round(np.stack([o for _, o in frames]), 6))
    assert offsets == pytest.approx([0.0, 0.25, 0.5, 0.75])
    again = image("spatial_4x4", 24, size=4)
    assert np.array_equal(again, frames[0])


def test_no_noise_is_the_middle_of_slice_and_step():
    rotation, offset = image("none", frame_index=7, seed=3)
    assert (rotation == 0.5).all()
    assert (offset == 0.5).all()


@pytest.mark.parametrize("name", sorted(noise.PATTERNS))
def test_values_lie_in_the_half_open_unit_interval(name):
    for frame_index in (0, 1, 13, 1000):
        for values in image(name, frame_index, seed=2**32 - 1, origin=(4000, 7000)):
            assert values.min() >= 0.0
            assert values.max() < 1.0


@pytest.mark.parametrize("name", sorted(noise.PATTERNS))
def test_same_inputs_give_the_same_bits(name):
    assert np.array_equal(image(name, 3, 5), image(name, 3, 5))


def test_interleaved_gradient_formula():
    """frac(52.9829189 frac(0.06711056 x + 0.00583715 y)); single precision leaves 4 digits after the amplification."""
    y, x = np.mgrid[:SIZE, :SIZE].astype(np.float64)
    want = np.mod(52.9829189 * np.mod(0.06711056 * x + 0.00583715 * y, 1.0), 1.0)
    rotation, _ = image("interleaved_gradient")
    distance = np.abs(rotation - want)
    # The inner fraction is rounded to 2^-24 · 8 (its argument is below 8), then multiplied by 53.
    assert np.minimum(distance, 1 - distance).max() < 53 * 8 * 2.0**-24


def hilbert(level):
    """[y, x] -> number along the curve, put together from quarters: down, right, up."""
    if level == 0:
        return np.zeros((1, 1), dtype=np.int64)
    quarter = hilbert(level - 1)
    n = quarter.size
    anti_transposed = quarter[::-1, ::-1].T
    return np.block([[quarter.T, anti_transposed + 3 * n], [quarter + n, quarter + 2 * n]])


def test_hilbert_curve():
    y, x = np.mgrid[:130, :130].astype(np.uint32)
    index = noise.hilbert_index(TYPES.UInt(x.ravel()), TYPES.UInt(y.ravel()))
    got = np.array(index).reshape(130, 130)
    want = hilbert(6)
    assert np.array_equal(got, np.tile(want, (3, 3))[:130, :130])
    # Consecutive numbers are neighbours: it is a curve, and through every pixel.
    where = np.argsort(want.ravel())
    steps = np.abs(np.diff(where % 64)) + np.abs(np.diff(where // 64))
    assert (steps == 1).all()


@pytest.mark.parametrize("frame_index", [0, 1, 63, 64, 100])
def test_r2_sequence_along_the_curve(frame_index):
    """frac(1/2 + n (1/g, 1/g²)) with g³ = g + 1, in exact integer arithmetic on 64 bits."""
    g = np.roots([1, 0, -1, -1]).real.max()
    n = hilbert(6) + 288 * (frame_index % 64)
    got = image("hilbert_r2", frame_index)
    for values, step in zip(got, (1 / g, 1 / g**2), strict=True):
        distance = np.abs(values - np.mod(0.5 + n * step, 1.0))
        # Rounding of the step to 2^-32, times an index below 22240, and truncation to 2^-24.
        assert np.minimum(distance, 1 - distance).max() < 22240 * 2.0**-33 + 2.0**-24


def test_aligned_blocks_hold_consecutive_terms_of_the_sequence():
    """Each 4×4 block of the curve is a stretch of 16 numbers, so its terms are those of the first one, shifted."""
    for values in image("hilbert_r2"):
        blocks = np.sort(values.reshape(16, 4, 16, 4).transpose(0, 2, 1, 3).reshape(-1, 16), axis=1)
        gaps = np.sort(np.diff(blocks, axis=1, append=blocks[:, :1] + 1), axis=1)
        assert np.abs(gaps - gaps[0]).max() < 2.0**-16
        # White noise leaves a gap of more than a quarter in every fifth block, this in none.
        assert gaps.max() < 0.25


def test_cycled_gradient_noise_takes_the_turns_of_the_slides():
    """In space that of the first frame; over time the rotations and offsets of the 4×4 pattern."""
    rotation, offset = image("interleaved_gradient")
    for frame_index in (0, 7, 23):
        turn, step, *_ = noise.frame_terms("spatial_4x4", frame_index, 0)
        cycled = image("interleaved_gradient_cycled", frame_index)
        want = np.mod(rotation + turn, 1.0), np.mod(offset + step, 1.0)
        assert cycled[0] == pytest.approx(want[0], abs=2.0**-22)
        assert np.array_equal(cycled[1], want[1])


def test_white_noise_is_uniform_and_independent():
    """Fixed seeds, so the verdict never changes; each p-value is uniform if the generator is what it says."""
    p_values = []
    for seed, frame_index in ((0, 0), (0, 1), (1, 0)):
        rotation, offset = image("white", frame_index, seed)
        p_values += [stats.kstest(v.ravel(), "uniform").pvalue for v in (rotation, offset)]
        p_values.append(stats.pearsonr(rotation.ravel(), offset.ravel()).pvalue)
        p_values.append(stats.pearsonr(rotation[:, 1:].ravel(), rotation[:, :-1].ravel()).pvalue)
        p_values.append(stats.pearsonr(rotation[1:].ravel(), rotation[:-1].ravel()).pvalue)
    p_values.append(stats.pearsonr(image("white", 0, 0)[0].ravel(), image("white", 1, 0)[0].ravel()).pvalue)
    p_values.append(stats.pearsonr(image("white", 0, 0)[0].ravel(), image("white", 0, 1)[0].ravel()).pvalue)
    # 17 tests: the smallest p-value of honest noise is below 1e-4 once in 600 choices of seeds.
    assert min(p_values) > 1e-4
