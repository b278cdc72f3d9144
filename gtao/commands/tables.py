"""Tables of specular occlusion."""

from pathlib import Path
from typing import Annotated

import typer

import gtao

from .options import Seed
from .terminal import Bars, out

__all__ = ["bake"]


def _sizes(text: str) -> tuple[int, ...]:
    try:
        sizes = tuple(int(word) for word in text.split(","))
    except ValueError:
        raise typer.BadParameter(f"{text!r} is neither a number nor numbers with commas between") from None
    if not all(2 <= n <= 4096 for n in sizes):
        raise typer.BadParameter(f"there are 2 to 4096 texels along an axis, got {text}")
    return sizes


def bake(
    kind: Annotated[
        str,
        typer.Argument(help="'cone-cone', 'cone-lobe', 'brdf-3d', 'brdf-4d', 'brdf-5d' or 'environment-brdf'."),
    ],
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="FILE", help="File to write: .npy, .npz, .exr, .dds, .raw or .bin."),
    ],
    size: Annotated[
        tuple | None,
        typer.Option(parser=_sizes, metavar="N[,N…]", help="Texels along every axis, or along x, y, …."),
    ] = None,
    axes: Annotated[
        str | None, typer.Option(help="Parametrisation, e.g. 'published' or 'linear'; default: the most accurate one.")
    ] = None,
    encoding: Annotated[
        str | None, typer.Option(help="'unorm8', 'unorm16', 'half', 'float' or 'bc4'; default: the format's own.")
    ] = None,
    distribution: Annotated[str, typer.Option(help="Of cone-lobe: 'ggx' or 'phong'.")] = "ggx",
    bsdf: Annotated[
        str | None,
        typer.Option(metavar="TYPE|JSON", help="BSDF of Mitsuba to bake instead of GGX; its alpha is an axis."),
    ] = None,
    code: Annotated[
        list[str] | None,
        typer.Option(metavar="LANGUAGE", help="Also write code that looks it up: 'hlsl', 'glsl', 'wgsl', 'c'."),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="RECORD.json", help="Also write the errors with where they are largest.")
    ] = None,
    places: Annotated[int, typer.Option(min=100, help="Random places that errors are measured at.")] = 20000,
    seed: Seed = 0,
) -> None:
    """Quadrature -> table of specular occlusion, and what looking it up is off by."""
    sizes = next(iter(size)) if size is not None and len(size) == 1 else size
    with Bars() as bars:
        outcome = gtao.workflows.bake_table(
            kind,
            output,
            size=sizes,
            axes=axes,
            encoding=encoding,
            distribution=distribution,
            bsdf=bsdf,
            languages=code or (),
            report=report,
            n_places=places,
            seed=seed,
            progress=bars,
        )
    out.print(outcome.summary(), soft_wrap=True, highlight=False)
    for path in outcome.paths:
        out.print(f"wrote {path}", soft_wrap=True)
