"""Where something has just happened: pixels whose truth changed within the last frames."""

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import ArrayLike

from gtao.errors import ConfigError

from .temporal_motion import Resumable, image_of, mask_of, motion_of, other_pixel, previous_pixels, together

__all__ = ["TrailTracker", "trail_mask"]

#: Standard errors by which noisy truths have to differ: of this many normal deviates one in 16 000 goes farther.
STANDARD_ERRORS = 4.0


class TrailTracker(Resumable):
    """Finds :func:`trail_mask` frame by frame, in memory that does not grow with their number.

    Each pixel remembers the truth at its last change and compares with it, so that slow changes are found too.

    Args:
        n: Frames that a trail lasts, at least 1: about as long as a filter remembers.
        change: Difference of the truth that is a change, positive.
        shared_noise: Whether truths share their random numbers, pixel by pixel, as those of
            :func:`gtao.render.sequence` do. The noise of what stays in its pixel then stays too, and every difference
            there is real.

    Raises:
        ConfigError: A value is out of range.
    """

    def __init__(self, n: int = 24, change: float = 0.02, *, shared_noise: bool = False) -> None:
        if n < 1:
            raise ConfigError(f"a trail lasts at least 1 frame, got n = {n}")
        if not (np.isfinite(change) and change > 0):
            raise ConfigError(f"change must be a positive number, got {change}")
        self._frames, self._change, self._shared = n, change, shared_noise
        self._truth: np.ndarray | None = None
        self._noise: np.ndarray | None = None
        self._age: np.ndarray | None = None
        self._sign: np.ndarray | None = None
        self._moved: np.ndarray | None = None

    def add(
        self,
        truth: ArrayLike,
        variance: ArrayLike | None = None,
        *,
        motion: ArrayLike | None = None,
        disoccluded: ArrayLike | None = None,
    ) -> np.ndarray:
        """Take the next frame's truth.

        Args:
            truth: (H, W) truth.
            variance: (H, W) its variance; a change is more than 4 standard errors of the difference.
            motion: (H, W, 2 or 3) pixels right and down from the last frame; nothing moves if left out.
            disoccluded: (H, W) bool, pixels whose point was not visible in the last frame: they are a trail as well,
                whose sign is that of the change at this place of the image.

        Returns:
            (H, W) int8: 1 where the truth has become brighter within the last n frames (behind a moving occluder), -1
            where darker (where it arrives), 0 elsewhere and in the first frame.

        Raises:
            ShapeError: The shapes differ from each other or from earlier frames.
        """
        y = image_of("truth", truth, None if self._truth is None else self._truth.shape)
        noise = np.zeros(y.shape) if variance is None else image_of("variance", variance, y.shape)
        moves, fresh = motion_of(motion, y.shape), mask_of("disoccluded", disoccluded, y.shape, default=False)
        if self._truth is None or self._noise is None or self._age is None or self._sign is None or self._moved is None:
            self._truth, self._noise, self._sign = y, noise, np.zeros(y.shape, np.int8)
            self._age, self._moved = np.full(y.shape, self._frames), np.zeros(y.shape, bool)
            return self._sign.copy()
        here = y - self._truth
        before, noise_before, age, sign, moved = self._truth, self._noise, self._age, self._sign, self._moved
        if moves is not None:
            rows, columns, inside = previous_pixels(moves)
            before, noise_before, age, sign, moved = (
                values[rows, columns] for values in (before, noise_before, age, sign, moved)
            )
            # What is compared with was seen in another pixel, whose noise was another.
            moved = moved | other_pixel(rows, columns)
            fresh = fresh | ~inside
        difference = y - before
        spread = np.where(moved, noise + noise_before, 0.0) if self._shared else noise + noise_before
        limit = np.maximum(self._change, STANDARD_ERRORS * np.sqrt(spread))
        changed = fresh | (np.abs(difference) > limit)
        self._sign = np.where(changed, np.where(np.where(fresh, here, difference) < 0, -1, 1), sign).astype(np.int8)
        self._age = np.where(changed, 0, np.minimum(age + 1, self._frames))
        self._truth, self._noise = np.where(changed, y, before), np.where(changed, noise, noise_before)
        self._moved = moved & ~changed
        return np.where(self._age < self._frames, self._sign, 0).astype(np.int8)


def trail_mask(
    truths: Iterable[ArrayLike], n: int = 24, *, change: float = 0.02, variances: Iterable[ArrayLike] | None = None
) -> Iterator[np.ndarray]:
    """Where the truth has changed within the last n frames: what a filter remembers there is out of date.

    Args:
        truths: (H, W) truth of each frame, of a camera at rest; :class:`TrailTracker` also takes motion.
        n: Frames that a trail lasts, at least 1.
        change: Difference of the truth that is a change, positive.
        variances: (H, W) variance of each truth; without, every difference counts as real.

    Yields:
        (H, W) int8 per frame: 1 where the truth has become brighter (behind a moving occluder), -1 where darker (where
        it arrives), 0 elsewhere.

    Raises:
        ConfigError: A value is out of range.
        ShapeError: The shapes differ, or there are not as many variances.
    """
    tracker = TrailTracker(n, change)
    for given in together(truths, variances):
        yield tracker.add(*given)
