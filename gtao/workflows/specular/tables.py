"""A comparison of specular occlusion as plain rows: CSV, markdown, and what the numbers come to."""

import csv
import io as text_io
from collections.abc import Mapping

from gtao.plot import Comparison
from gtao.workflows.standings import mean, numbers_of, ranked

__all__ = ["csv_text", "dome_means", "lit_csv", "lit_means", "markdown_text", "step_means"]

#: Roughness -> comparison of the frames.
Tables = Mapping[str, Comparison]
#: Two keys and a method -> error.
Errors = dict[str, dict[str, dict[str, float]]]


def dome_means(tables: Tables) -> Errors:
    """Source -> roughness -> method -> mean RMSE over the frames."""
    found: Errors = {}
    for roughness, table in tables.items():
        for source, methods in ranked(numbers_of(table), {}).items():
            found.setdefault(source, {})[roughness] = {name: row["rmse"] for name, row in methods.items()}
    return found


def lit_means(lit: Mapping[str, Tables]) -> Errors:
    """Roughness -> group -> composite -> mean relative RMSE over light and frames, each light as heavy as the next."""
    sums: dict[str, dict[str, dict[str, list[float]]]] = {}
    for tables in lit.values():
        for roughness, table in tables.items():
            for group, methods in ranked(numbers_of(table), {}).items():
                for name, row in methods.items():
                    sums.setdefault(roughness, {}).setdefault(group, {}).setdefault(name, []).append(row["rmse"])
    return {
        roughness: {group: {name: mean(v) for name, v in methods.items()} for group, methods in groups.items()}
        for roughness, groups in sums.items()
    }


def step_means(steps: Mapping[str, Mapping[str, Mapping[str, float]]]) -> dict[str, dict[str, float]]:
    """Roughness -> step -> mean over the frames, from roughness -> frame -> step."""
    found = {}
    for roughness, frames in steps.items():
        names = next(iter(frames.values()))
        found[roughness] = {name: mean([frame[name] for frame in frames.values()]) for name in names}
    return found


def csv_text(tables: Tables) -> str:
    """One row per frame, roughness, source and method."""
    out, writer = _writer(["frame", "roughness", "source", "method", "rmse", "bias"])
    for roughness, table in tables.items():
        _rows(writer, table, [roughness])
    return out.getvalue()


def lit_csv(lit: Mapping[str, Tables]) -> str:
    """One row per frame, light, roughness, group and composite."""
    out, writer = _writer(["frame", "light", "roughness", "source", "method", "rmse", "bias"])
    for light, tables in lit.items():
        for roughness, table in tables.items():
            _rows(writer, table, [light, roughness])
    return out.getvalue()


def _writer(head: list[str]):
    out = text_io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(head)
    return out, writer


def _rows(writer, table: Comparison, keys: list[str]) -> None:
    for scene in table.scenes:
        for m in scene.methods:
            numbers = (f"{m.metrics[name]:.6g}" for name in ("rmse", "bias"))
            writer.writerow([scene.name, *keys, m.group, m.name, *numbers])


def markdown_text(means: Errors) -> str:
    """A section per source: mean RMSE of every method at every roughness, sorted by the mean over all."""
    parts = ["# RMSE of specular occlusion, against traced reflections\n"]
    for source, rows in means.items():
        names = next(iter(rows.values()))
        overall = {name: mean([row[name] for row in rows.values()]) for name in names}
        lines = [["method", *rows, "mean"], ["---"] + ["---:"] * (len(rows) + 1)]
        for name in sorted(names, key=overall.__getitem__):
            lines.append([name, *(f"{row[name]:.4f}" for row in rows.values()), f"{overall[name]:.4f}"])
        text = "".join("| " + " | ".join(line) + " |\n" for line in lines)
        parts.append(f"## {source}\n\n{text}")
    return "\n".join(parts)
