"""`ajgdata import` and `ajgdata check`: recordings become sessions, and are checked."""

from __future__ import annotations

import re
import shlex
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape
from rich.table import Table

from ajgdata.cli.console import ATTENTION, out, print_facts, say, shortened
from ajgdata.types import DataError, Finding, ImportSettings, OnChange, checked

if TYPE_CHECKING:
    from ajgdata.paths import Paths
    from ajgdata.pipeline.importing import Imported
    from ajgdata.types import DatasetSpec

#: Levels of issues, the worst first.
LEVELS = ("error", "warning", "note")
#: Kinds of remarks with their colours, the worst first.
KINDS = {
    **{"failed": "red", "unreadable": "yellow", "kept": "yellow", "label": "yellow"},
    **{"warning": "yellow"},
    **{"gone": "yellow", "not used": "default", "note": "yellow"},
}
Pattern = Annotated[
    str,
    typer.Option(help="'starter-kit' (<n>_<label>.wav), or a regular expression with named groups"),
]
TableOption = Annotated[str, typer.Option(help="table of labels in the folder, one row per file")]
ObjectOption = Annotated[
    str, typer.Option("--object", help="object, or its template, e.g. '{stone}'")
]
TargetOption = Annotated[
    list[str] | None, typer.Option(help="label to predict, or `object`; repeatable")
]
All = Annotated[bool, typer.Option("--all", help="list all, not only a few of each kind")]
Choice = Annotated[
    OnChange, typer.Option(help="importing again: differences to take from the folder")
]


def import_command(
    folder: Annotated[Path, typer.Argument(help="folder with the recordings")],
    dataset: Annotated[str, typer.Option(help="data set; created if it is new")],
    pattern: Pattern = "",
    table: TableOption = "",
    file: Annotated[str, typer.Option(help="template of a row's file, e.g. 'wav/{name}.wav'")] = "",
    grasp: Annotated[str, typer.Option(help="template of grasp_id, e.g. '{stone}'")] = "",
    session: Annotated[str, typer.Option(help="session, or its template, e.g. '{day}'")] = "",
    object_: ObjectOption = "",
    target: TargetOption = None,
    reference: Annotated[
        bool, typer.Option("--reference", help="leave the audio in the folder")
    ] = False,
    on_change: Choice = OnChange.KEEP,
    everything: All = False,
) -> None:
    """Import a folder of recordings as sessions of a data set.

    Groups of a pattern, and columns of a table, are labels, or session, grasp, object, sample and
    quality. Importing again adds new recordings and lists differences. Exit code 3 if recordings
    of the data set were skipped or cannot be used.
    """
    from ajgdata.paths import find_project
    from ajgdata.pipeline.importing import import_folder
    from ajgdata.types import checked_name

    paths = find_project()
    known = paths.dataset(checked_name(dataset)).is_file()
    if not (known or pattern or table):
        show_file_names(folder)
    settings = _import_settings(
        pattern=pattern, table=table, file=file, grasp=grasp, session=session, object=object_
    )
    spec, result = import_folder(
        paths, dataset, folder, settings=settings, targets=target or [],
        copy=not reference, on_change=on_change,
    )  # fmt: skip
    show_import(result, dataset, everything=everything)
    is_mixed = show_summary(paths, spec, known=known) if paths.dataset(dataset).is_file() else False
    raise typer.Exit(0 if result.is_complete and not is_mixed else ATTENTION)


def show_file_names(folder: Path) -> None:
    """Print the fields of the file names and patterns to copy, if no name is of the starter kit.

    Raises DataError after that.
    """
    from ajgdata.store.file_names import name_form
    from ajgdata.store.scan import STARTER_KIT, search

    files = search(folder)[0] if folder.is_dir() else []
    if not files or any(re.fullmatch(STARTER_KIT, path.as_posix()) for path in files):
        return
    form = name_form(files)
    table = Table("field", "kind", "values", "examples", box=None)
    for number, field in enumerate(form.fields, 1):
        examples = ", ".join(field.values[:4])
        table.add_row(str(number), field.kind, str(len(field.values)), escape(examples))
    same = len(files) - len(form.other_files)
    say(f"{same} of {len(files)} file names have this form (fields from left to right):")
    out.print(table)
    for path in form.other_files[:3]:
        say(f"[yellow]other form[/yellow] {escape(path.as_posix())}")
    say("Patterns to copy and edit (label: to predict; grasp, sample: counters):")
    if all(len(path.parts) == 2 for path in files):
        say(escape("  --pattern '(?P<label>[^/]+)/.+'   (the folder is the label)"))
    for roles in form.proposals():
        say(escape(f"  --pattern {shlex.quote(form.pattern(roles))}"))
    raise DataError(folder, "file names are not <n>_<label>.wav", "add a --pattern, or --table")


def _import_settings(**options: str) -> ImportSettings | None:
    """Return the settings of the options that are not empty; None if all are empty."""
    chosen = {key: value for key, value in options.items() if value}
    return checked(ImportSettings, "ajgdata import", chosen) if chosen else None


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
    if not known:
        say("models: linear and k-NN; to train the CNN too, add `cnn` to `models` of a task")
    issues = label_issues(tables, spec)
    for issue in issues:
        say(f"[yellow]warning[/yellow] {escape(issue.problem)}; {issue.fix}")
    if len(impossible_tasks(tables, spec)) < len(spec.tasks):
        say(f"next: ajgdata check {spec.name}, then ajgdata run {spec.name}")
    else:
        say(f"next: ajgdata check {spec.name} (no task of this data set is possible yet)")
    return any(issue.code in ("mixed_grasp", "repeated_sample") for issue in issues)


def check(
    dataset: Annotated[list[str] | None, typer.Argument(help="data sets; default: all")] = None,
    notes: Annotated[bool, typer.Option("--notes", help="also show notes")] = False,
    everything: All = False,
) -> None:
    """Check recordings and labels, and list each issue with its fix."""
    from ajgdata.paths import find_project
    from ajgdata.pipeline.validate import validate_dataset
    from ajgdata.store.sessions import list_datasets

    paths = find_project()
    total, issues = 0, list[Finding]()
    for name in dataset or list_datasets(paths):
        count, issues_of_set = validate_dataset(paths, name)
        total, issues = total + count, issues + issues_of_set
    print_issues([i for i in issues if notes or i.level != "note"], everything=everything)
    counts = Counter(issue.level for issue in issues)
    say(
        f"{total} recordings checked: {counts['error']} errors, {counts['warning']} warnings, "
        f"{counts['note']} notes" + ("" if notes or not counts["note"] else " (--notes shows them)")
    )
    raise typer.Exit(ATTENTION if counts["error"] or counts["warning"] else 0)


def print_issues(issues: Sequence[Finding], *, everything: bool) -> None:
    """Print a line for each issue, errors first, and the number of issues by code.

    Of one kind (level, code and fix) no more than a few lines are printed unless `everything`.
    """
    kinds = dict.fromkeys((issue.level, issue.code, issue.fix) for issue in issues)
    for level, code, fix in sorted(kinds, key=lambda kind: LEVELS.index(kind[0])):
        equal = [i for i in issues if (i.level, i.code, i.fix) == (level, code, fix)]
        names = [(f"{i.session_id}/{i.recording_id}: {i.problem}", fix) for i in equal]
        for name, reason in shortened(names, everything=everything):
            out.out(f"{level} {code} {name}; {reason}")
    if counts := Counter(issue.code for issue in issues).most_common():
        out.out(", ".join(f"{code} {count}" for code, count in counts))
