"""Noise patterns: golden values, what the pattern promises, statistics of the white one."""

import numpy as np
import pytest
from _noise_terms import noise_terms
from oracles import golden, sobol
from scipy import stats

from gtao import backend
from gtao.data.blue_noise import mask_values
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
@pytest.mark.parametrize(
    ("name", "frame_index"), [("spatial_4x4", 5), ("spatial_4x4_fine", 0), ("spatial_4x4_spread", 0)]
)
def test_every_window_of_16_pixels_holds_all_directions(name, frame_index, origin):
    rotation, offset = image(name, frame_index, size=4, origin=origin)
    assert sorted(np.round(rotation * 16).astype(int).ravel()) == list(range(16))
    assert sorted(np.round(offset * 4).astype(int).ravel()) == sorted(4 * list(range(4)))


def distinct(values):
    """How many numbers modulo 1 there are; the patterns' are multiples of 1/192, rounded to single precision."""
    return len(np.unique(np.round(np.ravel(values) * 192).astype(int) % 192))


@pytest.mark.parametrize(
    ("name", "directions", "offsets"),
    [
        ("spatial_4x4", 48, 4),
        ("spatial_4x4_unbracketed", 12, 4),
        ("spatial_4x4_fine", 96, 16),
        ("spatial_4x4_spread", 96, 16),
    ],
)
def test_directions_and_sample_positions_of_a_cycle(name, directions, offsets):
    """Slices are lines: the rotation counts half turns. As printed, six rotations of a 22.5 degree grid meet on one of
    3.75 degrees and offsets repeat by quarters; the slides count 96 directions and 8 steps × 16 offsets."""
    frames = np.stack([image(name, f, size=8) for f in range(24)])
    assert distinct(frames[:, 0]) == directions
    n_steps = 8
    positions = np.add.outer(np.arange(n_steps), frames[:, 1]) / n_steps
    # The positions lie within the search and are 1/128 apart at least.
    assert len(np.unique(np.round(positions * 128).astype(int))) == n_steps * offsets
    assert np.array_equal(image(name, 24, size=8), frames[0])
    # Six frames turn through all of them; the others only move the offsets.
    assert distinct(frames[:6, 0]) == directions


@pytest.mark.parametrize("name", ["spatial_4x4_fine", "spatial_4x4_spread"])
def test_finer_patterns_use_every_direction_equally(name):
    """96 directions from 16 pixels in 6 frames: each once, and each with all 4 offsets of its pixel over 24."""
    frames = np.stack([image(name, f, size=4) for f in range(24)])
    counts = np.bincount(np.round(frames[:6, 0].ravel() * 96).astype(int) % 96, minlength=96)
    assert (counts == 1).all()
    pairs = {tuple(pair) for pair in np.round(frames * 192).transpose(0, 2, 3, 1).reshape(-1, 2).astype(int)}
    assert len(pairs) == 24 * 16


def widest_gap(values):
    """The longest stretch of the circle [0, 1) without a value."""
    found = np.sort(values)
    return np.diff(found, append=found[0] + 1).max()


def test_over_time_single_pixels_see_all_directions():
    """In six frames a pixel of the printed pattern and of the spread one sees every sixth of the half turn, of the fine
    one just a sixteenth of it; of every other frame, which a shifted filter takes apart, only the spread one thirds."""
    gaps = {}
    for name in ("spatial_4x4", "spatial_4x4_fine", "spatial_4x4_spread"):
        rotations = np.array([image(name, f, size=4)[0][2, 1] for f in range(6)])
        gaps[name] = [widest_gap(part) * 96 for part in (rotations, rotations[::2], rotations[1::2])]
    # In directions of the fine grid; float32 keeps 24 digits.
    assert gaps["spatial_4x4"] == pytest.approx([16, 64, 64], abs=1e-4)
    assert gaps["spatial_4x4_fine"] == pytest.approx([91, 94, 94], abs=1e-4)
    assert gaps["spatial_4x4_spread"] == pytest.approx([17, 32, 32], abs=1e-4)


def test_the_printed_formula_has_four_directions():
    """(1/16) (((x + y) & 3) << 2) + (x & 3), turns as it is by that many half turns."""
    y, x = np.mgrid[:8, :8]
    printed = (((x + y) & 3) << 2) / 16 + (x & 3)
    rotation, offset = image("spatial_4x4_unbracketed", 5, size=8)
    assert np.array_equal(rotation, printed % 1)
    assert distinct(rotation) == 4
    assert np.array_equal(offset, image("spatial_4x4", 5, size=8)[1])


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


@pytest.mark.parametrize("frame_index", [0, 1, 100_000])
def test_golden_gradient_noise_moves_as_the_mask_does(frame_index):
    rotation, offset = image("interleaved_gradient")
    moved = image("interleaved_gradient_golden", frame_index)
    steps = (np.sqrt(5) - 1) / 2, np.sqrt(2) - 1
    for values, first, step in zip(moved, (rotation, offset), steps, strict=True):
        distance = np.abs(values - np.mod(first + frame_index * step, 1.0))
        # The step is rounded to 2^-33 of the turn, times the frame; what is added to 24 digits.
        assert np.minimum(distance, 1 - distance).max() < frame_index * 2.0**-33 + 2.0**-22


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


def leading(a, b):
    """How many leading binary digits of numbers in [0, 1) agree, 24 where all that are kept do."""
    differ = np.round(a * 2**24).astype(np.int64) ^ np.round(b * 2**24).astype(np.int64)
    return 24 - np.ceil(np.log2(differ + 1)).astype(int)


def test_sobol_is_the_sequence_with_digits_flipped_by_those_before():
    """What Owen's scrambling keeps is how long two numbers agree; all else about them is random."""
    n = 80
    got = np.stack([image("sobol", f, seed=3, size=4) for f in range(n)])
    plain = sobol.points(2**7)[np.arange(n) ^ (np.arange(n) >> 1)]
    for dimension in range(2):
        want = leading(plain[:, None, dimension], plain[None, :, dimension])
        numbers = got[:, dimension].reshape(n, -1).T
        for pixel in numbers:
            assert np.array_equal(leading(pixel[:, None], pixel[None, :]), want)


@pytest.mark.parametrize("m", [2, 3, 4, 5])
def test_stretches_of_the_sequence_are_nets(m):
    """Frames k 2^m to (k + 1) 2^m - 1 of a pixel put one point into every elementary interval of area 2^-m."""
    for first in (0, 2**m, 3 * 2**m):
        got = np.stack([image("sobol", first + f, seed=1, size=3) for f in range(2**m)]).reshape(2**m, 2, -1)
        for a in range(m + 1):
            cells = np.floor(got[:, 0] * 2**a) * 2 ** (m - a) + np.floor(got[:, 1] * 2 ** (m - a))
            assert (np.sort(cells, axis=0) == np.arange(2**m)[:, None]).all()


def test_scrambles_of_pixels_are_independent_trees():
    """First digits, and second ones under either first digit, are fair and independent over pixels and dimensions.

    Numbers 0, 1, 2, 3 of the first dimension start .00, .10, .01, .11: the flips of all three nodes of the first two
    levels show. A shift by one number per pixel would flip the second digits alike.
    """
    frames = [image("sobol", f, seed=11) for f in range(4)]
    digits = [np.floor(frames[f][0] * 4).astype(int).ravel() for f in range(4)]
    flips = [digits[0] >> 1, digits[0] & 1, digits[1] & 1, np.floor(frames[0][1] * 2).astype(int).ravel()]
    flips += [np.floor(image("sobol", 0, seed=12)[0] * 2).astype(int).ravel()]
    n = SIZE * SIZE
    signs = 2 * np.array(flips) - 1
    # Sums of n fair signs: 15 of them stay below four standard deviations in 999 of 1000 choices of seeds.
    products = signs @ signs.T / np.sqrt(n) - np.sqrt(n) * np.eye(len(flips))
    assert np.abs(products).max() < 4
    assert np.abs(signs.sum(axis=1)).max() < 4 * np.sqrt(n)
    neighbours = signs.reshape(len(flips), SIZE, SIZE)
    assert np.abs((neighbours[:, 1:] * neighbours[:, :-1]).sum(axis=(1, 2))).max() < 4 * np.sqrt(n)


@pytest.mark.parametrize("seed", [0, 7])
@pytest.mark.parametrize("frame_index", [0, 1, 100_000])
def test_blue_noise_is_the_mask_moved_on(frame_index, seed):
    """frac(mask + frame · (golden ratio, √2)) in integers of 32 digits, of which 24 are kept."""
    mask = np.array(mask_values(), dtype=np.int64).reshape(64, 64, 2)
    word = (seed * 0x9E3779B1) % 2**32
    mask = np.roll(mask, (-(word >> 20 & 63), -(word >> 26)), axis=(0, 1))
    got = image("blue_noise", frame_index, seed, size=96)
    for channel, step in enumerate(((np.sqrt(5) - 1) / 2, np.sqrt(2) - 1)):
        shift = (frame_index * round(step * 2**32)) % 2**32 >> 8
        want = (np.tile(mask[..., channel], (2, 2))[:96, :96] * 256 + shift) % 2**24 / 2**24
        # Sums above 1 have 23 digits after the point.
        distance = np.abs(got[channel] - want)
        assert np.minimum(distance, 1 - distance).max() <= 2.0**-24


def test_seeds_begin_elsewhere_in_the_mask():
    first, second = image("blue_noise", seed=0), image("blue_noise", seed=1)
    assert not np.array_equal(first, second)
    for a, b in zip(first, second, strict=True):
        assert np.array_equal(np.sort(a, axis=None), np.sort(b, axis=None))


@pytest.mark.parametrize("frame_index", [0, 5])
def test_values_of_a_mask_are_even_and_never_twice(frame_index):
    for values in image("blue_noise", frame_index):
        gaps = np.diff(np.sort(values, axis=None))
        assert np.abs(gaps - 1 / 4096).max() <= 2.0**-23
