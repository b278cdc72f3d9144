"""How the recommended pipeline for sequences was chosen, and what stands beside it, from ``fits/temporal``."""

from math import exp

from .markdown import table

HISTORY = "one slice, history"


def key(value):
    """A value as the key of its score: records hold tuples as lists, and all keys as texts."""
    return str(tuple(value) if isinstance(value, list) else value)


def searched(numbers, config):
    """Every option: its values by preference, with their errors over the least."""
    body = []
    for option, values in config["search"].items():
        scores, chosen, cells = numbers["scores"][option], key(numbers["chosen"][option]), []
        least = min(scores.values())
        for value in map(key, values):
            cell = f"{value}: {exp(scores[value] - least):.3f}"
            cells.append(f"**{cell}**" if value == chosen else cell)
        body.append([option, " · ".join(cells)])
    return table(["option", "value: mean error over the least"], body)


def compared(numbers, config):
    """Errors of every choice in every animation, and how restless it is."""
    rmse = numbers["rmse"]
    parts = (part for name in config["animations"] for part in (name, f"{name}, trail"))
    columns = [part for part in parts if part in rmse[HISTORY]]
    body = [
        [name, *(f"{rmse[name][column]:.4f}" for column in columns), f"{numbers['flicker'][name]:.4f}"]
        for name in numbers["order"]
    ]
    return table(["per frame", *columns, "change at rest"], body)


def section(record):
    numbers, config = record["numbers"], record["config"]
    return f"""\
`gtao.Pipeline.recommended(radius, temporal=True)` takes one slice of the recommended bitmask per frame and a history.
Its options were searched one after the other against ray-traced truth, on {len(config["animations"])} embedded
animations at {config["resolution"]} pixels from frame {config["first"]} on, with the trails of moving shadows as
further ones: of the values below, listed by preference, the first was taken whose mean error (geometric) is within
{config["gain"]:.1%} of the least. A window is that of the range and that of the deviations.

{searched(numbers, config)}

Errors beside other choices, in the same animations, and how much the scene at rest changes from one frame to the next:

{compared(numbers, config)}"""
