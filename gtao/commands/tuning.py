"""Scenes in, a tuned method out."""

from pathlib import Path
from typing import Annotated

import typer

import gtao

from .options import AllSensors, OutputDirectory, Resolution, Seed, distance
from .terminal import report

__all__ = ["tune"]


def _factors(text: str) -> tuple[float, ...]:
    return tuple(distance(word.strip()) for word in text.split(","))


def tune(
    output: OutputDirectory,
    scenes: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="SCENE",
            help="Mitsuba .xml files, embedded scenes, EXR frames by `gtao render`, or folders; default: all embedded.",
        ),
    ] = None,
    method: Annotated[str, typer.Option(help="Method to start from; `gtao methods` lists them.")] = "xegtao-high",
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Option of the method, lengths in radii; repeatable."),
    ] = None,
    parameter: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY[=LOW:HIGH]", help="Continuous option to tune; repeatable; default: XeGTAO's constants."
        ),
    ] = None,
    search: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY=VALUE,…", help="Discrete option to try out around it; repeatable."),
    ] = None,
    max_taps: Annotated[
        int | None, typer.Option(min=2, help="Leave out combinations with more depth samples per pixel.")
    ] = None,
    held_out: Annotated[
        list[str] | None, typer.Option(metavar="SCENE", help="Scene, file or folder to score only; repeatable.")
    ] = None,
    folds: Annotated[
        int | None, typer.Option(min=0, help="Parts of the scenes, each scored by a tuning on the others; 0: none.")
    ] = None,
    rival: Annotated[str | None, typer.Option(help="Method to compare with at equal slices and steps.")] = None,
    radius: Annotated[
        float | None,
        typer.Option(
            parser=distance, metavar="DISTANCE", help="Reach of occluders in scene units; default: the scene's."
        ),
    ] = None,
    radii: Annotated[
        tuple | None, typer.Option(parser=_factors, metavar="FACTOR,…", help="Use every view at these radii.")
    ] = None,
    resolution: Resolution = None,
    spp: Annotated[int | None, typer.Option(min=16, help="Rays per pixel of the truth.")] = None,
    all_sensors: AllSensors = True,
    frames: Annotated[int | None, typer.Option(min=1, help="Noise frames per view.")] = None,
    rounds: Annotated[int | None, typer.Option(min=1, help="Most rounds of gradient steps and searches.")] = None,
    bootstrap: Annotated[int | None, typer.Option(min=0, help="Bootstrap draws for the intervals.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Small and noisy: a smoke run.")] = False,
    seed: Seed = 0,
    cache: Annotated[Path | None, typer.Option(help="Directory of cached views.")] = None,
) -> None:
    """Fit a method's options to ray-traced truth: tuned method, table, record, report."""
    config = gtao.workflows.TuneConfig.from_options(
        quick=quick,
        scenes=tuple(scenes or ()),
        held_out=tuple(held_out or ()),
        method=method,
        settings=tuple(settings or ()),
        parameters=tuple(parameter or ()),
        search=tuple(search or ()),
        max_taps=max_taps,
        rival=rival,
        radius=radius,
        radii=radii,
        resolution=resolution,
        spp=spp,
        all_sensors=all_sensors,
        folds=folds,
        n_frames=frames,
        n_bootstrap=bootstrap,
        max_rounds=rounds,
        seed=seed,
    )
    report(gtao.workflows.tune, config, output, cache=cache)
