"""Options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["MAX_SIDE", "OutputDirectory", "Samples", "Seed", "distance"]

#: A square image of more pixels is not read from files either, and memory would end the process without a word.
MAX_SIDE = 16384

Samples = Annotated[int, typer.Option(min=1, help="Rays or paths per pixel.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of the random numbers.")]
OutputDirectory = Annotated[
    Path, typer.Option("-o", "--output", metavar="DIR", help="Directory for everything written.")
]


def distance(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not a number") from None
    if not value > 0:
        raise typer.BadParameter(f"must be positive or inf, got {text}")
    return value
