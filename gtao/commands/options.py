"""Options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

__all__ = [
    "MAX_SIDE",
    "AllSensors",
    "Methods",
    "OnlyScenes",
    "OutputDirectory",
    "Quick",
    "Radius",
    "Resolution",
    "Samples",
    "Seed",
    "Turn",
    "Up",
    "distance",
]

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


Radius = Annotated[
    float | None,
    typer.Option(
        parser=distance,
        metavar="DISTANCE",
        help="Reach of occluders in scene units, or inf; default: the scene's.",
    ),
]
Resolution = Annotated[int | None, typer.Option(min=16, max=MAX_SIDE, help="Longer side in pixels.")]
AllSensors = Annotated[bool, typer.Option(help="Every camera of a scene, not only the first.")]
Quick = Annotated[bool, typer.Option(help="Small and noisy, to see every part run.")]
Up = Annotated[str | None, typer.Option(help="'x', 'y' or 'z'; default: z in embedded scenes, y in files.")]
Turn = Annotated[float | None, typer.Option(help="Degrees that the light turns from frame to frame.")]
Methods = Annotated[list[str] | None, typer.Option("--method", help="Method to compare, repeatable; default: all.")]
OnlyScenes = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="[SCENE]...", help="Mitsuba .xml files, embedded scenes, or folders; default: all embedded."
    ),
]
