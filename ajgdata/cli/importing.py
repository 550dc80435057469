"""`ajgdata import` and `ajgdata check`: recordings become sessions, and are checked."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape
from rich.table import Table

from ajgdata.cli.console import ATTENTION, out, print_facts, say, shortened
from ajgdata.types import (
    ISSUE_LEVELS,
    WHOLE,
    AudioSettings,
    DataError,
    Finding,
    ImportSettings,
    IssueCounts,
    OnChange,
    checked,
    issue_counts,
    many,
)

if TYPE_CHECKING:
    from ajgdata.paths import Paths
    from ajgdata.pipeline.importing import Imported
    from ajgdata.types import DatasetSpec

#: Types of remarks with their colours, the worst first.
REMARK_COLOURS = {
    "failed": "red",
    "unreadable": "yellow",
    "kept": "yellow",
    "label": "yellow",
    "warning": "yellow",
    "unused": "yellow",
    "gone": "yellow",
    "channels": "yellow",
    "not used": "default",
    "note": "yellow",
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
OnChangeOption = Annotated[
    OnChange, typer.Option(help="importing again: differences to take from the folder")
]


def import_command(
    folder: Annotated[Path, typer.Argument(help="folder with the recordings")],
    dataset: Annotated[str, typer.Option(help="data set; created if it is new")],
    pattern: Pattern = "",
    table: TableOption = "",
    file: Annotated[str, typer.Option(help="template of a row's file, e.g. 'wav/{name}.wav'")] = "",
    grasp: Annotated[str, typer.Option(help="template of grasp_id, e.g. '{stone}'")] = "",
    placement: Annotated[
        str, typer.Option(help="template of placement_id, e.g. '{object}/{round}'")
    ] = "",
    session: Annotated[str, typer.Option(help="session, or its template, e.g. '{day}'")] = "",
    object_: ObjectOption = "",
    target: TargetOption = None,
    reference: Annotated[
        bool, typer.Option("--reference", help="leave the audio in the folder")
    ] = False,
    on_change: OnChangeOption = OnChange.KEEP,
    microphone: Annotated[
        str, typer.Option(help="used channel of the files: number from 1, or mean")
    ] = "",
    everything: All = False,
) -> None:
    """Import a folder of recordings as sessions of a data set.

    Groups of a pattern, and columns of a table, are labels, or session, placement, grasp, object,
    sample and quality. Importing again adds new recordings and lists differences. Exit code 3 if
    recordings of the data set were skipped or cannot be used, or if there are warnings.
    """
    from ajgdata.paths import find_project
    from ajgdata.pipeline.importing import import_folder
    from ajgdata.types import checked_name

    paths = find_project()
    known = paths.dataset(checked_name(dataset)).is_file()
    if not (known or pattern or table):
        show_file_names(folder)
    settings = _import_settings(
        pattern=pattern,
        table=table,
        file=file,
        grasp=grasp,
        placement=placement,
        session=session,
        object=object_,
    )
    spec, result = import_folder(
        paths,
        dataset,
        folder,
        settings=settings,
        targets=target or [],
        copy=not reference,
        on_change=on_change,
        microphone=_microphone(microphone),
    )
    show_import(result, dataset, everything=everything)
    is_ambiguous = False
    if paths.dataset(dataset).is_file():
        is_ambiguous = show_summary(paths, spec, known=known)
    raise typer.Exit(0 if result.is_complete and not is_ambiguous else ATTENTION)


def show_file_names(folder: Path) -> None:
    """Print the fields of the file names and patterns to copy, if no name is of the starter kit.

    Raises DataError after that.
    """
    from ajgdata.store.file_names import ambiguous_readings, folder_pattern, name_form
    from ajgdata.store.scan import search
    from ajgdata.store.starter_kit import starter_kit_objection

    files = search(folder)[0] if folder.is_dir() else []
    objection = starter_kit_objection(files) if files else ""
    if not objection:
        return
    form = name_form(files)
    table = Table("field", "kind", "values", "examples", box=None)
    for number, field in enumerate(form.fields, 1):
        examples = ", ".join(field.values[:4])
        table.add_row(str(number), field.value_type, str(len(field.values)), escape(examples))
    say(f"{len(form.files)} of {len(files)} file names have this form (fields from left to right):")
    out.print(table)
    for path in form.other_files[:3]:
        say(f"[yellow]other form[/yellow] {escape(path.as_posix())}")
    for reading in ambiguous_readings(form):
        say(f"[yellow]note[/yellow] {escape(reading)}")
    say("Patterns to copy and edit (label: to predict; grasp, sample: counters; field_N: stored):")
    if in_folders := folder_pattern(files):
        say(escape(f"  --pattern {shlex.quote(in_folders)}   (the folder is the label)"))
    for roles in form.proposals():
        template = form.grasp_template(roles)
        grasp = f" --grasp {shlex.quote(template)}" if template else ""
        say(escape(f"  --pattern {shlex.quote(form.pattern(roles))}{grasp}"))
    fix = "add a --pattern, or --table; --pattern starter-kit reads <n>_<label>.wav unchecked"
    raise DataError(folder, objection, fix)


def _import_settings(**options: str) -> ImportSettings | None:
    """Return the settings of the options that are not empty; None if all are empty."""
    chosen = {key: value for key, value in options.items() if value}
    return checked(ImportSettings, "ajgdata import", chosen) if chosen else None


def _microphone(text: str) -> int | str | None:
    """Return the microphone of an option; None if it is empty. Raises DataError."""
    value = int(text) if text.isascii() and text.isdigit() else text or None
    settings = checked(AudioSettings, "--microphone", {"microphone": value})
    return settings.microphone


def show_import(result: Imported, dataset: str, *, everything: bool) -> None:
    """Print the counts and remarks of an import, the worst first."""
    counts = f"{result.added} added, {result.changed} changed, {result.unchanged} unchanged"
    counts += f", {result.removed} removed" if result.removed else ""
    say(f"{counts} in {result.sessions} session(s) of [b]{dataset}[/b]")
    for remark_type, colour in REMARK_COLOURS.items():
        for name, reason in shortened(result.remarks[remark_type], everything=everything):
            say(f"[{colour}]{remark_type}[/{colour}] {escape(f'{name}: {reason}')}")


def show_summary(paths: Paths, spec: DatasetSpec, *, known: bool) -> bool:
    """Print the declaration, the numbers of recordings, grasps and classes, what is wrong with the
    labels, and the next command. Returns True if grasps or classes are ambiguous, or if a cell of
    a declared target is not a number."""
    from ajgdata.pipeline.validate import (
        cells_without_value,
        counts,
        impossible_tasks,
        label_issues,
        label_tables,
    )

    where = escape(str(paths.dataset(spec.name)))
    summary = f"{spec.audio.sample_rate_hz} Hz, {_used(spec.audio.microphone)}, targets "
    summary += ", ".join(spec.targets) or "none"
    say(f"as declared before in {where}" if known else f"now declared in {where}: {summary}")
    tables = label_tables(paths, spec.name)
    print_facts(counts(tables, spec.targets))
    if not known:
        say("models: linear and k-NN; to train the CNN too, add `cnn` to `models` of a task")
    issues = label_issues(tables, spec)
    if known:  # the declaration of a new data set has listed these cells with their files
        issues += cells_without_value(tables, spec)
    for issue in issues:
        say(f"[yellow]warning[/yellow] {escape(issue.problem)}; {issue.fix}")
    if len(impossible_tasks(tables, spec)) < len(spec.tasks):
        say(f"next: ajgdata check {spec.name}, then ajgdata run {spec.name}")
    else:
        say(f"next: ajgdata check {spec.name} (no task of this data set is possible yet)")
    codes = {"mixed_grasp", "repeated_sample", "grasp_spelling", "similar_classes", "bad_label"}
    return any(issue.code in codes for issue in issues)


def _used(microphone: int | str | None) -> str:
    """Return the channel of a file that is used, in words."""
    if microphone is None:
        return "one microphone"
    return "mean of the microphones" if microphone == "mean" else f"microphone {microphone}"


def check(
    dataset: Annotated[list[str] | None, typer.Argument(help="data sets; default: all")] = None,
    notes: Annotated[bool, typer.Option("--notes", help="also show notes on recordings")] = False,
    everything: All = False,
    accept: Annotated[
        bool, typer.Option("--accept", help="store the hash of new and changed files first")
    ] = False,
) -> None:
    """Check recordings and labels, and list each issue with its fix."""
    from ajgdata.paths import find_project
    from ajgdata.pipeline.validate import not_fetched, validate_dataset
    from ajgdata.store.sessions import list_datasets

    paths = find_project()
    if accept:
        accept_changes(paths, dataset or (), everything=everything)
    total, issues = 0, list[Finding]()
    counts = IssueCounts()
    absent = [] if dataset else not_fetched(paths)
    if absent:
        say(f"not fetched, so not checked: {', '.join(absent)}")
    for name in dataset or [name for name in list_datasets(paths) if name not in absent]:
        count, issues_of_set = validate_dataset(paths, name)
        total, issues = total + count, issues + issues_of_set
        counts += issue_counts(issues_of_set)
    shown = [i for i in issues if notes or i.level != "note" or i.recording_id == WHOLE]
    print_issues(shown, everything=everything)
    general = sum(i.recording_id == WHOLE and i.level != "note" for i in issues)
    noun = "issue" if general == 1 else "issues"
    suffix = f"; {general} {noun} of sessions or the data set" if general else ""
    remarks = sum(i.recording_id == WHOLE and i.level == "note" for i in issues)
    suffix += f"; {many(remarks, 'note')} on the data set" if remarks else ""
    hint = " (--notes shows them)" if counts.notes and not notes else ""
    say(f"{total} recordings checked: {counts}{suffix}{hint}")
    levels = {issue.level for issue in issues}
    raise typer.Exit(ATTENTION if levels & {"error", "warning"} else 0)


def accept_changes(paths: Paths, datasets: Sequence[str], *, everything: bool) -> None:
    """Store the hashes of new and changed recordings of `datasets`, and print which were accepted,
    and which were not because they cannot be decoded.

    Raises DataError if no data set is named.
    """
    from ajgdata.pipeline.accept import accept_recordings

    if not datasets:
        fix = "name the data sets: `ajgdata check NAME --accept`"
        raise DataError("--accept", "no data set is named", fix)
    for name in datasets:
        accepted, not_accepted = accept_recordings(paths, name)
        lines = [
            (
                f"{item.session_id}/{item.recording_id}",
                "changed" if item.before else "had no sha256",
            )
            for item in accepted
        ]
        for recording, reason in shortened(lines, everything=everything):
            say(f"[yellow]accepted[/yellow] {escape(f'{recording}: {reason}')}")
        damaged = [
            (f"{item.session_id}/{item.recording_id}: {item.problem}", item.fix)
            for item in not_accepted
        ]
        for recording, reason in shortened(damaged, everything=everything):
            say(f"[red]not accepted[/red] {escape(f'{recording}; {reason}')}")
        noun = "recording" if len(accepted) == 1 else "recordings"
        say(f"{len(accepted)} {noun} of [b]{name}[/b] accepted")


def print_issues(issues: Sequence[Finding], *, everything: bool) -> None:
    """Print a line for each issue, errors first, and the number of issues by code.

    Of one type (level, code and fix) no more than a few lines are printed unless `everything`.
    """
    types = dict.fromkeys((issue.level, issue.code, issue.fix) for issue in issues)
    for level, code, fix in sorted(types, key=lambda issue_type: ISSUE_LEVELS.index(issue_type[0])):
        equal = [i for i in issues if (i.level, i.code, i.fix) == (level, code, fix)]
        names = [(f"{i.session_id}/{i.recording_id}: {i.problem}", fix) for i in equal]
        for name, reason in shortened(names, everything=everything):
            out.out(f"{level} {code} {name}; {reason}")
    if counts := Counter(issue.code for issue in issues).most_common():
        out.out(", ".join(f"{code} {count}" for code, count in counts))
