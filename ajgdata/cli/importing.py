"""`ajgdata import`: a folder of recordings -> sessions of a data set, and what came of it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from ajgdata.cli.console import print_facts, say
from ajgdata.pipeline.progress import bar
from ajgdata.types import DataError, ImportSettings, OnChange

if TYPE_CHECKING:
    from ajgdata.paths import Paths
    from ajgdata.store.importing import Imported
    from ajgdata.store.scan import Scan
    from ajgdata.types import DatasetSpec

#: Lines of one kind that are shown unless all are requested.
SHOWN = 5
#: Exit code of an import that left out something that belongs to it; 1: nothing was imported.
INCOMPLETE = 3


def import_command(
    folder: Annotated[Path, typer.Argument(help="folder that holds the recordings")],
    dataset: Annotated[str, typer.Option(help="data set that gets them; declared if it is new")],
    pattern: Annotated[
        str,
        typer.Option(
            help="'starter-kit' (<n>_<label>.wav, 0_<sound>.wav is the played sound), or a regular "
            "expression for the whole path inside the folder, whose named groups are the labels; "
            "(?P<session>), (?P<grasp>), (?P<object>), (?P<sample>), (?P<quality>) and the names "
            "of the data model have their meaning. Default: as in dataset.yaml, else starter-kit"
        ),
    ] = "",
    table: Annotated[
        str, typer.Option(help="table of labels in the folder, one row a file: , ; or tab")
    ] = "",
    file: Annotated[
        str, typer.Option(help="with --table: path of a row's file, e.g. 'wav/{name}.wav'")
    ] = "",
    join: Annotated[
        list[str] | None,
        typer.Option(help="with --table: 'more.csv:column', a further table and its key (repeat)"),
    ] = None,
    grasp: Annotated[
        str,
        typer.Option(
            help="grasp_id, e.g. '{stone}'; default: object and grasp number, or the file"
        ),
    ] = "",
    session: Annotated[str, typer.Option(help="what one session is, e.g. '{day}'")] = "",
    object_: Annotated[
        str, typer.Option("--object", help="what was held, e.g. '{stone}'; default: the label")
    ] = "",
    target: Annotated[
        list[str] | None, typer.Option(help="label to learn (repeat for more), or `object`")
    ] = None,
    reference: Annotated[
        bool, typer.Option("--reference", help="leave the audio where it is instead of copying it")
    ] = False,
    on_change: Annotated[
        OnChange,
        typer.Option(
            help="importing again: keep what is here, or take changed files, or changed labels, "
            "of the folder, or prune recordings whose file is no longer in the folder"
        ),
    ] = OnChange.KEEP,
    everything: Annotated[
        bool, typer.Option("--all", help="name every file, not a few of each kind")
    ] = False,
) -> None:
    """Turn a folder of recordings into sessions of a data set. Audio is never altered.

    Importing again adds new recordings and lists what differs. Exit code 3 if something that
    belongs to the data set was skipped or cannot be used, 1 if nothing was imported.
    """
    from ajgdata.paths import find_project
    from ajgdata.pipeline.importing import import_folder
    from ajgdata.types import checked_name

    given: dict[str, Any] = {"pattern": pattern, "table": table, "file": file, "grasp": grasp}
    given |= {"session": session, "object": object_, "join": _joins(join or [])}
    settings = _import_settings({key: value for key, value in given.items() if value})
    paths = find_project()
    known = paths.dataset(checked_name(dataset)).is_file()
    with bar("importing") as started:
        spec, found, result = import_folder(
            paths,
            dataset,
            folder,
            settings=settings,
            targets=target or [],
            copy=not reference,
            on_change=on_change,
            started=started,
        )
    show_import(result, found, dataset, everything=everything)
    issues = False
    if paths.dataset(dataset).is_file():  # not if nothing could be imported
        where, audio = escape(str(paths.dataset(dataset))), spec.audio
        summary = f"{audio.sample_rate_hz} Hz, channel {audio.channel}, targets "
        summary += ", ".join(spec.targets) or "none"
        say(f"as declared before in {where}" if known else f"now declared in {where}: {summary}")
        issues = show_summary(paths, spec)
    raise typer.Exit(exit_code(result, found) or (INCOMPLETE if issues else 0))


def show_summary(paths: Paths, spec: DatasetSpec) -> bool:
    """Print the numbers of recordings, grasps and classes, what is wrong with the labels, and the
    next command. Returns True if grasps are ambiguous."""
    from ajgdata.pipeline.label_counts import counts, impossible_tasks, label_issues, label_tables

    tables = label_tables(paths, spec.name)
    print_facts(counts(tables, spec.targets))
    issues = label_issues(tables, spec)
    for issue in issues:
        say(f"[yellow]warning[/yellow] {escape(issue.problem)}; {issue.fix}")
    if len(impossible_tasks(tables, spec)) < len(spec.tasks):
        say(f"next: ajgdata validate {spec.name}, then ajgdata run {spec.name}")
    else:
        say(f"next: ajgdata validate {spec.name} (no task of this data set is possible yet)")
    return any(issue.code == "mixed_grasp" for issue in issues)


def exit_code(result: Imported, found: Scan) -> int:
    """Return 0 for an import of everything that belongs to it by name or table, else INCOMPLETE."""
    left_out = (*found.missing, *result.conflicts, *result.failed)
    return INCOMPLETE if left_out or result.unreadable else 0


def show_import(result: Imported, found: Scan, dataset: str, *, everything: bool) -> None:
    """Print the result of an import, the worst first."""
    counts = {"added": result.added, "changed": result.changed, "unchanged": result.unchanged}
    counts |= {"removed": result.removed} if result.removed else {}
    done = ", ".join(f"{count} {what}" for what, count in counts.items())
    say(f"{done} in {result.sessions} session(s) of [b]{dataset}[/b]")
    other_bytes = (
        "has different bytes in the folder. If these are other recordings, import them with "
        "--session; --on-change files takes them"
    )
    other_labels = "stays; --on-change labels takes the folder's"
    gone = "no longer in the folder; --on-change prune removes it here, if all files can be read"
    lines_by_result: dict[str, list[tuple[str, str]]] = {
        "[red]failed[/red]": [*found.missing, *result.failed],
        "[yellow]unreadable[/yellow]": result.unreadable,
        "[yellow]kept[/yellow]": [(name, other_bytes) for name in result.conflicts],
        "[yellow]label[/yellow]": [(name, other_labels) for name in result.differing],
        "[yellow]gone[/yellow]": [(name, gone) for name in result.gone],
        "not used": found.skipped,
    }
    for result_name, lines in lines_by_result.items():
        for line in _grouped(lines, everything=everything):
            say(f"{result_name} {escape(line)}")
    for note in found.notes:
        say(f"[yellow]note[/yellow] {escape(note)}")


def _grouped(named: Sequence[tuple[str, str]], *, everything: bool) -> Iterator[str]:
    """Yield a line for each name and reason; of one reason no more than SHOWN unless all."""
    names: dict[str, list[str]] = defaultdict(list)
    for name, reason in named:
        names[reason].append(name)
    for reason, equal in names.items():
        shown = equal if everything or len(equal) <= SHOWN + 1 else equal[:SHOWN]
        for name in shown:
            yield f"{name}: {reason}"
        if more := len(equal) - len(shown):
            yield f"and {more} more ({reason}); --all shows them"


def _joins(given: list[str]) -> dict[str, str]:
    """Return the tables and keys of `--join`."""
    joins = {}
    for one in given:
        table, colon, key = one.rpartition(":")
        if not (colon and table and key):
            raise DataError("--join", f"{one!r} names no key", "write it as 'more.csv:column'")
        joins[table] = key
    return joins


def _import_settings(given: dict[str, Any]) -> ImportSettings | None:
    from pydantic import ValidationError

    from ajgdata.types import describe

    try:
        return ImportSettings(**given) if given else None
    except ValidationError as error:
        raise describe(error, "ajgdata import") from None
