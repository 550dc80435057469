"""The `ajgdata` command: one line of work for each sub-command, the rest is showing it."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.cells import cell_len, set_cell_size
from rich.console import Console
from rich.markup import escape

from ajgdata.cli.acquire import acquiring
from ajgdata.cli.compare import comparing
from ajgdata.cli.dashboard import watching
from ajgdata.cli.device import device
from ajgdata.cli.gripper import gripper
from ajgdata.cli.project import looking
from ajgdata.cli.publish import publishing
from ajgdata.pipeline.progress import bar, when_slow
from ajgdata.types import DataError, Finding, ImportSettings

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    help="Acoustic sensing with jamming grippers: get recordings in, check them, hand sets on. "
    "What lies between (features, models, report) is done by the command [b]snakemake[/b].",
)
app.add_typer(gripper, name="gripper")
app.add_typer(device, name="device")
app.add_typer(acquiring)
app.add_typer(publishing)
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
    except (DataError, OSError) as error:
        err.print(f"[red]error[/red] {escape(str(error))}", soft_wrap=True)
        sys.exit(1)


@app.command("import")
def import_command(
    folder: Annotated[Path, typer.Argument(help="folder that holds the recordings")],
    dataset: Annotated[str, typer.Option(help="data set that gets them; declared if it is new")],
    pattern: Annotated[
        str,
        typer.Option(
            help="'starter-kit' (<n>_<label>.wav, 0_<sound>.wav is the played sound), or a regular "
            "expression for the whole path inside the folder, whose named groups are the labels; "
            "(?P<session>), (?P<grasp>), (?P<object>), (?P<sample>) have their meaning. "
            "Default: what dataset.yaml says, else starter-kit"
        ),
    ] = "",
    table: Annotated[str, typer.Option(help="CSV of labels in the folder, one row a file")] = "",
    file: Annotated[
        str, typer.Option(help="with --table: path of a row's file, e.g. 'wav/{name}.wav'")
    ] = "",
    grasp: Annotated[
        str, typer.Option(help="what one grasp is, e.g. '{stone}'; default: each file is one")
    ] = "",
    session: Annotated[str, typer.Option(help="what one session is, e.g. '{day}'")] = "",
    target: Annotated[
        list[str] | None, typer.Option(help="label to learn (repeat for more)")
    ] = None,
    reference: Annotated[
        bool, typer.Option("--reference", help="leave the audio where it is instead of copying it")
    ] = False,
    replace: Annotated[
        bool, typer.Option("--replace", help="take over files whose bytes changed since")
    ] = False,
) -> None:
    """Turn a folder of recordings into sessions of a data set. Audio is never altered.

    Importing again adds what is new and takes over changed labels.
    """
    from ajgdata.paths import find_project
    from ajgdata.pipeline.importing import import_folder

    given = {"pattern": pattern, "table": table, "file": file, "grasp": grasp, "session": session}
    settings = _import_settings({key: value for key, value in given.items() if value})
    paths = find_project()
    with bar("importing") as started:
        spec, found, result = import_folder(
            paths,
            dataset,
            folder,
            settings=settings,
            targets=target or [],
            copy=not reference,
            replace=replace,
            started=started,
        )
    out.print(
        f"{result.added} added, {result.relabelled} changed, {result.unchanged} unchanged "
        f"in {result.sessions} session(s) of [b]{dataset}[/b]",
        soft_wrap=True,
    )
    for name in result.conflicts:
        out.print(
            f"[yellow]kept[/yellow] {escape(name)}: other bytes have this name already. If "
            "these are other recordings, import them with --session; --replace overwrites",
            soft_wrap=True,
        )
    for name, reason in found.skipped:
        out.print(f"[yellow]skipped[/yellow] {escape(name)}: {escape(reason)}", soft_wrap=True)
    audio = spec.audio
    out.print(
        f"declared in {escape(str(paths.dataset(dataset)))}: {audio.sample_rate_hz} Hz, channel "
        f"{audio.channel}, targets {', '.join(spec.targets) or 'none'}; "
        f"next: ajgdata validate {dataset}",
        soft_wrap=True,
    )
    raise typer.Exit(bool(result.conflicts))


def _import_settings(given: dict[str, str]) -> ImportSettings | None:
    from pydantic import ValidationError

    from ajgdata.types import describe

    try:
        return ImportSettings(**given) if given else None
    except ValidationError as error:
        raise describe(error, "ajgdata import") from None


@app.command()
def validate(
    dataset: Annotated[
        list[str] | None, typer.Argument(help="data sets or folders; default: every data set")
    ] = None,
    notes: Annotated[
        bool, typer.Option("--notes", help="also show what is fine though odd")
    ] = False,
) -> None:
    """Check every recording; one line for each finding, with the fix. Exit code 1 if any.

    Also checks a plain folder of audio files before it is imported.
    """
    from ajgdata.paths import find_project
    from ajgdata.pipeline.validate import validate_datasets

    with bar("checking") as started:
        checked, findings = validate_datasets(find_project, dataset or [], started)
    shown = [f for f in findings if notes or f.level != "note"]
    if shown:
        _print_findings(shown)
    counts = {
        level: sum(f.level == level for f in findings) for level in ("error", "warning", "note")
    }
    out.print(
        f"{checked} recordings checked: {counts['error']} errors, {counts['warning']} warnings, "
        f"{counts['note']} notes" + ("" if notes or not counts["note"] else " (--notes shows them)")
    )
    raise typer.Exit(bool(counts["error"] or counts["warning"]))


def _print_findings(findings: Sequence[Finding]) -> None:
    """Print a table with one line for each finding, however wide the terminal is."""
    rows = [("recording", "level", "what", "problem", "fix")]
    rows += [
        (f"{one.session_id}/{one.recording_id}", one.level, one.code, one.problem, one.fix)
        for one in findings
    ]
    widths = [max(cell_len(row[column]) for row in rows) for column in range(4)]
    for *cells, fix in rows:
        padded = (set_cell_size(cell, width) for cell, width in zip(cells, widths, strict=True))
        out.out("  ".join([*padded, fix]))
    kinds = Counter(one.code for one in findings)
    out.out("\n" + ", ".join(f"{code} {count}" for code, count in kinds.most_common()))


@app.command()
def seal(dataset: DatasetArgument) -> None:
    """Accept recordings as they are now: write the sha256 of their present bytes."""
    from ajgdata.paths import find_project
    from ajgdata.store.importing import seal as seal_session
    from ajgdata.store.sessions import list_sessions, read_dataset

    paths = find_project()
    read_dataset(paths, dataset)
    sessions = list_sessions(paths, dataset)
    for session in when_slow(sessions, "sealing"):
        changed = seal_session(paths, dataset, session)
        out.print(f"{dataset}/{session}: {changed} recordings sealed")
