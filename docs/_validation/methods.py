"""The methods that go by a name, with what they cost and how far they are from the truth."""

import gtao

from .comparison import DEFAULTS, by_method, rows_of
from .markdown import table


def mean(values):
    values = list(values)
    return f"{sum(values) / len(values):.3f}"


def section(record):
    """A table of all named methods, the lowest mean error first."""
    scenes = record["numbers"]["scenes"]
    errors = by_method(scenes, DEFAULTS, "corrected_rmse")
    solid = [scene["solid"] for scene in scenes.values()]
    taps = {name: row["taps"] for name, row in rows_of(next(iter(scenes.values())), DEFAULTS).items()}
    body = []
    for name, row in errors.items():
        pairs = list(zip(row, solid, strict=True))
        filtered = "yes" if gtao.config.named(name, 1.0).spatial else ""
        body.append(
            [
                f"`{name}`",
                gtao.config.NAMED[name].summary,
                f"{taps[name]:g}",
                filtered,
                mean(v for v, is_solid in pairs if is_solid),
                mean(v for v, is_solid in pairs if not is_solid),
            ]
        )
    return table(["method", "", "samples", "filter", "RMSE, solid scenes", "RMSE, thin scenes"], body)
