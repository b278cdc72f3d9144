"""A comparison under light as plain rows: CSV, markdown, and what the numbers come to."""

import csv
import io as text_io
from collections.abc import Mapping

from gtao.plot import Comparison
from gtao.workflows.standings import Frames, mean, numbers_of, ranked

from .methods import TWINS

__all__ = ["csv_text", "markdown_text", "means", "standings"]

#: Light -> what it is cut to -> comparison of the frames.
Tables = Mapping[str, Mapping[str, Comparison]]

#: What light is cut to where twins are one method.
TWINNED = "order 2"


def standings(frames: Frames, cut: str) -> dict[str, dict[str, dict[str, float]]]:
    """How methods compare under one light that is cut in one way, as :func:`gtao.workflows.standings.ranked` has it.

    Under "order 2" a method with bands 3 and 4 is its plain twin, and is no rival where that takes part.
    """
    return ranked(frames, TWINS if cut == TWINNED else {})


def means(tables: Tables, limits: str) -> dict[str, dict[str, dict[str, float]]]:
    """What light is cut to -> source -> method -> mean relative RMSE over light and frames, without the limits."""
    sums: dict[str, dict[str, dict[str, list[float]]]] = {}
    for cuts in tables.values():
        for cut, table in cuts.items():
            for group, methods in standings(numbers_of(table), cut).items():
                for name, row in methods.items() if group != limits else ():
                    sums.setdefault(cut, {}).setdefault(group, {}).setdefault(name, []).append(row["rmse"])
    return {
        cut: {group: {name: mean(v) for name, v in methods.items()} for group, methods in groups.items()}
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
