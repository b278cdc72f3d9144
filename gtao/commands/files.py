"""One file in, one file out."""

import math
from pathlib import Path
from typing import Annotated, Literal

import typer

import gtao

from .options import MAX_SIDE, Samples, Seed, distance
from .terminal import Bars, out

__all__ = ["export", "export_packing", "occlusion", "render"]

OutputExr = Annotated[Path, typer.Option("-o", "--output", metavar="OUT.exr", help="EXR file to write.")]
Sensor = Annotated[int, typer.Option(help="Index of the camera in the scene, from 0.")]
NormalFrame = Literal["auto", "view", "world"]
Normals = Annotated[str, typer.Option(help="'shading' or 'geometric' normals.")]


def render(
    scene: Annotated[str, typer.Argument(help="Mitsuba .xml file, or name of an embedded scene.")],
    output: OutputExr,
    sensor: Sensor = 0,
    resolution: Annotated[
        int | None, typer.Option(min=1, max=MAX_SIDE, help="Longer side in pixels; default: the scene's.")
    ] = None,
    normals: Normals = "shading",
    spp: Samples = 256,
    max_distance: Annotated[
        float,
        typer.Option(parser=distance, metavar="DISTANCE", help="Reach of occluders in scene units, or inf."),
    ] = math.inf,
    bounces: Annotated[int, typer.Option(min=0, help="Also trace transport images T_1 … T_K up to this K.")] = 0,
    layers: Annotated[int, typer.Option(min=0, help="Also peel this many bodies along every pixel's ray.")] = 0,
    directional: Annotated[
        bool, typer.Option("--directional", help="Also write spherical harmonics of the visibility, bands 0 to 2.")
    ] = False,
    seed: Seed = 0,
) -> None:
    """Mitsuba scene -> EXR with G-buffer and ray-traced ground truth."""
    with Bars() as bars:
        gtao.workflows.render_scene(
            scene,
            output,
            sensor=sensor,
            resolution=resolution,
            normals=normals,
            spp=spp,
            max_distance=max_distance,
            n_bounces=bounces,
            n_layers=layers,
            directional=directional,
            seed=seed,
            progress=bars,
        )
    out.print(f"wrote {output}", soft_wrap=True)


def occlusion(
    source: Annotated[Path, typer.Argument(metavar="IN.exr", help="EXR with depth and normals.")],
    output: OutputExr,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Option of the estimator, e.g. radius=0.5; repeatable."),
    ] = None,
    method: Annotated[str, typer.Option(help="Estimator; `gtao methods` lists them.")] = "gtao",
    frame: Annotated[int, typer.Option(min=0, help="Frame index of the noise.")] = 0,
    camera: Annotated[
        Path | None, typer.Option(help="JSON file with the camera, where the EXR does not carry one.")
    ] = None,
    fov_y: Annotated[
        float | None,
        typer.Option(metavar="DEGREES", help="Vertical field of view, where there is no camera."),
    ] = None,
    layer: Annotated[str | None, typer.Option(help="Layer or view layer to read.")] = None,
    normal_frame: Annotated[
        NormalFrame, typer.Option(help="Frame of the normals in the file; 'auto' believes their names.")
    ] = "auto",
    derive_normals: Annotated[bool, typer.Option(help="Derive normals from the depth.")] = False,
    pack: Annotated[
        list[str] | None,
        typer.Option(metavar="PACKING", help="Also write visibility and bent normals packed, e.g. rgba8; repeatable."),
    ] = None,
) -> None:
    """EXR with depth and normals -> EXR with visibility added, and with --set bent_normal=true directions."""
    packed = gtao.workflows.occlusion_file(
        source,
        output,
        method=method,
        settings=settings or (),
        frame_index=frame,
        camera_file=camera,
        fov_y=None if fov_y is None else math.radians(fov_y),
        layer=layer,
        normal_frame=normal_frame,
        derive_normals=derive_normals,
        packings=pack or (),
    )
    out.print(f"wrote {output}", soft_wrap=True)
    for path, errors in packed.items():
        out.print(f"wrote {path}\n  {errors}", soft_wrap=True, highlight=False)


def export(
    fit: Annotated[Path, typer.Argument(metavar="RECORD", help="What refit wrote: record.json or coefficients.json.")],
    language: Annotated[str, typer.Option(help="'hlsl', 'glsl', 'wgsl', 'c' or 'json'.")] = "hlsl",
) -> None:
    """Coefficients -> shader code, on standard output."""
    print(gtao.workflows.export_fit(fit, language), end="")


def export_packing(
    name: Annotated[str, typer.Argument(metavar="PACKING", help="What --pack of occlusion was given, e.g. rgba8.")],
    language: Annotated[str, typer.Option(help="'hlsl', 'glsl', 'wgsl' or 'c'.")] = "hlsl",
    weighting: Annotated[str, typer.Option(help="'cosine' or 'uniform', of the estimate.")] = "cosine",
) -> None:
    """Packing -> shader code that reads it back, on standard output."""
    print(gtao.io.packing_code(name, language, weighting), end="")
