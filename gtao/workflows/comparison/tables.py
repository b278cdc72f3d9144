"""A comparison as plain rows: CSV, markdown, and the numbers of a record."""

import csv
import io as text_io
from collections.abc import Sequence
from typing import Any

from gtao.plot import SceneComparison

__all__ = ["csv_text", "markdown_text", "scene_numbers"]

#: Columns of the tables: metric -> heading.
COLUMNS = {
    "rmse": "RMSE",
    "corrected_rmse": "RMSE without noise",
    "field_rmse": "RMSE to the height field",
    "bias": "bias",
    "mae": "MAE",
    "psnr": "PSNR (dB)",
    "ssim": "SSIM",
    "dssim": "DSSIM",
    "flip": "FLIP",
}


def csv_text(scenes: Sequence[SceneComparison]) -> str:
    """One row per frame, group and method."""
    out = text_io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["frame", "group", "method", "taps", "milliseconds", *COLUMNS])
    for scene in scenes:
        for m in scene.methods:
            numbers = [m.taps, m.milliseconds, *(m.metrics.get(name) for name in COLUMNS)]
            writer.writerow([scene.name, m.group, m.name, *("" if v is None else f"{v:.6g}" for v in numbers)])
    return out.getvalue()


def markdown_text(scenes: Sequence[SceneComparison]) -> str:
    """A section per group: RMSE of every method on every frame, and the mean, sorted by it."""
    groups = dict.fromkeys(m.group for scene in scenes for m in scene.methods)
    parts = [_group(scenes, group) for group in groups]
    floor = [["truth's own noise", *(f"{s.noise:.4f}" for s in scenes)]]
    parts.append("## noise\n\n" + _table(["", *(s.name for s in scenes)], floor))
    return "# RMSE against ray-traced truth\n\n" + "\n".join(parts)


def _group(scenes: Sequence[SceneComparison], group: str) -> str:
    rows: dict[str, list[Any]] = {}
    for i, scene in enumerate(scenes):
        for m in scene.methods:
            if m.group == group:
                rows.setdefault(m.name, [None] * len(scenes))[i] = m.metrics["rmse"]
    means = {name: sum(values) / len(values) for name, values in rows.items()}
    lines = [
        [name, *(f"{v:.4f}" for v in rows[name]), f"{means[name]:.4f}"] for name in sorted(means, key=means.__getitem__)
    ]
    return f"## {group}\n\n" + _table(["method", *(s.name for s in scenes), "mean"], lines)


def _table(head: list[str], rows: list[list[str]]) -> str:
    lines = [head, ["---"] + ["---:"] * (len(head) - 1), *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def scene_numbers(scene: SceneComparison) -> dict[str, Any]:
    """What a record says of one frame."""
    return {
        "radius": scene.radius,
        "noise": scene.noise,
        "limit_rmse": scene.limit_rmse,
        "methods": [{"group": m.group, "method": m.name, "taps": m.taps} | dict(m.metrics) for m in scene.methods],
        "timing": {m.name: {"milliseconds": m.milliseconds} for m in scene.methods if m.milliseconds is not None},
        "curves": {name: [list(point) for point in curve] for name, curve in scene.curves.items()},
        "deviations": {name: [list(step) for step in walk] for name, walk in scene.deviations.items()},
        "budgets": {name: budget.to_dict() for name, budget in scene.budgets.items()},
        "strata": {
            name: {quantity: table.to_dict() for quantity, table in tables.items()}
            for name, tables in scene.strata.items()
        },
    }
