"""An animation or a scene in, frames, videos and a report out."""

from pathlib import Path
from typing import Annotated

import typer

import gtao

from .options import OutputDirectory, Quick, Radius, Resolution, Seed, Up
from .terminal import report

__all__ = ["animate"]


def animate(
    output: OutputDirectory,
    animation: Annotated[
        str | None,
        typer.Argument(
            metavar="ANIMATION|SCENE",
            help="Embedded animation (still, orbit, fast_rotation, cut, passing_object, thin_bars, waves), or a scene:"
            " an embedded one or a Mitsuba .xml file, which --orbit or --path moves; default: passing_object.",
        ),
    ] = None,
    method: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME[,KEY=VALUE…]",
            help="published-pipeline, recommended-temporal, a method of `gtao methods`, or a JSON file of one, with"
            " options of its own; repeatable.",
        ),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Option of all methods, e.g. temporal.frames=8; repeatable."),
    ] = None,
    frames: Annotated[int | None, typer.Option(min=1, help="Number of frames; default: the animation's.")] = None,
    orbit: Annotated[
        float | None, typer.Option(metavar="DEGREES", help="How far the camera of a scene goes around it.")
    ] = None,
    up: Up = None,
    path: Annotated[
        str | None,
        typer.Option(
            metavar="FILE.json",
            help='What moves a scene: {"camera": […], "movers": {"ID": […]}} with a 4x4 matrix per frame.',
        ),
    ] = None,
    radius: Radius = None,
    resolution: Resolution = None,
    spp: Annotated[int | None, typer.Option(min=16, help="Rays per pixel of each frame's truth.")] = None,
    fps: Annotated[float | None, typer.Option(help="Frames per second of the videos.")] = None,
    video: Annotated[
        str | None, typer.Option(help="'mp4', 'gif', or 'auto': MP4 where there is an FFmpeg to write it.")
    ] = None,
    exr: Annotated[bool, typer.Option("--exr", help="Also write every frame as EXR.")] = False,
    error_limit: Annotated[float | None, typer.Option(help="|error| at the bright end of the scale.")] = None,
    quick: Quick = False,
    seed: Seed = 0,
    cache: Annotated[Path | None, typer.Option(help="Directory of cached truths.")] = None,
) -> None:
    """Methods on moving images against ray-traced truth: frames, videos, flicker and ghosting, report."""
    config = gtao.workflows.AnimateConfig.from_options(
        quick=quick,
        animation=animation,
        methods=method,
        settings=settings,
        frames=frames,
        orbit=orbit,
        up=up,
        path=path,
        radius=radius,
        resolution=resolution,
        spp=spp,
        fps=fps,
        video=video,
        exr=exr,
        error_limit=error_limit,
        seed=seed,
    )
    report(gtao.workflows.animate, config, output, cache=cache)
