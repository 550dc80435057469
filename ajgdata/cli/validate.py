"""`ajgdata validate` and `ajgdata seal`: recordings checked, and accepted as they are."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from typing import Annotated

import typer
from rich.cells import cell_len, set_cell_size

from ajgdata.cli.console import out, say
from ajgdata.pipeline.progress import bar, tracked
from ajgdata.types import Finding

#: Lines of one kind that are shown unless all are requested.
SHOWN = 5
LEVELS = ("error", "warning", "note")


def validate(
    dataset: Annotated[
        list[str] | None, typer.Argument(help="data sets; default: every one")
    ] = None,
    notes: Annotated[bool, typer.Option("--notes", help="also show notes")] = False,
    everything: Annotated[
        bool, typer.Option("--all", help="show every issue, not a few of each kind")
    ] = False,
) -> None:
    """Check every recording; one line for each issue, with the fix. Exit code 1 if any."""
    from ajgdata.paths import find_project
    from ajgdata.pipeline.validate import validate_dataset
    from ajgdata.store.sessions import list_datasets

    paths = find_project()
    checked, issues = 0, list[Finding]()
    with bar("checking") as started:
        for name in dataset or list_datasets(paths):
            count, more = validate_dataset(paths, name, started)
            checked, issues = checked + count, issues + more
    if shown := [issue for issue in issues if notes or issue.level != "note"]:
        print_issues(shown, everything=everything)
    counts = Counter(issue.level for issue in issues)
    say(
        f"{checked} recordings checked: {counts['error']} errors, {counts['warning']} warnings, "
        f"{counts['note']} notes" + ("" if notes or not counts["note"] else " (--notes shows them)")
    )
    raise typer.Exit(bool(counts["error"] or counts["warning"]))


def print_issues(issues: Sequence[Finding], *, everything: bool) -> None:
    """Print a table with one line for each issue, however wide the terminal is.

    Errors come first, and of one kind (level, code and fix) no more than SHOWN lines unless
    `everything`.
    """
    kinds: dict[tuple[str, str, str], list[Finding]] = defaultdict(list)
    for issue in sorted(issues, key=lambda issue: LEVELS.index(issue.level)):
        kinds[issue.level, issue.code, issue.fix].append(issue)
    rows = [("recording", "level", "what", "problem", "fix")]
    for (level, code, fix), equal in kinds.items():
        shown = equal if everything or len(equal) <= SHOWN + 1 else equal[:SHOWN]
        rows += [(f"{i.session_id}/{i.recording_id}", level, code, i.problem, fix) for i in shown]
        if more := len(equal) - len(shown):
            rows.append((f"and {more} more", level, code, "like the ones above", "--all shows all"))
    widths = [max(cell_len(row[column]) for row in rows) for column in range(4)]
    for *cells, fix in rows:
        padded = (set_cell_size(cell, width) for cell, width in zip(cells, widths, strict=True))
        out.out("  ".join([*padded, fix]))
    counts = Counter(issue.code for issue in issues).most_common()
    out.out("\n" + ", ".join(f"{code} {count}" for code, count in counts))


def seal(
    dataset: Annotated[str, typer.Argument(help="name of a folder below datasets/")],
) -> None:
    """Record checksums for new or edited recordings."""
    from ajgdata.paths import find_project
    from ajgdata.store.sessions import list_sessions, read_dataset
    from ajgdata.store.sessions import seal as seal_session

    paths = find_project()
    read_dataset(paths, dataset)
    for session in tracked(list_sessions(paths, dataset), "sealing"):
        changed = seal_session(paths, dataset, session)
        say(f"{dataset}/{session}: {changed} recordings sealed")
