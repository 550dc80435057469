"""`ajgdata check`: check every recording of data sets; one line per issue."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Annotated

import typer

from ajgdata.cli.console import ATTENTION, out, say, shortened
from ajgdata.types import Finding

LEVELS = ("error", "warning", "note")


def check(
    dataset: Annotated[list[str] | None, typer.Argument(help="data sets; default: all")] = None,
    notes: Annotated[bool, typer.Option("--notes", help="also show notes")] = False,
    everything: Annotated[
        bool, typer.Option("--all", help="list all, not only a few of each kind")
    ] = False,
) -> None:
    """Check recordings and labels, and list each issue with its fix."""
    from ajgdata.paths import find_project
    from ajgdata.pipeline.validate import validate_dataset
    from ajgdata.store.sessions import list_datasets

    paths = find_project()
    checked, issues = 0, list[Finding]()
    for name in dataset or list_datasets(paths):
        count, issues_of_set = validate_dataset(paths, name)
        checked, issues = checked + count, issues + issues_of_set
    print_issues([i for i in issues if notes or i.level != "note"], everything=everything)
    counts = Counter(issue.level for issue in issues)
    say(
        f"{checked} recordings checked: {counts['error']} errors, {counts['warning']} warnings, "
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
