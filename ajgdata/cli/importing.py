"""`ajgdata import`: a folder of recordings -> sessions of a data set, and what came of it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from ajgdata.cli.console import ATTENTION, print_facts, say, shortened
from ajgdata.pipeline.progress import bar
from ajgdata.types import ImportSettings, OnChange

if TYPE_CHECKING:
    from ajgdata.paths import Paths
    from ajgdata.pipeline.importing import Imported
    from ajgdata.types import DatasetSpec

#: Kinds of remarks with their colours, the worst first.
KINDS = {
    **{"failed": "red", "unreadable": "yellow", "kept": "yellow", "label": "yellow"},
    **{"gone": "yellow", "not used": "default", "note": "yellow"},
}
Pattern = Annotated[
    str,
    typer.Option(help="'starter-kit' (<n>_<label>.wav), or a regular expression with named groups"),
]
Table = Annotated[str, typer.Option(help="table of labels in the folder, one row per file")]
Choice = Annotated[
    OnChange, typer.Option(help="importing again: differences to take from the folder")
]


def import_command(
    folder: Annotated[Path, typer.Argument(help="folder with the recordings")],
    dataset: Annotated[str, typer.Option(help="data set; created if it is new")],
    pattern: Pattern = "",
    table: Table = "",
    file: Annotated[str, typer.Option(help="template of a row's file, e.g. 'wav/{name}.wav'")] = "",
    grasp: Annotated[str, typer.Option(help="template of grasp_id, e.g. '{stone}'")] = "",
    session: Annotated[str, typer.Option(help="session, or its template, e.g. '{day}'")] = "",
    object_: Annotated[
        str, typer.Option("--object", help="object, or its template, e.g. '{stone}'")
    ] = "",
    target: Annotated[
        list[str] | None, typer.Option(help="label to predict, or `object`; repeatable")
    ] = None,
    reference: Annotated[
        bool, typer.Option("--reference", help="leave the audio in the folder")
    ] = False,
    on_change: Choice = OnChange.KEEP,
    everything: Annotated[
        bool, typer.Option("--all", help="list all, not only a few of each kind")
    ] = False,
) -> None:
    """Import a folder of recordings as sessions of a data set.

    Groups of a pattern, and columns of a table, are labels, or session, grasp, object, sample and
    quality. Importing again adds new recordings and lists differences. Exit code 3 if recordings
    of the data set were skipped or cannot be used.
    """
    from ajgdata.paths import find_project
    from ajgdata.pipeline.importing import import_folder
    from ajgdata.types import checked_name

    options = {"pattern": pattern, "table": table, "file": file}
    options |= {"grasp": grasp, "session": session, "object": object_}
    paths = find_project()
    known = paths.dataset(checked_name(dataset)).is_file()
    with bar("importing") as started:
        spec, result = import_folder(
            paths, dataset, folder, settings=_import_settings(options), targets=target or [],
            copy=not reference, on_change=on_change, started=started,
        )  # fmt: skip
    show_import(result, dataset, everything=everything)
    is_mixed = show_summary(paths, spec, known=known) if paths.dataset(dataset).is_file() else False
    raise typer.Exit(0 if result.is_complete and not is_mixed else ATTENTION)


def _import_settings(options: dict[str, str]) -> ImportSettings | None:
    from pydantic import ValidationError

    from ajgdata.types import describe

    chosen = {key: value for key, value in options.items() if value}
    try:
        return ImportSettings.model_validate(chosen) if chosen else None
    except ValidationError as error:
        raise describe(error, "ajgdata import") from None


def show_import(result: Imported, dataset: str, *, everything: bool) -> None:
    """Print the counts and remarks of an import, the worst first."""
    counts = f"{result.added} added, {result.changed} changed, {result.unchanged} unchanged"
    counts += f", {result.removed} removed" if result.removed else ""
    say(f"{counts} in {result.sessions} session(s) of [b]{dataset}[/b]")
    for kind, colour in KINDS.items():
        for name, reason in shortened(result.remarks[kind], everything=everything):
            say(f"[{colour}]{kind}[/{colour}] {escape(f'{name}: {reason}')}")


def show_summary(paths: Paths, spec: DatasetSpec, *, known: bool) -> bool:
    """Print the declaration, the numbers of recordings, grasps and classes, what is wrong with the
    labels, and the next command. Returns True if grasps are ambiguous."""
    from ajgdata.pipeline.validate import counts, impossible_tasks, label_issues, label_tables

    where = escape(str(paths.dataset(spec.name)))
    summary = f"{spec.audio.sample_rate_hz} Hz, channel {spec.audio.channel}, targets "
    summary += ", ".join(spec.targets) or "none"
    say(f"as declared before in {where}" if known else f"now declared in {where}: {summary}")
    tables = label_tables(paths, spec.name)
    print_facts(counts(tables, spec.targets))
    issues = label_issues(tables, spec)
    for issue in issues:
        say(f"[yellow]warning[/yellow] {escape(issue.problem)}; {issue.fix}")
    if len(impossible_tasks(tables, spec)) < len(spec.tasks):
        say(f"next: ajgdata check {spec.name}, then ajgdata run {spec.name}")
    else:
        say(f"next: ajgdata check {spec.name} (no task of this data set is possible yet)")
    return any(issue.code == "mixed_grasp" for issue in issues)
