"""Errors of many frames side by side: means, ranks and wins of methods."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from gtao.plot import Comparison, SceneComparison

__all__ = ["frame_numbers", "mean", "numbers_of", "ranked"]

#: Frame -> what :func:`frame_numbers` says of it.
Frames = Mapping[str, Mapping[str, Any]]

#: Errors are told apart from here on, relative and absolute: they come from sums in single precision.
TOLERANCE = 1e-6


def ranked(frames: Frames, twins: Mapping[str, str]) -> dict[str, dict[str, dict[str, float]]]:
    """How methods compare.

    Args:
        frames: the numbers of every frame.
        twins: method -> another one that it equals here; it is no rival where that takes part.

    Returns:
        Source of visibility -> method -> mean "rmse" and "bias" over the frames, mean "rank" (one plus the number of
        rivals with a lower error), and "wins": the number of frames on which every rival's error is higher. Errors
        that differ by rounding count as equal.
    """
    groups: dict[str, dict[str, list[Mapping[str, float]]]] = {}
    for frame in frames.values():
        for group, methods in frame["errors"].items():
            for name, numbers in methods.items():
                groups.setdefault(group, {}).setdefault(name, []).append(numbers)
    found = {}
    for group, methods in groups.items():
        errors = {name: [row["rmse"] for row in rows] for name, rows in methods.items()}
        equal = {name for name in methods if twins.get(name) in methods}
        found[group] = {}
        for name, rows in methods.items():
            own = {name, twins[name]} if name in equal else {name}
            rivals = [errors[other] for other in methods if other not in equal | own]
            places = [[_above(error, rival[i]) for rival in rivals] for i, error in enumerate(errors[name])]
            found[group][name] = {
                "rmse": mean(errors[name]),
                "bias": mean([row["bias"] for row in rows]),
                "rank": mean([1 + above.count(1) for above in places]),
                "wins": sum(all(side < 0 for side in above) for above in places),
            }
    return found


def _above(error: float, rival: float) -> int:
    """1 where the error is higher than the rival's, -1 where it is lower, 0 where rounding could be all."""
    if math.isclose(error, rival, rel_tol=TOLERANCE, abs_tol=TOLERANCE):
        return 0
    return 1 if error > rival else -1


def mean(values: Sequence[float]) -> float:
    """Of at least one number."""
    return sum(values) / len(values)


def numbers_of(table: Comparison) -> dict[str, dict[str, Any]]:
    """Frame -> what a record says of it."""
    return {scene.name: frame_numbers(scene) for scene in table.scenes}


def frame_numbers(scene: SceneComparison) -> dict[str, Any]:
    """What a record says of one frame in one comparison."""
    groups: dict[str, dict[str, dict[str, float | None]]] = {}
    for m in scene.methods:
        groups.setdefault(m.group, {})[m.name] = dict(m.metrics)
    return {"radius": scene.radius, "noise": scene.noise, "errors": groups}
