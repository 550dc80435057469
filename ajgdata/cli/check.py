"""`ajgdata check`: list the issues of recordings and labels, and accept changed recordings."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from ajgdata.cli.completion import dataset_names
from ajgdata.cli.console import ATTENTION, AllOption, JsonOption, out, print_json, say, shortened
from ajgdata.paths import Paths, find_project
from ajgdata.store.sessions import list_datasets
from ajgdata.types import (
    ISSUE_LEVELS,
    WHOLE,
    DataError,
    Finding,
    IssueCounts,
    is_of_recording,
    issue_counts,
    many,
)
from ajgdata.types.browse_command import browse_command, filter_word

if TYPE_CHECKING:
    from ajgdata.pipeline.accept import Accepted, NotAccepted


def check(
    dataset: Annotated[
        list[str] | None,
        typer.Argument(help="data sets; default: all", autocompletion=dataset_names),
    ] = None,
    notes: Annotated[bool, typer.Option("--notes", help="also show notes on recordings")] = False,
    everything: AllOption = False,
    accept: Annotated[
        bool, typer.Option("--accept", help="store the hash of new and changed files first")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Check recordings and labels, and list each issue with its fix."""
    from ajgdata.pipeline.validate import not_fetched, validate_dataset

    paths = find_project()
    accepted: dict[str, list[Accepted]] = {}
    not_accepted: dict[str, list[NotAccepted]] = {}
    if accept:
        accepted, not_accepted = accept_changes(
            paths, dataset or (), everything=everything, quiet=as_json
        )
    absent = [] if dataset else not_fetched(paths)
    if absent and not as_json:
        say(f"not fetched, so not checked: {', '.join(absent)}")
    names = dataset or [name for name in list_datasets(paths) if name not in absent]
    n_recordings = 0
    issues_by_set: dict[str, list[Finding]] = {}
    counts = IssueCounts()
    for name in dict.fromkeys(names):
        n_recordings_of_set, issues_of_set = validate_dataset(paths, name)
        n_recordings += n_recordings_of_set
        issues_by_set[name] = issues_of_set
        counts += issue_counts(issues_of_set)
    issues = [issue for issues_of_set in issues_by_set.values() for issue in issues_of_set]
    if as_json:
        print_json(
            {
                "datasets": list(issues_by_set),
                "not_fetched": absent,
                "n_recordings": n_recordings,
                "n_errors": counts.errors,
                "n_warnings": counts.warnings,
                "n_notes": counts.notes,
                "issues": _json_rows(issues_by_set),
                "accepted": _json_rows(accepted),
                "not_accepted": _json_rows(not_accepted),
            }
        )
    else:
        shown = [
            (name, issue)
            for name, issues_of_set in issues_by_set.items()
            for issue in issues_of_set
            if notes or issue.level != "note" or issue.recording_id == WHOLE
        ]
        print_issues(shown, names_dataset=len(issues_by_set) > 1, everything=everything)
        print_browse_commands(shown)
        say(_summary(n_recordings, counts, issues, hides_notes=not notes))
    levels = {issue.level for issue in issues}
    raise typer.Exit(ATTENTION if levels & {"error", "warning"} else 0)


def _json_rows(
    rows_by_set: Mapping[str, Sequence[Finding | Accepted | NotAccepted]],
) -> list[dict[str, str | None]]:
    """Return one object per row, with the name of its data set first. Empty texts are None."""
    return [
        {"dataset": dataset, **{key: text or None for key, text in asdict(row).items()}}
        for dataset, rows in rows_by_set.items()
        for row in rows
    ]


def _summary(
    n_recordings: int, counts: IssueCounts, issues: Sequence[Finding], *, hides_notes: bool
) -> str:
    """Return the last line: numbers of recordings, and of issues of recordings and data sets."""
    text = f"{n_recordings} recordings checked: {counts}"
    general = [issue.level for issue in issues if issue.recording_id == WHOLE]
    n_notes = general.count("note")
    n_issues = len(general) - n_notes
    if n_issues:
        text += f"; {many(n_issues, 'issue')} of sessions or the data set"
    if n_notes:
        text += f"; {many(n_notes, 'note')} on the data set"
    if counts.notes and hides_notes:
        text += " (--notes shows them)"
    return text


def accept_changes(
    paths: Paths, datasets: Sequence[str], *, everything: bool, quiet: bool
) -> tuple[dict[str, list[Accepted]], dict[str, list[NotAccepted]]]:
    """Store the hashes of new and changed recordings of `datasets`.

    Return the accepted recordings by data set, and the recordings that are not accepted, because
    they cannot be decoded. Prints each recording, unless `quiet`. Raises DataError if no data set
    is named.
    """
    from ajgdata.pipeline.accept import accept_recordings

    if not datasets:
        fix = "name the data sets: `ajgdata check NAME --accept`"
        raise DataError("--accept", "no data set is named", fix)
    accepted: dict[str, list[Accepted]] = {}
    not_accepted: dict[str, list[NotAccepted]] = {}
    for name in datasets:
        accepted[name], not_accepted[name] = accept_recordings(paths, name)
        if not quiet:
            print_accepted(name, accepted[name], not_accepted[name], everything=everything)
    return accepted, not_accepted


def print_accepted(
    dataset: str,
    accepted: Sequence[Accepted],
    not_accepted: Sequence[NotAccepted],
    *,
    everything: bool,
) -> None:
    """Print one line per recording, and the number of accepted recordings.

    Unless `everything`, only a few recordings with the same reason are printed.
    """
    changes = [
        (
            f"{item.session_id}/{item.recording_id}",
            "changed" if item.sha256_before else "had no sha256",
        )
        for item in accepted
    ]
    for recording, reason in shortened(changes, everything=everything):
        say(f"[yellow]accepted[/yellow] {escape(f'{recording}: {reason}')}")
    damaged = [
        (f"{item.session_id}/{item.recording_id}: {item.problem}", item.fix)
        for item in not_accepted
    ]
    for recording, fix in shortened(damaged, everything=everything):
        say(f"[red]not accepted[/red] {escape(f'{recording}; {fix}')}")
    say(f"{many(len(accepted), 'recording')} of [b]{dataset}[/b] accepted")


def print_issues(
    issues: Sequence[tuple[str, Finding]], *, names_dataset: bool, everything: bool
) -> None:
    """Print one line per issue, errors first, and the number of issues by code.

    `issues` have the names of their data sets, which are printed if `names_dataset`. Unless
    `everything`, only a few issues with the same level, code and fix are printed.
    """
    problems_by_type: dict[tuple[str, str, str], list[tuple[str, str]]] = defaultdict(list)
    for dataset, issue in issues:
        place = f"{issue.session_id}/{issue.recording_id}"
        if names_dataset:
            place = f"{dataset}/{place}"
        problem = f"{place}: {issue.problem}"
        problems_by_type[issue.level, issue.code, issue.fix].append((problem, issue.fix))
    for level in ISSUE_LEVELS:
        for (level_of_type, code, _), problems in problems_by_type.items():
            if level_of_type == level:
                for problem, reason in shortened(problems, everything=everything):
                    out.out(f"{level} {code} {problem}; {reason}")
    counts = Counter(issue.code for _, issue in issues).most_common()
    if counts:
        out.out(", ".join(f"{code} {count}" for code, count in counts))


def print_browse_commands(issues: Sequence[tuple[str, Finding]]) -> None:
    """Print the command that shows and plays the recordings of each data set and code.

    `issues` are those that are printed, each with the name of its data set.
    """
    codes = dict.fromkeys((name, issue.code) for name, issue in issues if is_of_recording(issue))
    for name, code in codes:
        command = browse_command(name, [filter_word("issue", code)], is_checked=True)
        say(f"see and hear: {escape(command)}")
