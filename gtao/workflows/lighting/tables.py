"""A comparison under light as plain rows: CSV, markdown, the numbers of a record, and what they come to."""

import csv
import io as text_io
import math
from collections.abc import Mapping, Sequence
from typing import Any

from gtao.plot import Comparison, SceneComparison

from .methods import TWINS

__all__ = ["csv_text", "frame_numbers", "markdown_text", "means", "numbers_of", "standings"]

#: Light -> what it is cut to -> comparison of the frames.
Tables = Mapping[str, Mapping[str, Comparison]]
#: Frame -> what :func:`frame_numbers` says of it.
Frames = Mapping[str, Mapping[str, Any]]

#: What light is cut to where twins are one method.
TWINNED = "order 2"
#: Errors are told apart from here on, relative and absolute: they come from sums in single precision.
TOLERANCE = 1e-6


def standings(frames: Frames, cut: str) -> dict[str, dict[str, dict[str, float]]]:
    """How methods compare under one light.

    Args:
        frames: the numbers of every frame.
        cut: what the light is cut to. Under "order 2" a method with bands 3 and 4 is its plain twin, and is no rival
            where that takes part.

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
        twins = {name for name in methods if cut == TWINNED and TWINS.get(name) in methods}
        found[group] = {}
        for name, rows in methods.items():
            own = {name, TWINS[name]} if name in twins else {name}
            rivals = [errors[other] for other in methods if other not in twins | own]
            places = [[_above(error, rival[i]) for rival in rivals] for i, error in enumerate(errors[name])]
            found[group][name] = {
                "rmse": _mean(errors[name]),
                "bias": _mean([row["bias"] for row in rows]),
                "rank": _mean([1 + above.count(1) for above in places]),
                "wins": sum(all(side < 0 for side in above) for above in places),
            }
    return found


def _above(error: float, rival: float) -> int:
    """1 where the error is higher than the rival's, -1 where it is lower, 0 where rounding could be all."""
    if math.isclose(error, rival, rel_tol=TOLERANCE, abs_tol=TOLERANCE):
        return 0
    return 1 if error > rival else -1


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values)


def means(tables: Tables, limits: str) -> dict[str, dict[str, dict[str, float]]]:
    """What light is cut to -> source -> method -> mean relative RMSE over light and frames, without the limits."""
    sums: dict[str, dict[str, dict[str, list[float]]]] = {}
    for cuts in tables.values():
        for cut, table in cuts.items():
            for group, methods in standings(numbers_of(table), cut).items():
                for name, row in methods.items() if group != limits else ():
                    sums.setdefault(cut, {}).setdefault(group, {}).setdefault(name, []).append(row["rmse"])
    return {
        cut: {group: {name: _mean(v) for name, v in methods.items()} for group, methods in groups.items()}
        for cut, groups in sums.items()
    }


def csv_text(tables: Tables) -> str:
    """One row per frame, light, cut, source and method."""
    out = text_io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["frame", "light", "cut", "source", "method", "rmse", "bias"])
    for light, cuts in tables.items():
        for cut, table in cuts.items():
            for scene in table.scenes:
                for m in scene.methods:
                    numbers = (f"{m.metrics[name]:.6g}" for name in ("rmse", "bias"))
                    writer.writerow([scene.name, light, cut, m.group, m.name, *numbers])
    return out.getvalue()


def markdown_text(tables: Tables, averages: Mapping[str, Mapping[str, Mapping[str, float]]]) -> str:
    """A section per cut and source: mean relative RMSE of every method under every light, sorted by the mean."""
    parts = ["# RMSE over mean irradiance, against ray-traced light\n"]
    for cut, sources in averages.items():
        for source, methods in sources.items():
            here = {light: cuts[cut] for light, cuts in tables.items() if cut in cuts}
            found = {light: standings(numbers_of(table), cut)[source] for light, table in here.items()}
            lines = [["method", *found, "mean"], ["---"] + ["---:"] * (len(found) + 1)]
            for name in sorted(methods, key=methods.__getitem__):
                cells = [f"{rows[name]['rmse']:.4f}" if name in rows else "–" for rows in found.values()]
                lines.append([name, *cells, f"{methods[name]:.4f}"])
            text = "".join("| " + " | ".join(line) + " |\n" for line in lines)
            parts.append(f"## {cut}, {source}\n\n{text}")
    return "\n".join(parts)


def numbers_of(table: Comparison) -> dict[str, dict[str, Any]]:
    """Frame -> what a record says of it."""
    return {scene.name: frame_numbers(scene) for scene in table.scenes}


def frame_numbers(scene: SceneComparison) -> dict[str, Any]:
    """What a record says of one frame under one light that is cut in one way."""
    groups: dict[str, dict[str, dict[str, float | None]]] = {}
    for m in scene.methods:
        groups.setdefault(m.group, {})[m.name] = dict(m.metrics)
    return {"radius": scene.radius, "noise": scene.noise, "errors": groups}
