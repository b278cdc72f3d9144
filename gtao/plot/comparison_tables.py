"""Tables of a comparison: over all scenes, and on each."""

import html
import math
from collections.abc import Sequence

import numpy as np

from .comparison import RMSE_IS, Comparison, MethodResult, SceneComparison
from .markup import html_table
from .words import number

__all__ = ["TABLE_STYLE", "Row", "scene_table", "settings_table", "summary_rows", "summary_table"]

TABLE_STYLE = """
main { max-width: 78rem; }
.lead { max-width: none; }
table { font-size: .85rem; }
th, td { padding: .3rem .6rem; }
.track { display: flex; align-items: center; gap: .6rem; }
.track s { position: relative; flex: 1; min-width: 6.5rem; height: .7rem; border-radius: .2rem; background: var(--line);
  text-decoration: none; }
.track s b { display: block; height: 100%; border-radius: .2rem; background: var(--muted); }
tr.ours .track s b { background: var(--blue); }
.track s i { position: absolute; top: -.15rem; bottom: -.15rem; width: 2px; background: var(--ink); }
.spark { vertical-align: middle; }
.spark rect { fill: var(--muted); opacity: .55; }
.spark rect.best { fill: var(--green); opacity: 1; }
abbr { text-decoration: none; border-bottom: 1px dotted var(--muted); cursor: help; }
"""

#: Metric, heading, what it says, format.
_METRICS = (
    ("corrected_rmse", "no noise", "RMSE after the noise of the truth has been taken out", ".4f"),
    ("field_rmse", "to field", "RMSE against the brute-force march of the depth buffer", ".4f"),
    ("bias", "bias", "mean of estimate minus truth: positive is too bright", "+.4f"),
    ("mae", "MAE", "mean absolute error", ".4f"),
    ("psnr", "PSNR", "peak signal-to-noise ratio in dB: higher is better", ".1f"),
    ("ssim", "SSIM", "structural similarity: 1 is equal", ".3f"),
    ("flip", "FLIP", "perceived difference when the images are flipped: 0 is equal", ".3f"),
)

_RMSE = "<abbr title='{}'>RMSE</abbr>"
_COSTS = ("<abbr title='depth samples per pixel'>taps</abbr>", "<abbr title='one frame, warm kernel'>ms</abbr>")

#: Width and height of a bar of the small multiples, in pixels.
_SPARK = 5, 20


class Row:
    """One method of one group over all scenes.

    Attributes:
        results: Its result per scene, None where it was not run.
        present: Those that exist.
        errors: Its RMSE per scene, infinite where it was not run.
        lowest: Number of scenes on which its RMSE is the lowest of the group.
    """

    def __init__(self, results: Sequence[MethodResult | None]):
        self.results = results
        self.present = [m for m in results if m is not None]
        self.errors = [math.inf if m is None else m.metrics["rmse"] or 0.0 for m in results]
        self.lowest = 0

    @property
    def label(self) -> str:
        """What readers see."""
        return self.present[0].label

    @property
    def complete(self) -> bool:
        """Whether it was run on every scene."""
        return len(self.present) == len(self.results)

    def mean(self, metric: str) -> float | None:
        """Mean over its scenes; None where one of them lacks the metric."""
        values = [m.metrics.get(metric) for m in self.present]
        return None if any(v is None for v in values) else float(np.mean([v for v in values if v is not None]))

    @property
    def rmse(self) -> float:
        """Mean RMSE over its scenes."""
        return float(np.mean([m.metrics["rmse"] for m in self.present]))


def summary_rows(comparison: Comparison, group: str) -> list[Row]:
    """Methods of a group, the lowest mean RMSE first; those that miss a scene come last, for they do not compare."""
    names = dict.fromkeys(m.name for scene in comparison.scenes for m in scene.methods if m.group == group)
    rows = []
    for name in names:
        found = [
            next((m for m in scene.methods if (m.group, m.name) == (group, name)), None) for scene in comparison.scenes
        ]
        rows.append(Row(found))
    for i in range(len(comparison.scenes)):
        least = min(row.errors[i] for row in rows)
        for row in rows:
            row.lowest += row.errors[i] == least < math.inf
    return sorted(rows, key=lambda row: (not row.complete, row.rmse))


def summary_table(comparison: Comparison, rows: Sequence[Row]) -> str:
    """Means over scenes, with a small bar per scene on that scene's own scale."""
    many = len(comparison.scenes) > 1
    shown = [m for m in _METRICS if any(row.mean(m[0]) is not None for row in rows)]
    taps, times = (any(getattr(row.present[0], key) is not None for row in rows) for key in ("taps", "milliseconds"))
    head = [
        "method",
        f"<abbr title='{html.escape(comparison.rmse_is)}'>RMSE</abbr>",
        *(["each scene", "lowest on"] if many else []),
        *_heads(shown),
    ]
    head += [cost for cost, there in zip(_COSTS, (taps, times), strict=True) if there]
    top = max(row.rmse for row in rows)
    cells = []
    for row in rows:
        missing = "" if row.complete else f" ({len(row.present)} of {len(row.results)} scenes)"
        line = [html.escape(row.label + missing), _bar(row.rmse, top)]
        if many:
            line += [_spark(comparison, row, rows), f"{row.lowest} of {len(row.results)}"]
        line += [_number(row.mean(m[0]), m[3]) for m in shown]
        line += [_number(_mean_of(row, "taps"), ".0f")] if taps else []
        line += [_number(_mean_of(row, "milliseconds"), ".2f")] if times else []
        cells.append(line)
    return html_table(head, cells, ["ours" if row.present[0].ours else "" for row in rows])


def scene_table(scene: SceneComparison) -> str:
    """All methods on one scene by group, the lowest RMSE first; a tick marks the limit of one depth layer."""
    top = max(m.metrics["rmse"] or 0.0 for m in scene.methods)
    parts = []
    for group in dict.fromkeys(m.group for m in scene.methods):
        rows = sorted((m for m in scene.methods if m.group == group), key=lambda m: m.metrics["rmse"])
        shown = [m for m in _METRICS if any(row.metrics.get(m[0]) is not None for row in rows)]
        taps, times = (any(getattr(m, key) is not None for m in rows) for key in ("taps", "milliseconds"))
        head = [html.escape(group) or "method", _RMSE.format(html.escape(RMSE_IS)), *_heads(shown)]
        head += [cost for cost, there in zip(_COSTS, (taps, times), strict=True) if there]
        cells = []
        for m in rows:
            line = [html.escape(m.label), _bar(m.metrics["rmse"] or 0.0, top, scene.limit_rmse)]
            line += [_number(m.metrics.get(name), spec) for name, _, _, spec in shown]
            line += [_number(m.taps, ".0f")] if taps else []
            line += [_number(m.milliseconds, ".2f")] if times else []
            cells.append(line)
        parts.append(html_table(head, cells, ["ours" if m.ours else "" for m in rows]))
    return "".join(parts)


def settings_table(comparison: Comparison) -> str:
    """Each method's settings on the first scene that has it, by group; nothing where none are given."""
    found: dict[tuple[str, str], str] = {}
    for group in comparison.groups():
        for m in (m for scene in comparison.scenes for m in scene.methods):
            if m.group == group and m.settings:
                found.setdefault((group, m.label), m.settings)
    rows = [
        [html.escape(label), html.escape(group), f"<code>{html.escape(text)}</code>"]
        for (group, label), text in found.items()
    ]
    return html_table(["method", "group", "settings"], rows) if rows else ""


def _heads(shown: Sequence[tuple[str, str, str, str]]) -> list[str]:
    return [f"<abbr title='{says}'>{name}</abbr>" for _, name, says, _ in shown]


def _number(value: float | None, spec: str) -> str:
    return "–" if value is None else number(value, spec)


def _mean_of(row: Row, attribute: str) -> float | None:
    values = [getattr(m, attribute) for m in row.present]
    return None if any(v is None for v in values) else float(np.mean(values))


def _bar(value: float, top: float, limit: float | None = None) -> str:
    def percent(v: float) -> float:
        return 100 * v / top if top > 0 else 0.0

    tick = "" if limit is None or limit > top else f"<i style='left:{percent(limit):.1f}%' title='one depth layer'></i>"
    return f"<div class=track><s><b style='width:{percent(value):.1f}%'></b>{tick}</s>{value:.4f}</div>"


def _spark(comparison: Comparison, row: Row, rows: Sequence[Row]) -> str:
    """A bar per scene, as high as the share of the largest error there; the smallest stands out."""
    width, height = _SPARK
    bars, words = [], []
    for i, (scene, error) in enumerate(zip(comparison.scenes, row.errors, strict=True)):
        if math.isinf(error):
            continue
        others = [r.errors[i] for r in rows if not math.isinf(r.errors[i])]
        size = max(1.0, height * error / (max(others) or 1.0))
        mark = " class=best" if error == min(others) else ""
        bars.append(f"<rect{mark} x={i * (width + 1)} y={height - size:.1f} width={width} height={size:.1f} />")
        words.append(f"{scene.name} {error:.4f}")
    return (
        f"<svg class=spark width={len(rows[0].errors) * (width + 1)} height={height} role=img>"
        f"<title>{html.escape(', '.join(words))}</title>{''.join(bars)}</svg>"
    )
