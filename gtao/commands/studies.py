"""Scenes in, a directory of results out."""

from pathlib import Path
from typing import Annotated

import typer

import gtao

from .options import (
    MAX_SIDE,
    AllSensors,
    Methods,
    OnlyScenes,
    OutputDirectory,
    Quick,
    Radius,
    Resolution,
    Seed,
    Turn,
    Up,
)
from .terminal import report

__all__ = ["compare", "compare_lighting", "refit"]


def refit(
    scenes: Annotated[
        list[str] | None,
        typer.Argument(help="Mitsuba .xml files or names of embedded scenes; default: all embedded ones."),
    ] = None,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Directory for the results.")] = Path(
        "refit"
    ),
    also_embedded: Annotated[bool, typer.Option(help="Fit the embedded scenes together with yours.")] = False,
    quick: Annotated[bool, typer.Option("--quick", help="Small and noisy: a smoke run.")] = False,
    resolution: Annotated[
        int | None, typer.Option(min=8, max=MAX_SIDE, help="Longer side of the images in pixels.")
    ] = None,
    spp: Annotated[int | None, typer.Option(min=16, help="Paths per pixel.")] = None,
    bounces: Annotated[str, typer.Option(help="Bounces of the headline fit: 3, 4, … or inf.")] = "4",
    form: Annotated[str, typer.Option(help="Form of the headline fit.")] = "linear_cubic",
    procedure: Annotated[str, typer.Option(help="'joint', or 'two-step' as published.")] = "joint",
    constraint: Annotated[
        list[str] | None, typer.Option(help="Constraint of the fit; repeatable; 'none' for none.")
    ] = None,
    weighting: Annotated[str, typer.Option(help="'scene', 'pixel' or 'uniform' in visibility.")] = "scene",
    regressor: Annotated[
        str,
        typer.Option(help="Visibility to fit on: 'ray' (traced) or 'screen' (estimated, as an engine has it)."),
    ] = "ray",
    all_sensors: Annotated[bool, typer.Option(help="Use every camera of every scene.")] = False,
    seed: Seed = 0,
    bootstrap: Annotated[int | None, typer.Option(min=0, help="Bootstrap draws for the intervals.")] = None,
    cache: Annotated[Path | None, typer.Option(help="Directory of cached transport images.")] = None,
) -> None:
    """Scenes -> transport images -> fit -> record, coefficients, shader code, plots and report."""
    config = gtao.workflows.RefitConfig.from_options(
        quick=quick,
        scenes=tuple(scenes or ()),
        also_embedded=also_embedded,
        resolution=resolution,
        spp=spp,
        bounces=bounces,
        form=form,
        procedure=procedure,
        constraints=tuple(constraint) if constraint else None,
        weighting=weighting,
        regressor=regressor,
        all_sensors=all_sensors,
        seed=seed,
        n_bootstrap=bootstrap,
    )
    report(gtao.workflows.refit, config, output, cache=cache)


def compare(
    output: OutputDirectory,
    scenes: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[SCENE]...",
            help="Mitsuba .xml files, embedded scenes, EXR frames by `gtao render`, or folders; default: all embedded.",
        ),
    ] = None,
    method: Annotated[
        list[str] | None, typer.Option(help="Method to compare, repeatable; default: all of `gtao methods`.")
    ] = None,
    radius: Radius = None,
    resolution: Resolution = None,
    spp: Annotated[int | None, typer.Option(min=16, help="Rays per pixel of the truth.")] = None,
    all_sensors: AllSensors = False,
    quick: Quick = False,
    seed: Seed = 0,
) -> None:
    """Every method against ray-traced truth: table, error maps, error budgets, report."""
    config = gtao.workflows.CompareConfig.from_options(
        quick=quick,
        scenes=scenes,
        methods=method,
        radius=radius,
        resolution=resolution,
        spp=spp,
        all_sensors=all_sensors,
        seed=seed,
    )
    report(gtao.workflows.compare, config, output)


def compare_lighting(
    output: OutputDirectory,
    scenes: OnlyScenes = None,
    environment: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LIGHT",
            help="Light, repeatable: a .hdr or .exr map, 'gradient', 'vmf:KAPPA', 'disc:DEGREES' or 'sunsky'.",
        ),
    ] = None,
    method: Methods = None,
    radius: Radius = None,
    up: Up = None,
    turn: Turn = None,
    resolution: Resolution = None,
    spp: Annotated[int | None, typer.Option(min=32, help="Rays per pixel.")] = None,
    all_sensors: AllSensors = False,
    quick: Quick = False,
    seed: Seed = 0,
) -> None:
    """Every method of irradiance against ray-traced light: table, pictures, report."""
    config = gtao.workflows.CompareLightingConfig.from_options(
        quick=quick,
        scenes=scenes,
        environments=environment,
        methods=method,
        radius=radius,
        up=up,
        turn=turn,
        resolution=resolution,
        spp=spp,
        all_sensors=all_sensors,
        seed=seed,
    )
    report(gtao.workflows.compare_lighting, config, output)
