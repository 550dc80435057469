"""The `ajgdata` command: one line of work for each sub-command, the rest is showing it."""

from __future__ import annotations

import sys
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape

from ajgdata.cli.acquire import acquiring
from ajgdata.cli.compare import comparing
from ajgdata.cli.dashboard import watching
from ajgdata.cli.device import device
from ajgdata.cli.export import exporting
from ajgdata.cli.findings import print_findings
from ajgdata.cli.gripper import gripper
from ajgdata.cli.importing import importing
from ajgdata.cli.live import live
from ajgdata.cli.project import looking
from ajgdata.cli.publish import publishing
from ajgdata.pipeline.progress import bar, tracked
from ajgdata.store.trouble import machine_trouble
from ajgdata.types import DataError, Finding

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    help="Acoustic sensing with jamming grippers: get recordings in, check them, hand sets on. "
    "What lies between (features, models, report) is done by the command [b]snakemake[/b].",
)
app.add_typer(gripper, name="gripper")
app.add_typer(device, name="device")
app.add_typer(importing)
app.add_typer(acquiring)
app.add_typer(live)
app.add_typer(publishing)
app.add_typer(exporting)
app.add_typer(looking)
app.add_typer(comparing)
app.add_typer(watching)
out = Console(emoji=False, highlight=False)
err = Console(stderr=True, emoji=False, highlight=False)

DatasetArgument = Annotated[str, typer.Argument(help="name of a folder below datasets/")]


def main() -> None:
    """Run the command; what is wrong with the data is said in one line."""
    try:
        app()
    except (DataError, OSError, MemoryError, RuntimeError, ImportError) as error:
        known = error if isinstance(error, DataError) else machine_trouble(error)
        if known is None and isinstance(error, (RuntimeError, ImportError)):
            raise  # a bug
        err.print(f"[red]error[/red] {escape(str(known or error))}", soft_wrap=True)
        sys.exit(1)


@app.command()
def validate(
    dataset: Annotated[
        list[str] | None, typer.Argument(help="data sets; default: every one")
    ] = None,
    notes: Annotated[
        bool, typer.Option("--notes", help="also show what is fine though odd")
    ] = False,
    everything: Annotated[
        bool, typer.Option("--all", help="show every finding, not a few of each kind")
    ] = False,
) -> None:
    """Check every recording; one line for each finding, with the fix. Exit code 1 if any."""
    from ajgdata.paths import find_project
    from ajgdata.pipeline.validate import validate_dataset
    from ajgdata.store.sessions import list_datasets

    paths = find_project()
    checked, findings = 0, list[Finding]()
    with bar("checking") as started:
        for name in dataset or list_datasets(paths):
            count, issues = validate_dataset(paths, name, started)
            checked, findings = checked + count, findings + issues
    shown = [f for f in findings if notes or f.level != "note"]
    if shown:
        print_findings(shown, everything=everything)
    counts = {
        level: sum(f.level == level for f in findings) for level in ("error", "warning", "note")
    }
    out.print(
        f"{checked} recordings checked: {counts['error']} errors, {counts['warning']} warnings, "
        f"{counts['note']} notes" + ("" if notes or not counts["note"] else " (--notes shows them)")
    )
    raise typer.Exit(bool(counts["error"] or counts["warning"]))


@app.command()
def seal(dataset: DatasetArgument) -> None:
    """Accept recordings as they are now: write the sha256 of their present bytes."""
    from ajgdata.paths import find_project
    from ajgdata.store.sessions import list_sessions, read_dataset
    from ajgdata.store.sessions import seal as seal_session

    paths = find_project()
    read_dataset(paths, dataset)
    sessions = list_sessions(paths, dataset)
    for session in tracked(sessions, "sealing"):
        changed = seal_session(paths, dataset, session)
        out.print(f"{dataset}/{session}: {changed} recordings sealed")
