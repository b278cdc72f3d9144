"""How a sequence behaves over time: errors of every frame, flicker, ghosting, and how fast it settles."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from gtao.errors import ConfigError, ShapeError

from .metrics import bias, corrected_rmse, rmse
from .temporal_flicker import FlickerMeter
from .temporal_ghosting import GhostingMeter
from .temporal_motion import mask_of
from .temporal_trail import TrailTracker

__all__ = ["TemporalScores", "convergence_frames", "drift"]


class TemporalScores:
    """All temporal metrics of a sequence, taken frame by frame; only two numbers per frame are kept of each.

    Args:
        trail: Frames that a trail lasts, as :class:`TrailTracker` has it.
        change: Difference of the truth that is a change.
        shared_noise: Whether truths share their random numbers, as :class:`FlickerMeter` has it.

    Raises:
        ConfigError: A value is out of range.
    """

    def __init__(self, trail: int = 24, change: float = 0.02, *, shared_noise: bool = True) -> None:
        self.rmse: list[float] = []
        self.bias: list[float] = []
        self._trail = TrailTracker(trail, change, shared_noise=shared_noise)
        self._flicker, self._ghosting = FlickerMeter(shared_noise), GhostingMeter()

    def add(
        self,
        image: ArrayLike,
        truth: ArrayLike,
        variance: ArrayLike | None = None,
        *,
        mask: ArrayLike | None = None,
        motion: ArrayLike | None = None,
        disoccluded: ArrayLike | None = None,
        baseline: ArrayLike | None = None,
    ) -> None:
        """Take the next frame.

        Args:
            image: (H, W) image.
            truth: (H, W) truth.
            variance: (H, W) variance of the truth; none if left out.
            mask: (H, W) bool, pixels that show a surface; all if left out.
            motion: (H, W, 2 or 3) pixels right and down from the last frame; nothing moves if left out.
            disoccluded: (H, W) bool, pixels whose point was not visible in the last frame; none if left out.
            baseline: (H, W) estimate without a past, for the ghosting; see :func:`ghosting`.

        Raises:
            ShapeError: The shapes differ from each other or from earlier frames, or a value that counts is not finite.
        """
        y = np.asarray(truth, dtype=np.float64)
        keep = mask_of("mask", mask, y.shape)
        fresh = mask_of("disoccluded", disoccluded, y.shape, default=False)
        # What is masked out may be broken, and the tracker compares all pixels.
        known = np.where(keep, y, 1.0)
        noise = None if variance is None else np.where(keep, np.asarray(variance, dtype=np.float64), 0.0)
        error = rmse(image, y, mask=keep) if noise is None else corrected_rmse(image, y, noise, mask=keep)
        trail = self._trail.add(known, noise, motion=motion, disoccluded=fresh)
        self._ghosting.add(image, y, trail, baseline=baseline, variance=noise, mask=keep)
        self._flicker.add(image, y, noise, mask=keep & ~fresh & (trail == 0), motion=motion)
        self.rmse.append(error)
        self.bias.append(bias(image, y, mask=keep))

    def result(self) -> dict[str, Any]:
        """Everything in plain types that JSON can hold: "rmse" and "bias" of every frame (the truth's noise taken out),
        "flicker" and "ghosting" as :class:`Flicker` and :class:`Ghosting` have them, None for what there is none of.

        Flicker is measured where nothing has happened for the length of a trail.
        """
        parts = {"flicker": asdict(self._flicker.result()), "ghosting": asdict(self._ghosting.result())}
        plain = {
            name: {key: None if math.isnan(value) else value for key, value in part.items()}
            for name, part in parts.items()
        }
        return {"rmse": list(self.rmse), "bias": list(self.bias), **plain}

    def state(self) -> dict[str, np.ndarray]:
        """All that is remembered, as arrays that :func:`numpy.savez` writes and :meth:`from_state` takes back."""
        meters = {"flicker": self._flicker, "ghosting": self._ghosting, "trail": self._trail}
        kept = {f"{name}.{key}": value for name, meter in meters.items() for key, value in meter.state().items()}
        return kept | {"rmse": np.array(self.rmse), "bias": np.array(self.bias)}

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Self:
        """Scores that go on where :meth:`state` was taken.

        Raises:
            ShapeError: it is no such state.
        """

        def part(name: str) -> dict[str, Any]:
            return {key.partition(".")[2]: value for key, value in state.items() if key.startswith(f"{name}.")}

        if not {"rmse", "bias"} <= set(state):
            raise ShapeError("no state of TemporalScores: it has no rmse and bias")
        scores = cls()
        scores.rmse, scores.bias = ([float(x) for x in state[name]] for name in ("rmse", "bias"))
        scores._trail = TrailTracker.from_state(part("trail"))
        scores._flicker = FlickerMeter.from_state(part("flicker"))
        scores._ghosting = GhostingMeter.from_state(part("ghosting"))
        return scores


def convergence_frames(
    errors: Sequence[float], cut: int = 0, tolerance: float = 0.1, *, level: float | None = None
) -> int | None:
    """Frames after a cut until errors stay near the level that they settle at.

    Args:
        errors: Error of every frame, for example its RMSE.
        cut: Frame that everything changes in.
        tolerance: Share of the level by which errors may lie above it, not negative.
        level: The level; if left out, the mean over the last quarter of the frames from the cut on.

    Returns:
        The least k such that all errors from frame cut + k on are at most (1 + tolerance) level; 0 where the first is.
        None where not even the last is.

    Raises:
        ConfigError: No frame follows the cut, or a value is not finite or negative.
    """
    after = np.asarray(errors, dtype=np.float64)[cut:] if cut >= 0 else np.empty(0)
    if after.size == 0:
        raise ConfigError(f"there is no frame from {cut} on; got {len(errors)} errors")
    if not (np.isfinite(after).all() and (after >= 0).all() and np.isfinite(tolerance) and tolerance >= 0):
        raise ConfigError("errors and the tolerance must be finite and not negative")
    settled = float(after[-max(1, after.size // 4) :].mean()) if level is None else level
    above = np.flatnonzero(after > (1 + tolerance) * settled)
    first = 0 if above.size == 0 else int(above[-1]) + 1
    return first if first < after.size else None


def drift(values: Sequence[float], start: int = 0) -> tuple[float, float]:
    """Whether a number that should have settled still goes anywhere.

    Args:
        values: A number per frame, for example the bias against a dense estimate.
        start: First frame that counts; two must follow it.

    Returns:
        Slope per frame of the line through the values by least squares, and its standard error for values whose errors
        are independent.

    Raises:
        ConfigError: There are fewer than three values from ``start`` on, or one is not finite.
    """
    y = np.asarray(values, dtype=np.float64)[max(start, 0) :]
    if y.size < 3 or not np.isfinite(y).all():
        raise ConfigError(f"a slope with its error needs three finite values from frame {start} on, got {y}")
    t = np.arange(y.size) - (y.size - 1) / 2
    slope = float(t @ y / (t @ t))
    residual = y - y.mean() - slope * t
    return slope, math.sqrt(float(residual @ residual) / (y.size - 2) / float(t @ t))
