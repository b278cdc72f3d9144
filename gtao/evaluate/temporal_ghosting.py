"""Ghosting: what an image still shows of frames that are gone."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gtao.errors import ShapeError

from .temporal_motion import Resumable, image_of, mask_of, together

__all__ = ["Ghosting", "GhostingMeter", "ghosting"]


@dataclass(frozen=True)
class Ghosting:
    """What an image still shows of frames that are gone.

    Attributes:
        energy: Mean over the trail of the squared error, beyond that of the estimate without a past (or beyond the
            truth's noise where none is given); negative where the past does more good than harm. NaN without a trail.
        elsewhere: The same outside of the trail.
        lag: Mean over the trail of how far the image hangs back: the difference from the estimate without a past (or
            from the truth), positive against the direction of the change. A ghost as dark as the change was great has a
            lag of as much.
        behind: Mean difference where the truth has become brighter: negative for a dark ghost behind an occluder.
        ahead: Mean difference where it has become darker: positive where occlusion comes late.
        n_trail, n_elsewhere: Pixels times frames.
    """

    energy: float
    elsewhere: float
    lag: float
    behind: float
    ahead: float
    n_trail: int
    n_elsewhere: int


class GhostingMeter(Resumable):
    """Measures :func:`ghosting` frame by frame, in memory that does not grow with their number."""

    def __init__(self) -> None:
        # Behind, ahead, elsewhere.
        self._n = np.zeros(3)
        self._energy = np.zeros(3)
        self._difference = np.zeros(3)

    def add(
        self,
        image: ArrayLike,
        truth: ArrayLike,
        trail: ArrayLike,
        *,
        baseline: ArrayLike | None = None,
        variance: ArrayLike | None = None,
        mask: ArrayLike | None = None,
    ) -> None:
        """Take the next frame; arguments as :func:`ghosting`, of this frame alone.

        Raises:
            ShapeError: The shapes differ, or a value that counts is not finite.
        """
        x = image_of("image", image)
        y = image_of("truth", truth, x.shape)
        sign = image_of("trail", trail, x.shape)
        counts = mask_of("mask", mask, x.shape)
        if baseline is None:
            without = y
            noise = np.zeros(x.shape) if variance is None else image_of("variance", variance, x.shape)
        else:
            # The truth's noise is in both errors and leaves the difference of their squares unbiased.
            without, noise = image_of("baseline", baseline, x.shape), np.zeros(x.shape)
        excess = (x - y) ** 2 - (without - y) ** 2 - noise
        if not np.isfinite(excess[counts]).all():
            raise ShapeError("a value that counts is not finite; leave it out with mask=")
        for i, part in enumerate((counts & (sign > 0), counts & (sign < 0), counts & (sign == 0))):
            self._n[i] += part.sum()
            self._energy[i] += excess[part].sum()
            self._difference[i] += (x - without)[part].sum()

    def result(self) -> Ghosting:
        """What the frames so far say."""
        behind, ahead, rest = (int(n) for n in self._n)
        energy, difference = self._energy, self._difference
        return Ghosting(
            energy=_mean(energy[0] + energy[1], behind + ahead),
            elsewhere=_mean(energy[2], rest),
            lag=_mean(difference[1] - difference[0], behind + ahead),
            behind=_mean(difference[0], behind),
            ahead=_mean(difference[1], ahead),
            n_trail=behind + ahead,
            n_elsewhere=rest,
        )


def ghosting(
    frames: Iterable[ArrayLike],
    truths: Iterable[ArrayLike],
    trails: Iterable[ArrayLike],
    *,
    baselines: Iterable[ArrayLike] | None = None,
    variances: Iterable[ArrayLike] | None = None,
    mask: ArrayLike | None = None,
) -> Ghosting:
    """Error that the past leaves in the trail of what moves, against the truth of each frame.

    Args:
        frames: (H, W) images.
        truths: (H, W) truth of each frame.
        trails: (H, W) per frame, 1 where the truth has become brighter, -1 where darker, 0 outside of the trail; for
            example from :func:`trail_mask`. A bool mask is a trail behind.
        baselines: (H, W) per frame, the estimate without a past, best one free of noise: its error is no ghost. Taken
            to be right if left out.
        variances: (H, W) variance of each truth, taken off the squared error where there are no baselines; with them
            the noise drops out by itself.
        mask: (H, W) bool, pixels that count; all if left out.

    Returns:
        The ghosting.

    Raises:
        ShapeError: The shapes differ, a value that counts is not finite, or there are not as many of each as frames.
    """
    meter = GhostingMeter()
    names = [name for name, given in (("baseline", baselines), ("variance", variances)) if given is not None]
    for x, y, trail, *rest in together(frames, truths, trails, baselines, variances):
        meter.add(x, y, trail, mask=mask, **dict(zip(names, rest, strict=True)))
    return meter.result()


def _mean(total: float, n: int) -> float:
    return float("nan") if n == 0 else float(total / n)
