"""Flicker: how restless an image is where nothing happens."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gtao.errors import ShapeError

from .temporal_motion import Resumable, image_of, mask_of, motion_of, other_pixel, previous_pixels, together

__all__ = ["Flicker", "FlickerMeter", "flicker"]

#: Pixels that move by less, in pixels per frame, are at rest.
AT_REST = 1e-3


@dataclass(frozen=True)
class Flicker:
    """How restless a sequence is; all in units of the image.

    Attributes:
        deviation: Root of the temporal variance, pooled over pixels at rest; NaN where none rests for two frames.
        step: Root mean square of the change from one frame to the next, along the motion: √2 times the deviation where
            frames are independent, less where each is much like the last. NaN where nothing is seen twice.
        n_deviation: Degrees of freedom of the variance: pixels times frames, without one for each mean.
        n_step: Number of changes.
    """

    deviation: float
    step: float
    n_deviation: int
    n_step: int


class FlickerMeter(Resumable):
    """Measures :func:`flicker` frame by frame, in memory that does not grow with their number.

    Args:
        shared_noise: Whether truths share their random numbers, pixel by pixel, as those of
            :func:`gtao.render.sequence` do. The noise of what stays in its pixel then stays too, and is not taken out.
    """

    def __init__(self, shared_noise: bool = False) -> None:
        self._shared = shared_noise
        self._n: np.ndarray | None = None
        self._mean: np.ndarray | None = None
        self._noise: np.ndarray | None = None
        self._last: np.ndarray | None = None
        self._last_noise: np.ndarray | None = None
        self._squares = self._steps = 0.0
        self._n_squares = self._n_steps = 0

    def add(
        self,
        image: ArrayLike,
        truth: ArrayLike | None = None,
        variance: ArrayLike | None = None,
        *,
        mask: ArrayLike | None = None,
        motion: ArrayLike | None = None,
    ) -> None:
        """Take the next frame.

        Args:
            image: (H, W) image.
            truth: (H, W) truth of this frame, whose changes are no flicker; if left out, all changes are.
            variance: (H, W) variance of the truth, whose noise is taken out; none if left out.
            mask: (H, W) bool, pixels that count: their point was visible in the last frame too. All if left out.
            motion: (H, W, 2 or 3) pixels right and down from the last frame; nothing moves if left out.

        Raises:
            ShapeError: The shapes differ from each other or from earlier frames, or a value that counts is not finite.
        """
        image = image_of("image", image, None if self._last is None else self._last.shape)
        y = np.zeros(image.shape) if truth is None else image_of("truth", truth, image.shape)
        noise = np.zeros(image.shape) if variance is None else image_of("variance", variance, image.shape)
        counts = mask_of("mask", mask, image.shape)
        moves = motion_of(motion, image.shape)
        e = np.where(counts, image - y, np.nan)
        if not np.isfinite(e[counts]).all() or not (noise[counts] >= 0).all():
            raise ShapeError("a value that counts is not finite, or a variance negative; leave it out with mask=")
        noise = np.where(counts, noise, 0.0)
        if self._n is None:
            self._n, self._mean, self._noise = np.zeros(e.shape), np.zeros(e.shape), np.zeros(e.shape)
        if self._last is not None and self._last_noise is not None:
            self._add_steps(e, noise, self._last, self._last_noise, moves)
        resting = counts if moves is None else counts & (np.hypot(moves[..., 0], moves[..., 1]) <= AT_REST)
        self._add_squares(e, np.zeros(e.shape) if self._shared else noise, resting)
        self._last, self._last_noise = e, noise

    def _add_steps(
        self, e: np.ndarray, noise: np.ndarray, last: np.ndarray, last_noise: np.ndarray, motion: np.ndarray | None
    ) -> None:
        if motion is not None:
            rows, columns, inside = previous_pixels(motion)
            last, last_noise = np.where(inside, last[rows, columns], np.nan), last_noise[rows, columns]
        if self._shared:
            other = np.zeros(e.shape, bool) if motion is None else other_pixel(rows, columns)
            noise, last_noise = np.where(other, noise, 0.0), np.where(other, last_noise, 0.0)
        change = e - last
        seen = np.isfinite(change)
        self._steps += float(np.sum((change**2 - noise - last_noise)[seen]))
        self._n_steps += int(seen.sum())

    def _add_squares(self, e: np.ndarray, noise: np.ndarray, resting: np.ndarray) -> None:
        # A pixel that moves or does not count begins anew: what surrounds its point may be another afterwards.
        n, mean, noise_of_mean = (np.where(resting, values, 0.0) for values in (self._n, self._mean, self._noise))
        n = n + resting
        again, share = n > 1, 1 / np.where(n > 0, n, 1.0)
        change = np.where(resting, e - mean, 0.0)
        # What each frame adds to Welford's sum has the variance as its expectation, and of the truth's noise what is
        # taken off: its own, and that of the mean of the frames before, 1 / (n - 1) of their mean variance.
        added = (change**2 - noise) * (1 - share) - noise_of_mean * share
        self._squares += float(np.sum(added[again]))
        self._n_squares += int(again.sum())
        self._n, self._mean = n, mean + change * share
        self._noise = np.where(resting, noise_of_mean + (noise - noise_of_mean) * share, 0.0)

    def result(self) -> Flicker:
        """What the frames so far say."""
        return Flicker(
            deviation=_root(self._squares, self._n_squares),
            step=_root(self._steps, self._n_steps),
            n_deviation=self._n_squares,
            n_step=self._n_steps,
        )


def flicker(
    frames: Iterable[ArrayLike],
    static: ArrayLike | None = None,
    *,
    truths: Iterable[ArrayLike] | None = None,
    variances: Iterable[ArrayLike] | None = None,
) -> Flicker:
    """Temporal variance on static pixels, without what the truth does.

    For frames x of a truth y: the variance over time of x - y, averaged over the pixels, from which the variance that
    the truth's sampling noise has is taken off. Bias that stays is no flicker. See :class:`FlickerMeter` for masks that
    change, for motion, and for frames that come one at a time.

    Args:
        frames: (H, W) images.
        static: (H, W) bool, pixels that count; all if left out.
        truths: (H, W) truth of each frame. If left out, the truth is taken to be the same in all of them.
        variances: (H, W) variance of each frame's truth, traced independently; no noise if left out.

    Returns:
        The flicker.

    Raises:
        ShapeError: The shapes differ, a value that counts is not finite, there are fewer than two frames, or not as
            many truths or variances.
    """
    if variances is not None and truths is None:
        raise ShapeError("variances are those of truths; give truths too")
    meter, n = FlickerMeter(), 0
    for given in together(frames, truths, variances):
        meter.add(*given, mask=static)
        n += 1
    if n < 2:
        raise ShapeError(f"flicker needs at least two frames, got {n}")
    return meter.result()


def _root(total: float, n: int) -> float:
    return float("nan") if n == 0 else float(np.sqrt(max(total / n, 0.0)))
