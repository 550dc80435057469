"""Issues that checks of recordings report, and their numbers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Literal

from ajgdata.types.errors import many

#: Levels of issues, the worst first.
ISSUE_LEVELS = ("error", "warning", "note")
#: The recording_id of an issue of a whole session, and the session_id of an issue of a data set.
WHOLE = "*"
#: Code of the issue of a grasp that was not recorded.
_NO_RECORDING = "skipped"


@dataclass(frozen=True, order=True)
class Finding:
    """An issue that a check reports about one recording, or about a whole session or data set.

    The fields are the columns of results/quarantine/NAME.csv.
    """

    session_id: str  #: `*` for a whole data set
    recording_id: str  #: `*` for a whole session
    file: str
    #: error: the recording is quarantined; warning: it is used, but a person should check it; note:
    #: it is unusual, but correct.
    level: Literal["error", "warning", "note"]
    code: str  #: fixed name of the check's result, e.g. `truncated`
    problem: str
    fix: str

    @property
    def leaves_out(self) -> bool:
        """Whether the recording is excluded from the feature file."""
        return self.level == "error" or self.code in ("copy", "rejected")


def is_of_recording(issue: Finding) -> bool:
    """Return whether an issue is of one recording, and not of a session, a data set or a grasp."""
    return WHOLE not in (issue.session_id, issue.recording_id) and issue.code != _NO_RECORDING


def left_out(findings: Iterable[Finding]) -> set[tuple[str, str]]:
    """Return (session_id, recording_id) of each recording that the feature file excludes."""
    return {(f.session_id, f.recording_id) for f in findings if f.leaves_out}


def flagged(findings: Collection[Finding]) -> set[tuple[str, str]]:
    """Return (session_id, recording_id) of each recording with issues that is used nevertheless."""
    return {(f.session_id, f.recording_id) for f in findings} - left_out(findings)


@dataclass(frozen=True)
class IssueCounts:
    """Numbers of recordings whose worst issue is an error, a warning or a note."""

    errors: int = 0
    warnings: int = 0
    notes: int = 0

    def __add__(self, other: IssueCounts) -> IssueCounts:
        """Return the counts of two data sets together."""
        return IssueCounts(
            self.errors + other.errors, self.warnings + other.warnings, self.notes + other.notes
        )

    def __bool__(self) -> bool:
        """Return True if a recording has an issue."""
        return self != IssueCounts()

    def __str__(self) -> str:
        """Return the counts with nouns, e.g. `1 error, 0 warnings, 60 notes`."""
        counts = (
            many(self.errors, "error"),
            many(self.warnings, "warning"),
            many(self.notes, "note"),
        )
        return ", ".join(counts)


def issue_counts(issues: Iterable[Finding]) -> IssueCounts:
    """Count the recordings of one data set by their worst issue, each recording once.

    Issues of whole sessions and of the data set are not counted.
    """
    worst_ranks: dict[tuple[str, str], int] = {}  # by session_id and recording_id
    for issue in issues:
        if not is_of_recording(issue):
            continue
        recording = (issue.session_id, issue.recording_id)
        rank = ISSUE_LEVELS.index(issue.level)
        worst_ranks[recording] = min(rank, worst_ranks.get(recording, rank))
    levels = Counter(ISSUE_LEVELS[rank] for rank in worst_ranks.values())
    return IssueCounts(errors=levels["error"], warnings=levels["warning"], notes=levels["note"])
