"""The command line: `planegrasp COMMAND`, one file a command.

The commands import what they need when they run, so that `planegrasp --help` is fast.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated

import typer

from planegrasp.cli.bench import app as bench
from planegrasp.cli.demo import demo
from planegrasp.cli.detect import detect
from planegrasp.cli.grasp import app as grasp
from planegrasp.cli.live import live
from planegrasp.cli.objects import objects
from planegrasp.cli.record import record
from planegrasp.cli.ros2 import ros2
from planegrasp.cli.teach import teach
from planegrasp.errors import PlanegraspError

if TYPE_CHECKING:
    from collections.abc import Sequence

app = typer.Typer(
    name="planegrasp",
    help="Teach flat, textured objects with one photo each; find them and their 6-DoF poses.",
    no_args_is_help=True,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        import planegrasp

        typer.echo(f"planegrasp {planegrasp.__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Show it."),
    ] = False,
) -> None:
    pass


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a command, and leave by SystemExit: 0, 1 after an error, 2 for wrong usage, 130."""
    from planegrasp.cli.common import print_error

    try:
        app(args=arguments, prog_name="planegrasp")
    except PlanegraspError as error:
        print_error(str(error))
        sys.exit(1)
    except OSError as error:
        print_error(f"{error.filename}: {error.strerror}" if error.filename else str(error))
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)


app.command()(teach)
app.command()(objects)
app.command()(detect)
app.command()(record)
app.command()(ros2)
app.command()(live)
app.add_typer(grasp, name="grasp")
app.command()(demo)
app.add_typer(bench, name="bench")
