"""What is there: backends, embedded scenes, methods."""

import json
from typing import Annotated

import typer

import gtao

from .terminal import out

__all__ = ["doctor", "methods", "scenes"]


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
        out.print(f"gtao {gtao.__version__}")
        out.print("CUDA device: " + ("found" if report.cuda else "none"))
        for library in report.found:
            state = "usable" if library.usable else "too old: Dr.Jit aborts or refuses"
            out.print(f"LLVM {library.major or '?'} ({library.origin}): {library.path}, {state}", soft_wrap=True)
        if not report.found:
            out.print("LLVM: none found")
        if report.backend is None:
            out.print(f"[bold red]no backend[/]: {report.reason}", soft_wrap=True)
            out.print(f"run: {report.advice}", soft_wrap=True, highlight=False, markup=False)
        else:
            what = f"{report.backend}" + (f" (LLVM {version})" if report.backend == "llvm" else "")
            out.print(f"[bold green]backend: {what}[/], {report.reason}", soft_wrap=True)
    if report.backend is None:
        raise typer.Exit(2)


def scenes() -> None:
    """The embedded scenes."""
    for name in gtao.render.scenes.names():
        out.print(f"[bold]{name}[/]  {gtao.render.scenes.get(name).description}", soft_wrap=True)


def methods() -> None:
    """The estimators that go by a name."""
    for name, method in gtao.config.NAMED.items():
        out.print(f"[bold]{name}[/]  {method.summary}", soft_wrap=True)
