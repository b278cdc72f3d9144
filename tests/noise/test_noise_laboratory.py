"""The laboratory: dense limits, what the mean over frames and filters leave, how masks may move."""

from dataclasses import replace

import numpy as np
import pytest

import gtao
from gtao import noise

SIZE = 64


@pytest.fixture(scope="module")
def frame():
    """A bowl with a step: visibility varies, and not only smoothly."""
    y, x = np.mgrid[:SIZE, :SIZE] / SIZE - 0.5
    z = np.where(x + 0.3 * y > 0.1, 3.0, 3.4) + 0.4 * (x * x + y * y)
    return gtao.GBuffer(z.astype(np.float32), None, gtao.PerspectiveCamera(SIZE, SIZE, 1.0))


METHOD = gtao.GTAO(radius=0.8, n_slices=1, n_steps=4)


@pytest.fixture(scope="module")
def limit(frame):
    return noise.dense_limit(frame, METHOD)


def test_the_dense_limit_is_the_mean_over_all_rotations_and_offsets(frame, limit):
    """A regular grid of both, the same in all pixels."""
    total = np.zeros((SIZE, SIZE))
    rotations, offsets = 64, 16
    for i in range(rotations):
        for j in range(offsets):
            tile = np.full((64, 64, 2), ((i + 0.5) / rotations, (j + 0.5) / offsets))
            total += noise.estimate_with(frame, METHOD, tile).visibility.numpy()
    # Texels are hit or missed: the integrand has steps, which 64 directions resolve to about 1/64 of their height each,
    # with both signs.
    difference = total / (rotations * offsets) - limit.visibility.numpy()
    assert np.sqrt(np.mean(difference**2)) < 2e-3
    assert abs(difference.mean()) < 2e-4
    assert limit.config == METHOD


@pytest.mark.parametrize(
    "method",
    [gtao.HBAO(radius=0.8, n_directions=2, n_steps=4), gtao.VisibilityBitmask(radius=0.8, n_slices=1, n_steps=4)],
)
def test_other_methods_have_limits_too(frame, method):
    found = noise.variance(frame, replace(method, noise="white"), n_frames=(1, 16))
    # Independent frames: the variance falls as 1/n, to the accuracy of 4096 pixels.
    assert found[16].variance == pytest.approx(found[1].variance / 16, rel=0.2)


def test_variance_of_independent_frames(frame, limit):
    found = noise.variance(frame, replace(METHOD, noise="white"), n_frames=(1, 4, 16), limit=limit)
    for n in (4, 16):
        assert found[n].variance == pytest.approx(found[1].variance / n, rel=0.1)
        # Without a filter the two distances are one.
        assert found[n].rmse ** 2 == pytest.approx(found[n].variance, rel=1e-6)
        assert abs(found[n].bias) < 4 * np.sqrt(found[n].variance / SIZE**2)


def test_variance_against_its_definition(frame, limit):
    """Two frames of one stretch, filtered: the mean image against the mean of the two filtered limits."""
    spatial = gtao.SpatialFilter()
    method = replace(METHOD, noise="sobol")
    found = noise.variance(frame, method, spatial, n_frames=(2,), limit=limit)[2]
    images = [
        [
            gtao.denoise(ao, frame, spatial, frame_index=f).visibility.numpy().astype(np.float64)
            for ao in (gtao.ambient_occlusion(frame, method, frame_index=f), limit)
        ]
        for f in range(2)
    ]
    estimate, smooth = np.mean(images, axis=0)
    error = estimate - limit.visibility.numpy()
    assert found.variance == pytest.approx(np.mean((estimate - smooth) ** 2), rel=1e-6)
    assert found.rmse == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-6)
    assert found.bias == pytest.approx(np.mean(error), rel=1e-4)


def test_low_discrepancy_pays(frame, limit):
    """Over 24 frames, unfiltered, every sequence is at least twice as near as white noise; the fine pattern, which
    turns by a sixteenth in all, gains nothing."""
    rms = {
        name: np.sqrt(noise.variance(frame, replace(METHOD, noise=name), n_frames=(24,), limit=limit)[24].variance)
        for name in ("white", "sobol", "blue_noise", "spatial_4x4_spread", "spatial_4x4_fine")
    }
    for name in ("sobol", "blue_noise", "spatial_4x4_spread"):
        assert rms[name] < 0.5 * rms["white"]
    assert rms["spatial_4x4_fine"] > 3 * rms["white"]


def test_blue_noise_is_what_filters_take_away(frame, limit):
    """One frame: unfiltered as far off as white noise, filtered far less."""
    for spatial, factor in ((None, 0.95), (gtao.SpatialFilter(), 0.0), (gtao.PlaneAwareFilter(), 0.0)):
        white, blue = (
            noise.variance(frame, replace(METHOD, noise=name), spatial, n_frames=(1,), limit=limit)[1].variance
            for name in ("white", "blue_noise")
        )
        if spatial is None:
            assert blue == pytest.approx(white, rel=1 - factor)
        else:
            assert blue < 0.5 * white


def test_parity_of_the_spread_pattern(frame, limit):
    """Filters that change sides each frame see half of the frames: the slides' order turns by a third in each half."""
    printed, spread = (
        noise.variance(frame, replace(METHOD, noise=name), gtao.SpatialFilter(), n_frames=(6,), limit=limit)[6]
        for name in ("spatial_4x4", "spatial_4x4_spread")
    )
    assert spread.variance < 0.5 * printed.variance


def test_blue_noise_moves_as_golden_does(frame, limit):
    own = noise.variance(frame, replace(METHOD, noise="blue_noise"), n_frames=(8,), limit=limit)[8]
    moved = noise.variance(frame, METHOD, n_frames=(8,), limit=limit, masks=noise.MOVEMENTS["golden"])[8]
    # A mask of one's own has 16 digits, the pattern 24.
    assert moved.variance == pytest.approx(own.variance, rel=0.05)


def test_movements(frame, limit):
    """All start blue; a still mask gains nothing by time, a moved one more than a fresh one."""
    found = {
        name: noise.variance(frame, METHOD, n_frames=(1, 24), limit=limit, masks=masks)
        for name, masks in noise.MOVEMENTS.items()
    }
    assert found["still"][24].variance == pytest.approx(found["still"][1].variance)
    assert found["golden"][24].variance < 0.25 * found["fresh"][24].variance
    assert found["golden"][24].variance < found["r2"][24].variance
    for name, masks in noise.MOVEMENTS.items():
        spectrum = noise.spectrum(np.stack([masks(f) for f in range(4)]), harmonic=1)
        assert spectrum.radial[spectrum.frequency < 0.15].max() < 0.1, name


def test_what_is_asked_for_must_make_sense(frame):
    for call, message in (
        (lambda: noise.dense_limit(frame, gtao.HeightfieldHorizon(radius=1.0)), "noise is measured with gtao.GTAO"),
        (lambda: noise.variance(frame, METHOD, n_frames=(0,)), "n_frames must be positive integers"),
        (lambda: noise.variance(frame, METHOD, n_frames=()), "n_frames must be positive integers"),
        (
            lambda: noise.estimate_with(frame, gtao.GTAO(power=2.0), np.zeros((64, 64, 2))),
            "put into the integral alone",
        ),
    ):
        with pytest.raises(gtao.ConfigError, match=message):
            call()
    for mask in (np.zeros((32, 64, 2)), np.ones((64, 64, 2)), np.full((64, 64, 2), np.nan)):
        with pytest.raises(gtao.ShapeError, match=r"\(64, 64, 2\) numbers"):
            noise.estimate_with(frame, METHOD, mask)
