"""Numbers of the patterns outside an estimate, and their spectra."""

import drjit as dr
import numpy as np
import pytest

import gtao
from gtao import noise
from gtao.kernels.noise import PATTERNS


def test_the_printed_pattern():
    rows = noise.values("spatial_4x4", size=4, frames=6)[5]
    assert np.array_equal(rows[..., 0] * 16, [[0, 5, 10, 15], [4, 9, 14, 3], [8, 13, 2, 7], [12, 1, 6, 11]])
    assert np.array_equal(rows[..., 1] * 4, [[0, 3, 2, 1], [1, 0, 3, 2], [2, 1, 0, 3], [3, 2, 1, 0]])


@pytest.mark.parametrize("pattern", sorted(PATTERNS))
def test_a_pixel_of_a_tile(pattern):
    tile = noise.values(pattern, size=8, frames=3, seed=2)
    assert tile.shape == (3, 8, 8, 2)
    alone = noise.sequence_values(pattern, 5, 3, np.arange(3), seed=2)
    assert np.array_equal(alone, tile[:, 3, 5])
    assert noise.sequence_values(pattern, np.arange(4), 1, 2, seed=2).shape == (4, 2)
    assert np.array_equal(noise.sequence_values(pattern, np.arange(4), 1, 2, seed=2), tile[2, 1, :4])


@pytest.mark.parametrize("pattern", ["spatial_4x4_spread", "blue_noise", "sobol", "white"])
def test_estimates_use_these_numbers(pattern):
    """A single slice per pixel tells rotation from rotation: with these numbers for a mask the estimate is the same, up
    to the 16 digits of a mask."""
    y, x = np.mgrid[:64, :64]
    z = 3 + 0.3 * np.sin(x / 5) * np.cos(y / 7)
    g = gtao.GBuffer(z.astype(np.float32), None, gtao.PerspectiveCamera(64, 64, 1.0))
    method = gtao.GTAO(radius=1.0, n_slices=1, n_steps=2, noise=pattern, seed=4, fetch="linear")
    found = gtao.ambient_occlusion(g, method, frame_index=7).visibility.numpy()
    tile = noise.sequence_values(pattern, x, y, 7, seed=4)
    want = noise.estimate_with(g, method, tile).visibility.numpy()
    # 2^-16 of a half turn, or of a step, moves the estimate of this smooth surface by less than 1e-3.
    assert np.abs(found - want).max() < 1e-3
    other = noise.estimate_with(g, method, tile[::-1]).visibility.numpy()
    assert np.abs(found - other).max() > 0.05


def test_spectrum_of_white_noise_is_one():
    found = noise.spectrum("white", frames=16)
    # 16 frames and 6 or more frequencies a ring, in pairs: 1/√(16 · 3) from the smallest on.
    count = 2 * np.pi * found.frequency * 64
    assert np.abs(found.radial - 1).max() < 4.5 * np.sqrt(2 / (16 * count)).max()
    assert found.power[32, 32] == 0
    # The mean over all frequencies is 1 by definition.
    assert found.power.mean() == pytest.approx(1, rel=1e-12)


def test_spectrum_of_a_wave():
    y, x = np.mgrid[:32, :32]
    found = noise.spectrum(0.5 + 0.25 * np.cos(2 * np.pi * (3 * x + 4 * y) / 32))
    peaks = np.argwhere(found.power > 1)
    assert sorted(map(tuple, peaks - 16)) == [(-4, -3), (4, 3)]
    assert found.frequency[np.argmax(found.radial)] == pytest.approx(5 / 32)


def test_a_harmonic_does_not_see_where_values_begin():
    mask = np.random.default_rng(0).random((16, 16))
    first, moved = (noise.spectrum(np.mod(mask + d, 1.0), harmonic=1) for d in (0.0, 0.37))
    assert moved.power == pytest.approx(first.power, abs=1e-9)
    plain = noise.spectrum(np.mod(mask + 0.37, 1.0))
    assert np.abs(plain.power - noise.spectrum(mask).power).max() > 0.1


def test_four_by_four_noise_has_four_by_four_lines():
    """The power of a pattern that repeats every four pixels lies on multiples of a quarter cycle per pixel."""
    found = noise.spectrum("spatial_4x4").power
    lines = np.zeros((64, 64), dtype=bool)
    lines[::16, ::16] = True
    assert found[~lines].max() < 1e-9
    assert found[lines].sum() == pytest.approx(64 * 64)


def test_what_is_asked_for_must_make_sense():
    for call, message in (
        (lambda: noise.values("pink"), "pattern must be one of none, spatial_4x4"),
        (lambda: noise.sequence_values("white", -1, 0, 0), "x must be integers"),
        (lambda: noise.sequence_values("white", 0, 0.5, 0), "y must be integers"),
        (lambda: noise.sequence_values("white", 0, 0, []), "frame must be integers"),
        (lambda: noise.spectrum("none"), "all values are the same"),
        (lambda: noise.spectrum("white", channel=2), "channel must be 0 or 1"),
    ):
        with pytest.raises(gtao.ConfigError, match=message):
            call()
    with pytest.raises(gtao.ShapeError, match=r"must be \(frames, size, size, 2\)"):
        noise.spectrum(np.zeros((3, 4)))


def test_the_mask_is_made_once():
    """Outside of dr.freeze the second estimate launches nothing but itself."""
    g = gtao.GBuffer(np.full((8, 8), 2, np.float32), None, gtao.PerspectiveCamera(8, 8, 1.0))
    method = gtao.GTAO(radius=1.0, n_slices=1, n_steps=2, noise="blue_noise")
    dr.eval(gtao.ambient_occlusion(g, method).visibility)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        dr.eval(gtao.ambient_occlusion(g, method, frame_index=1).visibility)
        dr.sync_thread()
        (kernel,) = [k for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT]
    assert kernel["cache_hit"]
