"""SSIM against its definition, FLIP against itself in another encoding, and what their masks leave out."""

import math
import subprocess
import sys

import numpy as np
import pytest

from gtao import evaluate
from gtao.errors import ConfigError, ShapeError
from gtao.evaluate import similarity

needs_flip = pytest.mark.skipif(not evaluate.flip_is_installed(), reason="flip-evaluator is not installed")


def pair(height=23, width=31, seed=0):
    """A smooth image with an edge, and a noisy version of it."""
    generator = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width]
    reference = 0.5 + 0.3 * np.sin(x / 5) * np.cos(y / 7) - 0.2 * (x > width // 2)
    return np.clip(reference + 0.1 * generator.standard_normal(reference.shape), 0, 1), reference


def windows_by_definition(a, b, keep, data_range=1.0):
    """Wang et al. (2004), Eq. 13, for each 11x11 window within the frame and the mask."""
    offset = np.arange(-5, 6)
    weights = np.exp(-(offset[:, None] ** 2 + offset**2) / (2 * 1.5**2))
    weights /= weights.sum()
    c1, c2 = (0.01 * data_range) ** 2, (0.03 * data_range) ** 2
    values = []
    for y in range(5, a.shape[0] - 5):
        for x in range(5, a.shape[1] - 5):
            part = np.s_[y - 5 : y + 6, x - 5 : x + 6]
            if not keep[part].all():
                continue
            p, q = a[part], b[part]
            m, n = (weights * p).sum(), (weights * q).sum()
            vp, vq = (weights * (p - m) ** 2).sum(), (weights * (q - n) ** 2).sum()
            cov = (weights * (p - m) * (q - n)).sum()
            values.append((2 * m * n + c1) * (2 * cov + c2) / ((m**2 + n**2 + c1) * (vp + vq + c2)))
    return values


@pytest.mark.parametrize("data_range", [1.0, 2.5])
def test_ssim_is_its_definition(data_range):
    a, b = pair()
    expected = np.mean(windows_by_definition(a, b, np.ones(a.shape, bool), data_range))
    # float64 rounding of variances as differences of squares.
    assert evaluate.ssim(a, b, data_range=data_range) == pytest.approx(expected, abs=1e-12)


def test_ssim_counts_the_windows_within_the_mask():
    a, b = pair()
    keep = np.ones(a.shape, bool)
    keep[:4] = keep[9:11, 3:5] = False
    a[~keep], b[~keep] = np.nan, 17.0
    expected = windows_by_definition(a, b, keep)
    assert evaluate.ssim_windows(keep).sum() == len(expected) < evaluate.ssim_windows(np.ones(a.shape)).sum()
    assert evaluate.ssim(a, b, mask=keep) == pytest.approx(np.mean(expected), abs=1e-12)
    assert evaluate.dssim(a, b, mask=keep) == pytest.approx((1 - np.mean(expected)) / 2, abs=1e-12)


def test_an_open_background_does_not_raise_the_score():
    a, b = pair()
    wide_a, wide_b = (np.pad(x, 20, constant_values=1.0) for x in (a, b))
    mask = np.pad(np.ones(a.shape, bool), 20)
    assert evaluate.ssim(wide_a, wide_b, mask=mask) == pytest.approx(evaluate.ssim(a, b), abs=1e-12)
    assert evaluate.ssim(wide_a, wide_b) > evaluate.ssim(a, b) + 0.05


def test_equal_images():
    _, b = pair()
    assert evaluate.ssim(b, b) == 1
    assert evaluate.dssim(b, b) == 0


@needs_flip
def test_flip_is_that_of_the_images_as_displayed():
    from flip_evaluator import evaluate as flip_evaluate

    a, b = pair()
    shown = []
    for x in (b, a):
        encoded = np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-9) ** (1 / 2.4) - 0.055)
        shown.append(np.repeat(encoded[..., None], 3, axis=-1).astype(np.float32))
    _, expected, _ = flip_evaluate(*shown, "LDR", parameters={"ppd": 40.0})
    # The evaluator decodes in float32.
    assert evaluate.flip(a, b, pixels_per_degree=40.0) == pytest.approx(expected, abs=1e-5)
    assert evaluate.flip(b, b) == 0


@needs_flip
def test_flip_of_the_compared_pixels():
    a, b = pair(40, 60)
    a[:, 20:] = b[:, 20:]
    mask = np.zeros(a.shape, bool)
    mask[:, :20] = True
    whole, part = evaluate.flip(a, b), evaluate.flip(a, b, mask=mask)
    # All error lies in a third of the image, but for what the eye's blur carries across the border.
    assert part == pytest.approx(3 * whole, rel=0.1)
    a[~mask] = np.nan
    assert evaluate.flip(a, b, mask=mask) == pytest.approx(part, rel=0.1)
    assert evaluate.flip(np.clip(b + 0.2, 0, 1), b) > evaluate.flip(np.clip(b + 0.1, 0, 1), b) > 0


def test_flip_says_what_to_install(monkeypatch):
    monkeypatch.setattr(similarity, "find_spec", lambda name: None)
    a, b = pair()
    with pytest.raises(ConfigError, match=r"flip-evaluator.*pip install 'gtao\[flip\]'"):
        evaluate.flip(a, b)
    assert evaluate.scores(a, b)["flip"] is None


def test_nothing_heavy_is_loaded_before_it_is_used():
    code = "import gtao.evaluate, sys; sys.exit(any(m in sys.modules for m in ('skimage', 'flip_evaluator')))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize("metric", ["ssim", "dssim", pytest.param("flip", marks=needs_flip)])
@pytest.mark.parametrize("broken", [np.nan, np.inf])
def test_broken_values_are_refused(metric, broken):
    a, b = pair()
    a[3, 4] = broken
    with pytest.raises(ShapeError, match=r"1 of 713 compared values are NaN or infinite.*mask="):
        getattr(evaluate, metric)(a, b)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda a, b: evaluate.ssim(a, b[:-1]), ShapeError, r"\(23, 31\) and reference \(22, 31\)"),
        (lambda a, b: evaluate.ssim(a[..., None], b[..., None]), ShapeError, r"same \(H, W\)"),
        (lambda a, b: evaluate.ssim(a, b, mask=np.ones(3)), ShapeError, r"mask has shape \(3,\)"),
        (lambda a, b: evaluate.ssim(a, b, mask=np.zeros(a.shape)), ShapeError, "no pixel"),
        (lambda a, b: evaluate.ssim(a[:10], b[:10]), ShapeError, "no window of 11x11 pixels lies in the 31x10 frame"),
        (lambda a, b: evaluate.ssim(a, b, data_range=0), ConfigError, "data_range"),
        (lambda a, b: evaluate.ssim(a, b, data_range=math.nan), ConfigError, "data_range"),
        (lambda a, b: evaluate.flip(a, b, pixels_per_degree=0), ConfigError, "pixels_per_degree"),
    ],
)
def test_refusals(call, error, message):
    with pytest.raises(error, match=message):
        call(*pair())


def test_scores_are_the_metrics_by_name():
    a, b = pair()
    variance = np.full(a.shape, 0.001)
    mask = np.ones(a.shape, bool)
    mask[0] = False
    found = evaluate.scores(a, b, variance=variance, mask=mask)
    for name in ("rmse", "bias", "mae", "psnr", "ssim", "dssim"):
        assert found.pop(name) == getattr(evaluate, name)(a, b, mask=mask)
    assert found.pop("corrected_rmse") == evaluate.corrected_rmse(a, b, variance, mask=mask)
    flip = found.pop("flip")
    assert flip == (evaluate.flip(a, b, mask=mask) if evaluate.flip_is_installed() else None)
    assert found == {}


def test_scores_without_what_does_not_exist():
    a, b = pair()
    quick = evaluate.scores(a, b, perceptual=False)
    assert [name for name, value in quick.items() if value is None] == ["corrected_rmse", "ssim", "dssim", "flip"]
    thin = evaluate.scores(a[:8], b[:8])
    assert thin["ssim"] is thin["dssim"] is None
    assert thin["rmse"] == evaluate.rmse(a[:8], b[:8])
