"""Numbers of an animation as text."""

import csv
import io
import math

from gtao.plot import AnimationComparison

__all__ = ["csv_text", "markdown_text"]


def csv_text(comparison: AnimationComparison) -> str:
    """A row per method and frame; nothing where there is no value."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    kinds = list(dict.fromkeys(kind for m in comparison.methods for kind in m.curves))
    writer.writerow(["method", "frame", *kinds])
    for m in comparison.methods:
        for i in range(comparison.n_frames):
            values = (m.curves[kind][i] for kind in kinds)
            writer.writerow([m.name, i, *("" if math.isnan(v) else repr(v) for v in values)])
    return text.getvalue()


def markdown_text(comparison: AnimationComparison) -> str:
    """A row per method, with the numbers of the whole animation."""
    names = list(comparison.methods[0].numbers)
    lines = [f"| method | {' | '.join(names)} |", "| --- |" + " ---: |" * len(names)]
    for m in comparison.methods:
        cells = ("–" if m.numbers[name] is None else f"{m.numbers[name]:.4g}" for name in names)
        lines.append(f"| {m.name} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"
