"""Studies of glossy reflections: scenes in, a directory of results out."""

from typing import Annotated

import typer

import gtao

from .options import AllSensors, Methods, OnlyScenes, OutputDirectory, Quick, Radius, Resolution, Seed, Turn, Up
from .terminal import report

__all__ = ["compare_specular", "fit_aperture"]

Roughness = Annotated[
    list[float] | None, typer.Option(min=0, max=1, help="Perceptual roughness, repeatable; α is its square.")
]
F0 = Annotated[float | None, typer.Option("--f0", min=0, max=1, help="Reflectance at normal incidence.")]
Rays = Annotated[int | None, typer.Option(min=16, help="Rays per pixel.")]


def compare_specular(
    output: OutputDirectory,
    scenes: OnlyScenes = None,
    roughness: Roughness = None,
    f0: F0 = None,
    environment: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LIGHT",
            help="Light of composites, repeatable: a .hdr or .exr map, 'gradient', 'vmf:KAPPA', 'disc:DEGREES',"
            " 'sunsky', or 'none'.",
        ),
    ] = None,
    lit_roughness: Annotated[
        list[float] | None, typer.Option(min=0, max=1, help="Roughness under these lights, repeatable.")
    ] = None,
    method: Methods = None,
    radius: Radius = None,
    up: Up = None,
    turn: Turn = None,
    resolution: Resolution = None,
    spp: Annotated[int | None, typer.Option(min=32, help="Rays per pixel under the white dome.")] = None,
    lit_spp: Annotated[int | None, typer.Option(min=32, help="Pairs of rays per pixel under each light.")] = None,
    all_sensors: AllSensors = False,
    quick: Quick = False,
    seed: Seed = 0,
) -> None:
    """Every method of specular occlusion against traced reflections: table, pictures, report."""
    config = gtao.workflows.CompareSpecularConfig.from_options(
        quick=quick,
        scenes=scenes,
        roughness=roughness,
        f0=f0,
        environments=environment,
        lit_roughness=lit_roughness,
        methods=method,
        radius=radius,
        up=up,
        turn=turn,
        resolution=resolution,
        spp=spp,
        lit_spp=lit_spp,
        all_sensors=all_sensors,
        seed=seed,
    )
    report(gtao.workflows.compare_specular, config, output)


def fit_aperture(
    output: OutputDirectory,
    scenes: OnlyScenes = None,
    roughness: Roughness = None,
    f0: F0 = None,
    reference: Annotated[
        str | None, typer.Option(help="What is met: 'traced' truth, or what is reflected out of the same 'cone'.")
    ] = None,
    source: Annotated[
        str | None, typer.Option(help="Visibility and bent normals: 'traced', or 'dense' slices of the depth buffer.")
    ] = None,
    weighting: Annotated[str | None, typer.Option(help="Of both: 'cosine' or 'uniform'.")] = None,
    aperture: Annotated[
        str | None, typer.Option(help="Of the visibility cone: 'seed' as published, 'tilted' or 'matched'.")
    ] = None,
    metric: Annotated[str | None, typer.Option(help="'dssim' as published, or 'rmse'.")] = None,
    radius: Radius = None,
    resolution: Resolution = None,
    spp: Rays = None,
    all_sensors: AllSensors = False,
    bootstrap: Annotated[int | None, typer.Option(min=0, help="Bootstrap draws for the interval.")] = None,
    quick: Quick = False,
    seed: Seed = 0,
) -> None:
    """Refit u of the reflection cone, cos α_s = u^(α²/2), to ray-traced specular occlusion."""
    config = gtao.workflows.FitApertureConfig.from_options(
        quick=quick,
        scenes=scenes,
        roughness=roughness,
        f0=f0,
        reference=reference,
        source=source,
        weighting=weighting,
        aperture=aperture,
        metric=metric,
        radius=radius,
        resolution=resolution,
        spp=spp,
        all_sensors=all_sensors,
        n_bootstrap=bootstrap,
        seed=seed,
    )
    report(gtao.workflows.fit_aperture, config, output)
