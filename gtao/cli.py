"""The ``gtao`` command: thin wrappers that turn options into calls and errors into one line."""

import json
import math
import sys
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

import gtao

app = typer.Typer(
    name="gtao",
    help="Ambient occlusion that is right and can prove it.",
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    add_completion=False,
)
_out, _err = Console(), Console(stderr=True)

#: A square image of more pixels is not read from files either, and memory would end the process without a word.
MAX_SIDE = 16384


class Bars:
    """One progress bar per task, on standard error; a workflow reports ``(task, done, total)``."""

    def __init__(self) -> None:
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TaskProgressColumn(),
            TimeElapsedColumn(),
            console=_err,
        )
        self._tasks: dict[str, Any] = {}

    def __enter__(self) -> "Bars":
        self._progress.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self._progress.stop()
        else:  # leave the error behind, and no bars
            self._progress.live.transient = True
            self._progress.live.stop()

    def __call__(self, task: str, done: int, total: int) -> None:
        if task not in self._tasks:
            self._tasks[task] = self._progress.add_task(task, total=total)
        self._progress.update(self._tasks[task], completed=done, total=total)


def _version(show: bool) -> None:
    if show:
        _out.print(f"gtao {gtao.__version__}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _root(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and stop.")
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        print(context.get_help())


@app.command()
def doctor(as_json: Annotated[bool, typer.Option("--json", help="Machine-readable output.")] = False) -> None:
    """What backend will be used and why; how to get a better one."""
    report = gtao.backend.report()
    version = ".".join(map(str, report.llvm_version)) if report.llvm_version else None
    if as_json:
        found = [{"path": x.path, "major": x.major, "origin": x.origin, "usable": x.usable} for x in report.found]
        state = {
            "backend": report.backend,
            "reason": report.reason,
            "cuda": report.cuda,
            "llvm_library": report.llvm_library,
            "llvm_version": version,
            "found": found,
            "advice": report.advice,
        }
        print(json.dumps(state, indent=2))
    else:
        _out.print(f"gtao {gtao.__version__}")
        _out.print("CUDA device: " + ("found" if report.cuda else "none"))
        for library in report.found:
            state = "usable" if library.usable else "too old: Dr.Jit aborts or refuses"
            _out.print(f"LLVM {library.major or '?'} ({library.origin}): {library.path}, {state}", soft_wrap=True)
        if not report.found:
            _out.print("LLVM: none found")
        if report.backend is None:
            _out.print(f"[bold red]no backend[/]: {report.reason}", soft_wrap=True)
            _out.print(f"run: {report.advice}", soft_wrap=True, highlight=False, markup=False)
        else:
            what = f"{report.backend}" + (f" (LLVM {version})" if report.backend == "llvm" else "")
            _out.print(f"[bold green]backend: {what}[/], {report.reason}", soft_wrap=True)
    if report.backend is None:
        raise typer.Exit(2)


OutputExr = Annotated[Path, typer.Option("-o", "--output", metavar="OUT.exr", help="EXR file to write.")]
Sensor = Annotated[int, typer.Option(help="Index of the camera in the scene, from 0.")]
NormalFrame = Literal["auto", "view", "world"]
Normals = Annotated[str, typer.Option(help="'shading' or 'geometric' normals.")]
Samples = Annotated[int, typer.Option(min=1, help="Rays or paths per pixel.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of the random numbers.")]


def _distance(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not a number") from None
    if not value > 0:
        raise typer.BadParameter(f"must be positive or inf, got {text}")
    return value


@app.command()
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
        typer.Option(parser=_distance, metavar="DISTANCE", help="Reach of occluders in scene units, or inf."),
    ] = math.inf,
    bounces: Annotated[int, typer.Option(min=0, help="Also trace transport images T_1 … T_K up to this K.")] = 0,
    layers: Annotated[int, typer.Option(min=0, help="Also peel this many bodies along every pixel's ray.")] = 0,
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
            seed=seed,
            progress=bars,
        )
    _out.print(f"wrote {output}", soft_wrap=True)


@app.command()
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
) -> None:
    """EXR with depth and normals -> EXR with visibility added."""
    gtao.workflows.occlusion_file(
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
    )
    _out.print(f"wrote {output}", soft_wrap=True)


@app.command()
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
    with Bars() as bars:
        result = gtao.workflows.refit(config, output, cache=cache, progress=bars)
    _out.print(result.summary(), soft_wrap=True, highlight=False)
    _out.print(f"report: {output / 'report.html'}", soft_wrap=True)


@app.command()
def compare(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Directory for everything written.")],
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
    radius: Annotated[
        float | None,
        typer.Option(
            parser=_distance,
            metavar="DISTANCE",
            help="Reach of occluders in scene units, or inf; default: the scene's.",
        ),
    ] = None,
    resolution: Annotated[int | None, typer.Option(min=16, max=MAX_SIDE, help="Longer side in pixels.")] = None,
    spp: Annotated[int | None, typer.Option(min=16, help="Rays per pixel of the truth.")] = None,
    all_sensors: Annotated[bool, typer.Option(help="Every camera of a scene, not only the first.")] = False,
    quick: Annotated[bool, typer.Option(help="Small and noisy, to see every part run.")] = False,
    seed: Seed = 0,
) -> None:
    """Every method against ray-traced truth: table, error maps, error budgets, report."""
    config = gtao.workflows.CompareConfig.from_options(
        quick=quick,
        scenes=tuple(scenes or ()),
        methods=tuple(method or ()),
        radius=radius,
        resolution=resolution,
        spp=spp,
        all_sensors=all_sensors,
        seed=seed,
    )
    with Bars() as bars:
        result = gtao.workflows.compare(config, output, progress=bars)
    _out.print(result.summary(), soft_wrap=True, highlight=False)
    _out.print(f"report: {output / 'report.html'}", soft_wrap=True)


@app.command()
def export(
    fit: Annotated[Path, typer.Argument(metavar="RECORD", help="What refit wrote: record.json or coefficients.json.")],
    language: Annotated[str, typer.Option(help="'hlsl', 'glsl', 'wgsl', 'c' or 'json'.")] = "hlsl",
) -> None:
    """Coefficients -> shader code, on standard output."""
    print(gtao.workflows.export_fit(fit, language), end="")


@app.command()
def scenes() -> None:
    """The embedded scenes."""
    for name in gtao.render.scenes.names():
        _out.print(f"[bold]{name}[/]  {gtao.render.scenes.get(name).description}", soft_wrap=True)


@app.command()
def methods() -> None:
    """The estimators that go by a name."""
    for name, method in gtao.config.NAMED.items():
        _out.print(f"[bold]{name}[/]  {method.summary}", soft_wrap=True)


def main() -> None:
    """Entry point: 0 on success, 2 on bad usage or bad input with one line that says why."""
    try:
        code = app(standalone_mode=False)
    except typer.TyperException as error:
        _fail(error.format_message())
    except gtao.GtaoError as error:
        _fail(str(error))
    except (KeyboardInterrupt, typer.Abort):
        sys.exit(130)
    sys.exit(code or 0)


def _fail(message: str) -> None:
    print("gtao: " + " ".join(message.split()), file=sys.stderr)
    sys.exit(2)
