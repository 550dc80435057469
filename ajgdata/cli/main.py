"""The `ajgdata` command: its sub-commands in panels, and errors in one line.

At the top, the modules of this package import only what loads fast, without numpy, so that
`ajgdata --help` is fast. A command imports all other modules when it runs.
"""

from __future__ import annotations

import sys
from typing import Annotated

import typer
from rich.markup import escape

from ajgdata import __version__
from ajgdata.cli.browse import browse
from ajgdata.cli.check import check
from ajgdata.cli.compare import compare
from ajgdata.cli.console import print_any_character, warn
from ajgdata.cli.device import device, record
from ajgdata.cli.diff import diff
from ajgdata.cli.export import export, scene
from ajgdata.cli.importing import import_command
from ajgdata.cli.new import new, paper
from ajgdata.cli.plan import plan
from ajgdata.cli.project import doctor, run, simulate
from ajgdata.cli.publish import fetch, publish
from ajgdata.cli.report import report
from ajgdata.cli.review import label, review
from ajgdata.cli.sense import sense
from ajgdata.cli.sort import sort
from ajgdata.cli.status import status
from ajgdata.cli.train import train
from ajgdata.types import DataError, one_line
from ajgdata.types.extras import optional_packages

EXIT_CODES = (
    "Exit codes of all commands: 0 success; 1 error, in one line on standard error; "
    "2 invalid option or argument; 3 finished, but the result needs attention (see the command's "
    "help); 130 stopped by Ctrl-C. Exceptions: `run`, `simulate` and `train` return the exit code "
    "of Snakemake; `run` also returns 1 if a required task was skipped; `record`, `sense` and "
    "`sort` return 143 after SIGTERM and 129 if their terminal was closed."
)
app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    epilog=EXIT_CODES,
)
#: Commands by panel of the help text, in the order of the help text.
PANELS = {
    "Start": (new, paper),
    "Data": (import_command, record, simulate, check, browse, review, label, diff, publish, fetch),
    "Run": (run, train, status, report, compare, plan),
    "Use": (export, sense, sort),
    "Tools": (scene, doctor),
}
#: Commands that pass unknown options to Snakemake.
SNAKEMAKE_COMMANDS = (run, simulate, status, train)
for panel, commands in PANELS.items():
    for command in commands:
        register = app.command(
            command.__name__.removesuffix("_command"),
            rich_help_panel=panel,
            context_settings={"ignore_unknown_options": command in SNAKEMAKE_COMMANDS},
        )
        register(command)
app.add_typer(device, name="device", rich_help_panel="Tools")


def _show_version(requested: bool) -> None:
    """Print the version and exit, if it is requested."""
    if requested:
        typer.echo(f"ajgdata {__version__}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="print the version"),
    ] = False,
) -> None:
    """Acoustic sensing with jamming grippers: data sets, models and reports."""


def main() -> None:
    """Run the command.

    An error in data or files is printed in one line, with exit code 1. So is a missing package of
    an extra, with the command that installs it.
    """
    command = " ".join(["ajgdata", *sys.argv[1:2]])
    print_any_character()
    try:
        with optional_packages(command):
            app()
    except (DataError, OSError, MemoryError) as error:
        warn(f"[red]error[/red] {escape(one_line(error))}")
        sys.exit(1)
