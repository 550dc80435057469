"""Number of recordings with issues, in the words of `check`, the run and the report."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from ajgdata.types.base import ISSUE_LEVELS, WHOLE, Finding, many

#: Code of an issue of a grasp that was not recorded.
_NO_RECORDING = "skipped"


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
        """Return `1 error, 0 warnings, 60 notes`."""
        counts = zip((self.errors, self.warnings, self.notes), ISSUE_LEVELS, strict=True)
        return ", ".join(many(count, noun) for count, noun in counts)


def issue_counts(issues: Iterable[Finding]) -> IssueCounts:
    """Count the recordings of one data set by their worst issue, each recording once.

    Issues of whole sessions and of the data set are not counted.
    """
    worst: dict[tuple[str, str], int] = {}
    for issue in issues:
        if issue.recording_id == WHOLE or issue.code == _NO_RECORDING:
            continue
        name = (issue.session_id, issue.recording_id)
        rank = ISSUE_LEVELS.index(issue.level)
        worst[name] = min(rank, worst.get(name, rank))
    ranks = list(worst.values())
    return IssueCounts(*(ranks.count(rank) for rank in range(len(ISSUE_LEVELS))))
