"""`ajgdata validate`: every recording checked, and one line per issue."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Annotated

import typer

from ajgdata.cli.console import out, say, shortened
from ajgdata.pipeline.progress import bar
from ajgdata.types import Finding

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
    print_issues([i for i in issues if notes or i.level != "note"], everything=everything)
    counts = Counter(issue.level for issue in issues)
    say(
        f"{checked} recordings checked: {counts['error']} errors, {counts['warning']} warnings, "
        f"{counts['note']} notes" + ("" if notes or not counts["note"] else " (--notes shows them)")
    )
    raise typer.Exit(bool(counts["error"] or counts["warning"]))


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
