"""Numbers of a method, frame by frame, in memory that does not grow with their size."""

import math
from typing import Any

import numpy as np

from gtao import evaluate

from .frames import Frame
from .state import Memory

__all__ = ["measure", "numbers_of"]


def measure(memory: Memory, frame: Frame, image: np.ndarray, baseline: np.ndarray | None) -> None:
    """Take a frame of a method.

    Args:
        memory: of the method; it is changed.
        image: (H, W) visibility.
        baseline: (H, W) estimate of this frame without a past, None where the method has none.
    """
    before = memory.scores.result()
    memory.scores.add(
        image,
        frame.truth,
        frame.variance,
        mask=frame.mask,
        motion=frame.motion,
        disoccluded=frame.disoccluded,
        baseline=baseline,
    )
    after = memory.scores.result()
    for name, value in (
        ("rmse", after["rmse"][-1]),
        ("bias", after["bias"][-1]),
        ("step", _step(before["flicker"], after["flicker"])),
        ("lag", None if baseline is None else _lag(before["ghosting"], after["ghosting"])),
    ):
        memory.curves[name].append(value)


def _added(before: dict[str, Any], after: dict[str, Any], value: str, count: str, power: int) -> float | None:
    """What one frame has added to a mean, None where nothing counted."""
    n = after[count] - before[count]
    if n == 0:
        return None
    sums = [0.0 if part[value] is None else part[value] ** power * part[count] for part in (before, after)]
    return (sums[1] - sums[0]) / n


def _step(before: dict[str, Any], after: dict[str, Any]) -> float | None:
    square = _added(before, after, "step", "n_step", 2)
    return None if square is None else math.sqrt(max(square, 0.0))


def _lag(before: dict[str, Any], after: dict[str, Any]) -> float | None:
    return _added(before, after, "lag", "n_trail", 1)


def numbers_of(memory: Memory, cut: int | None) -> dict[str, float | None]:
    """The numbers of the whole animation that a table shows; None for what there is none of."""
    found = memory.scores.result()
    errors = found["rmse"]
    start = 0 if cut is None else cut
    last = errors[-max(1, len(errors) // 4) :]
    return {
        "rmse": _root_mean_square(errors),
        "last_rmse": _root_mean_square(last),
        "bias": float(np.mean(found["bias"])),
        "flicker": found["flicker"]["deviation"],
        "step": found["flicker"]["step"],
        # Without a past there is nothing that it could leave.
        "lag": found["ghosting"]["lag"] if any(v is not None for v in memory.curves["lag"]) else None,
        "convergence": evaluate.convergence_frames(errors, start),
    }


def _root_mean_square(values: list[float]) -> float:
    return math.sqrt(float(np.mean(np.square(values))))
