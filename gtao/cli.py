"""The ``gtao`` command: its subcommands gathered, and errors turned into one line."""

import sys
from typing import Annotated

import typer

import gtao
from gtao.commands import COMMANDS
from gtao.commands.terminal import out

app = typer.Typer(
    name="gtao",
    help="Ambient occlusion that is right and can prove it.",
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    add_completion=False,
)


def _version(show: bool) -> None:
    if show:
        out.print(f"gtao {gtao.__version__}")
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


for _command in COMMANDS:
    app.command()(_command)


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
