"""What packing costs, from ``references/packing``."""

import math

import gtao

from .markdown import table


def number(x):
    """Two significant digits without an exponent."""
    if x == 0:
        return "0"
    return f"{x:.{max(0, 1 - math.floor(math.log10(x)))}f}"


def degrees(x):
    return number(math.degrees(x))


def section(record):
    """A table of all packings, and what it rests on."""
    rows, config = record["numbers"], record["config"]
    body = [
        [
            f"`{name}`",
            f"{row['bits']}, {row['suffix'][1:].upper()}",
            row["about"],
            *(degrees(row[f"angle_{key}"]) for key in ("mean", "p99", "max", "bound")),
            number(row["visibility_rms"]),
            number(row["length_max"]) if "length_max" in row else "–",
        ]
        for name, row in ((name, rows[name]) for name in gtao.io.PACKINGS)
    ]
    head = ["packing", "bits", "what it holds", "mean", "99 %", "max", "bound", "visibility RMS", "length, max"]
    n = next(iter(rows.values()))["n"]
    origin = (
        f"Angles in degrees, between the direction before and after, at {n} pixels of {len(config['scenes'])} embedded"
        " scenes; the bound is what theory allows at most, {eq}`eq-octahedral-bound`. Length: the largest error of the"
        " length of the mean direction. From `references/packing/record.json` (`python references/packing/run.py`)."
    )
    return f"{table(head, body)}\n\n{origin}\n"
