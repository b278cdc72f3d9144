"""A comparison under light as plain rows: CSV, markdown, the numbers of a record, and what they come to."""

import csv
import io as text_io
from collections.abc import Mapping
from typing import Any

from gtao.plot import Comparison, SceneComparison, summary_rows

__all__ = ["csv_text", "frame_numbers", "markdown_text", "means", "standings"]

#: Light -> what it is cut to -> comparison of the frames.
Tables = Mapping[str, Mapping[str, Comparison]]


def standings(table: Comparison) -> dict[str, dict[str, dict[str, float]]]:
    """Source of visibility -> method -> mean "rmse" and "bias" over the frames, mean "rank", and "wins"."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    for group in table.groups():
        rows = summary_rows(table, group)
        errors = [row.errors for row in rows]
        found[group] = {
            row.present[0].name: {
                "rmse": row.rmse,
                "bias": row.mean("bias") or 0.0,
                "rank": _rank(row.errors, errors),
                "wins": row.lowest,
            }
            for row in rows
        }
    return found


def _rank(own: list[float], errors: list[list[float]]) -> float:
    """Mean over the frames of one plus the number of methods with a lower error."""
    places = [1 + sum(other[i] < error for other in errors) for i, error in enumerate(own)]
    return sum(places) / len(places)


def means(tables: Tables, limits: str) -> dict[str, dict[str, dict[str, float]]]:
    """What light is cut to -> source -> method -> mean relative RMSE over light and frames, without the limits."""
    sums: dict[str, dict[str, dict[str, list[float]]]] = {}
    for cuts in tables.values():
        for cut, table in cuts.items():
            for group, methods in standings(table).items():
                for name, row in methods.items() if group != limits else ():
                    sums.setdefault(cut, {}).setdefault(group, {}).setdefault(name, []).append(row["rmse"])
    return {
        cut: {group: {name: sum(v) / len(v) for name, v in methods.items()} for group, methods in groups.items()}
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
            found = {light: standings(cuts[cut])[source] for light, cuts in tables.items() if cut in cuts}
            lines = [["method", *found, "mean"], ["---"] + ["---:"] * (len(found) + 1)]
            for name in sorted(methods, key=methods.__getitem__):
                cells = [f"{rows[name]['rmse']:.4f}" if name in rows else "–" for rows in found.values()]
                lines.append([name, *cells, f"{methods[name]:.4f}"])
            text = "".join("| " + " | ".join(line) + " |\n" for line in lines)
            parts.append(f"## {cut}, {source}\n\n{text}")
    return "\n".join(parts)


def frame_numbers(scene: SceneComparison) -> dict[str, Any]:
    """What a record says of one frame under one light that is cut in one way."""
    groups: dict[str, dict[str, dict[str, float | None]]] = {}
    for m in scene.methods:
        groups.setdefault(m.group, {})[m.name] = dict(m.metrics)
    return {"radius": scene.radius, "noise": scene.noise, "errors": groups}
