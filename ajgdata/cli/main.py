"""The `ajgdata` command: its sub-commands, and errors in one line."""

from __future__ import annotations

import sys

import typer
from rich.markup import escape

from ajgdata.cli.compare import compare
from ajgdata.cli.console import warn
from ajgdata.cli.device import acquire, device
from ajgdata.cli.export import export
from ajgdata.cli.importing import import_command
from ajgdata.cli.project import doctor, run, status
from ajgdata.cli.publish import fetch, publish
from ajgdata.cli.sense import sense
from ajgdata.cli.sort import sort
from ajgdata.cli.validate import validate
from ajgdata.types import DataError, one_line

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    help="Acoustic sensing with jamming grippers: record or import data sets, check them, run the "
    "pipeline ([b]ajgdata run[/b]; for the paper: [b]snakemake[/b]), use models, and publish.",
)
for command in (validate, acquire, sense, sort, publish, fetch, export, compare):
    app.command()(command)
app.command()(doctor)
OTHER_OPTIONS = {"ignore_unknown_options": True}  # handed on to Snakemake
app.command(context_settings=OTHER_OPTIONS)(status)
app.command(context_settings=OTHER_OPTIONS)(run)
app.command("import")(import_command)
app.add_typer(device, name="device")


def main() -> None:
    """Run the command; a problem with the data is reported in one line."""
    try:
        app()
    except (DataError, OSError, MemoryError) as error:
        warn(f"[red]error[/red] {escape(one_line(error))}")
        sys.exit(1)
